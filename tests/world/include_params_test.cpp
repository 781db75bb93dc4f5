// <experimental:params> of an <include>: which parts of the included model change.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "temporary_folder.h"
#include "text_world.h"
#include "world/load.h"

namespace ruedo::world {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const char* const kModel = R"xml(<sdf version="1.9"><model name="cart">
<link name="base"><inertial><mass>4</mass></inertial>
<collision name="c"><geometry><box><size>1 1 1</size></box></geometry></collision>
<visual name="v"><geometry><sphere><radius>1</radius></sphere></geometry><transparency>0.5</transparency></visual>
<sensor name="eye" type="camera"><update_rate>10</update_rate><camera><image><width>64</width><height>48</height></image></camera></sensor>
<sensor name="gps" type="navsat"/></link>
<link name="arm"/><joint name="j" type="fixed"><parent>base</parent><child>arm</child></joint>
<model name="inner"><link name="tip"/></model>
</model></sdf>)xml";

struct Included {
  TemporaryFolder folder;
  std::shared_ptr<const WorldModel> with(const std::string& params, const std::string& more = "") {
    folder.write("cart.sdf", kModel);
    return load_world(folder.write(
        "w.sdf",
        "<sdf version='1.9' xmlns:experimental='http://sdformat.org/schemas/experimental'>"
        "<world name='w'><include><uri>cart.sdf</uri><experimental:params>" +
            params + "</experimental:params></include>" + more + "</world></sdf>"));
  }
};

std::vector<std::string> sensors(const Model& model) {
  std::vector<std::string> names;
  for (const SensorDescription& each : model.sensors) names.push_back(each.name);
  return names;
}

TEST(IncludeParams, AddModifyRemoveReplace) {
  Included included;
  const auto world = included.with(
      R"(<sensor element_id="base" name="scan" action="add" type="imu"/>
         <link element_id="" name="mast" action="add"><pose>0 0 1 0 0 0</pose></link>
         <joint element_id="" name="m" type="fixed" action="add"><parent>base</parent><child>mast</child></joint>
         <sensor element_id="base::eye" action="modify"><update_rate>30</update_rate><camera><image><width>32</width></image></camera></sensor>
         <sensor element_id="base::gps" action="remove"/>
         <collision element_id="base::c" name="round" action="replace"><geometry><sphere><radius>0.3</radius></sphere></geometry></collision>
         <visual element_id="base::v" action="remove"><transparency/></visual>)");
  EXPECT_THAT(texts(*world), IsEmpty());
  const Model& cart = *world->models.at(0).model;
  EXPECT_THAT(sensors(cart), ElementsAre("eye", "scan"));
  EXPECT_EQ(cart.sensors[0].element->number("update_rate", 0, Allowed::between(0, 99)), 30);
  EXPECT_EQ(cart.sensors[0].element->integer("camera/image/width", 0, Allowed::between(0, 99)), 32);
  EXPECT_EQ(cart.sensors[0].element->integer("camera/image/height", 0, Allowed::between(0, 99)),
            48);
  EXPECT_EQ(cart.links[0].collisions.at(0).name, "round");
  EXPECT_EQ(cart.links[0].collisions[0].geometry.shape, Shape::sphere);
  EXPECT_EQ(cart.links[0].visuals.at(0).transparency, 0.0);
  EXPECT_EQ(cart.links.size(), 4u);
}

// Without an action of its own an element has one in each child; names go through nested models.
TEST(IncludeParams, ActionsOfChildrenAndNestedModels) {
  Included included;
  const auto world = included.with(
      R"(<link element_id="base"><inertial action="modify"><mass>9</mass></inertial><visual name="v" action="remove"/></link>
         <link element_id="inner::tip"><gravity action="add">false</gravity></link>)");
  EXPECT_THAT(texts(*world), IsEmpty());
  const Model& cart = *world->models.at(0).model;
  EXPECT_EQ(cart.links[0].inertial.mass, 9);
  EXPECT_THAT(cart.links[0].visuals, IsEmpty());
  EXPECT_FALSE(cart.links.at(2).gravity);
}

// Another <include> of the same file has the model as it is.
TEST(IncludeParams, ChangeOneIncludeOnly) {
  Included included;
  const auto world = included.with("<sensor element_id='base::gps' action='remove'/>",
                                   "<include><uri>cart.sdf</uri><name>other</name></include>");
  EXPECT_THAT(sensors(*world->models.at(0).model), ElementsAre("eye"));
  EXPECT_THAT(sensors(*world->models.at(1).model), ElementsAre("eye", "gps"));
}

TEST(IncludeParams, ReportsInvalidChangesAndAppliesTheRest) {
  struct Case {
    const char* params;
    const char* text;
  };
  for (const Case& c :
       {Case{"<sensor element_id='base::ear' action='remove'/>",
             "<sensor> in <experimental:params>: 'base::ear' is not in the included model"},
        Case{"<sensor action='remove'/>", "has no element_id"},
        Case{"<link element_id='base' action='erase'/>", "action 'erase' is not allowed"},
        Case{"<link element_id='base'><gravity>0</gravity></link>", "has no action"},
        Case{"<sensor element_id='base' name='eye' type='imu' action='add'/>",
             "'eye' is there already"},
        Case{"<sensor element_id='base' type='imu' action='add'/>", "has no name"},
        Case{"<link element_id='base' action='remove'><light/></link>",
             "<light> in <experimental:params>: there is no such element to remove"}}) {
    Included included;
    const auto world =
        included.with(std::string(c.params) + "<sensor element_id='base::gps' action='remove'/>");
    EXPECT_THAT(texts(*world), ElementsAre(HasSubstr(c.text)));
    EXPECT_THAT(sensors(*world->models.at(0).model), ElementsAre("eye"));
  }
}

}  // namespace
}  // namespace ruedo::world
