// <joint> in <world>: the models that it connects become one.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "text_world.h"

namespace ruedo::world {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

const std::string kPost = "<model name='post'><static>true</static><link name='l'/></model>";
const std::string kGate = "<model name='gate'><pose>2 0 0 0 0 0</pose><link name='l'/></model>";
const std::string kHinge =
    "<joint name='hinge' type='revolute'><parent>post::l</parent><child>gate::l</child><pose>-1 0 "
    "0 "
    "0 0 0</pose><axis><xyz>0 0 1</xyz></axis></joint>";

TEST(WorldJoints, TieModelsTogether) {
  const auto world =
      world_of(kPost + "<model name='other'><link name='l'/></model>" + kGate + kHinge);
  EXPECT_THAT(
      texts(*world),
      ElementsAre("joints of the world tie it to 'gate': together they are one model, called "
                  "'post'"));
  ASSERT_EQ(world->models.size(), 2u);
  const Model& model = *world->models[0].model;
  EXPECT_EQ(world->models[0].name, "post");
  ASSERT_EQ(model.links.size(), 2u);
  EXPECT_EQ(link_of(model, "gate.l").X_ML.translation, Vec3(2, 0, 0));
  EXPECT_FALSE(model.is_static);
  const Joint& hinge = model.joints.at(0);
  EXPECT_EQ(hinge.type, JointType::revolute);
  EXPECT_EQ(hinge.X_MJ.translation, Vec3(1, 0, 0));
  EXPECT_EQ(model.links[hinge.parent].name, "l");
  EXPECT_EQ(model.links[hinge.child].name, "gate.l");
  EXPECT_EQ(model.joints.at(1).name, "l.anchor");  // the post stands fast
}

// The robot gives its name: its channels stay what they were.
TEST(WorldJoints, ARobotKeepsItsName) {
  const std::string robot =
      "<model name='robot'><pose>0 3 0 0 0 0</pose><link name='l'><sensor name='imu' "
      "type='imu'/></link></model>";
  const auto world = world_of(
      kPost + robot +
      "<joint name='rope' type='ball'><parent>post::l</parent><child>robot::l</child></joint>");
  ASSERT_EQ(world->models.size(), 1u);
  EXPECT_EQ(world->models[0].name, "robot");
  EXPECT_EQ(world->models[0].model->sensors.at(0).name, "imu");
}

// The world itself may be the parent; a name that is not a link of a model is reported.
TEST(WorldJoints, ToTheWorldAndToNothing) {
  const auto world = world_of(
      kGate +
      "<joint name='post' type='revolute'><parent>world</parent><child>gate::l</child><axis><xyz>0 "
      "0 "
      "1</xyz></axis></joint><joint name='no' type='fixed'><parent>gate::l</parent><child>where::l"
      "</child></joint>");
  ASSERT_EQ(world->models.size(), 1u);
  EXPECT_EQ(world->models[0].model->joints.at(0).parent, -1);
  EXPECT_THAT(texts(*world), ElementsAre(HasSubstr("joins 'gate::l' and 'where::l'")));
}

}  // namespace
}  // namespace ruedo::world
