// gz-sim's DetachableJoint.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "text_world.h"

namespace ruedo::world {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::string hold(const std::string& parent, const std::string& model, const std::string& link) {
  return "<plugin filename='gz-sim-detachable-joint-system' "
         "name='gz::sim::systems::DetachableJoint'><parent_link>" +
         parent + "</parent_link><child_model>" + model + "</child_model><child_link>" + link +
         "</child_link><detach_topic>/let/go</detach_topic></plugin>";
}

const char* const kBox = "<model name='box'><link name='l'/></model>";

TEST(Holds, AreRead) {
  const auto world = world_of("<model name='m'><link name='a'/><link name='b'/>" +
                              hold("b", "box", "l") + "</model>" + kBox);
  EXPECT_THAT(texts(*world), IsEmpty());
  const Model& model = *world->models[0].model;
  ASSERT_EQ(model.holds.size(), 1u);
  EXPECT_EQ(model.holds[0].name, "box");
  EXPECT_EQ(model.links[model.holds[0].link].name, "b");
  EXPECT_TRUE(world->models[0].is_robot());
}

TEST(Holds, OfANestedModel) {
  const auto world =
      world_of("<model name='m'><link name='a'/><model name='in'><link name='x'/></model>" +
               hold("a", "in", "x") + "</model>");
  EXPECT_THAT(texts(*world), IsEmpty());
  EXPECT_EQ(world->models[0].model->holds.at(0).other_model, "");
  EXPECT_EQ(world->models[0].model->holds.at(0).other_link, "in.x");
}

TEST(Holds, ReportsMissingModelsAndLinks) {
  const auto world = world_of(
      "<model name='m'><link name='a'/>" + hold("a", "bax", "l") + hold("a", "box", "k") +
      hold("c", "box", "l") +
      "<plugin filename='f' name='gz::sim::systems::DetachableJoint'><parent_link>a</parent_link>"
      "</plugin></model>" +
      kBox);
  EXPECT_THAT(
      texts(*world),
      ElementsAre("<plugin>: DetachableJoint: <parent_link> 'c' is not a link of the model; "
                  "it holds nothing",
                  "<plugin>: DetachableJoint has no <child_model>; it holds nothing",
                  "DetachableJoint: the world has no model 'bax'; it is held when it comes",
                  "DetachableJoint: the model 'box' has no link 'k'; nothing is held"));
}

TEST(Holds, ReportsLinksOfOneBody) {
  const auto world = world_of(
      "<model name='m'><link name='a'/><link name='b'/><link name='c'/><joint name='j' "
      "type='fixed'><parent>a</parent><child>b</child></joint>" +
      hold("a", "m", "a") + hold("a", "m", "b") + hold("a", "m", "c") + "</model>");
  EXPECT_THAT(texts(*world),
              ElementsAre("DetachableJoint: 'a' and 'a' are one body; nothing is held",
                          "DetachableJoint: 'a' and 'b' are one body; nothing is held"));
}

}  // namespace
}  // namespace ruedo::world
