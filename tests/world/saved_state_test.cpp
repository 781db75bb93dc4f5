// Worlds that were saved while they ran, in both formats.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "temporary_folder.h"
#include "text_world.h"

namespace ruedo::world {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

const std::string kArm =
    "<model name='arm'><link name='base'/><link name='upper'><pose>0 0 1 0 0 0</pose></link><link "
    "name='hand'><pose>0 0 2 0 0 0</pose></link>"
    "<joint name='shoulder' type='revolute'><parent>base</parent><child>upper</child><axis><xyz>0 "
    "1 "
    "0</xyz></axis></joint><joint name='wrist' type='prismatic'><parent>upper</parent>"
    "<child>hand</child><axis><xyz>0 0 "
    "1</xyz><limit><lower>0</lower><upper>0.5</upper></limit></axis></joint></model>";

void expect_moved(const WorldModel& world) {
  EXPECT_THAT(texts(world),
              ElementsAre(HasSubstr("it begins at 1.570796"), HasSubstr("it begins at 0.25 m of")));
  const ModelInstance& arm = world.models.at(0);
  EXPECT_EQ(arm.X_WM.translation, Vec3(5, 0, 0));
  // The shoulder lies 1 m up and points ahead; the hand is 1 m further, and slid out by a quarter.
  const Link& hand = link_of(*arm.model, "hand");
  EXPECT_NEAR((hand.X_ML.translation - Vec3(1.25, 0, 1)).norm(), 0, 1e-6);
  EXPECT_NEAR((hand.X_ML.rotation * Vec3::UnitZ() - Vec3::UnitX()).norm(), 0, 1e-6);
  // Its slide reads 0 there, and may go as far as before.
  EXPECT_NEAR(arm.model->joints[1].axis.lower, -0.25, 1e-6);
  EXPECT_NEAR(arm.model->joints[1].axis.upper, 0.25, 1e-6);
  EXPECT_NEAR((arm.model->joints[1].X_MJ.rotation * Vec3::UnitZ() - Vec3::UnitX()).norm(), 0, 1e-6);
}

TEST(SavedState, PutsJointsBackByTheirLinks) {
  expect_moved(*world_of(
      kArm +
      "<state world_name='w'><sim_time>12 0</sim_time><model name='arm'><pose>5 0 0 0 0 0</pose>"
      "<link name='base'><pose>5 0 0 0 0 0</pose><velocity>0 0 0 0 0 0</velocity></link>"
      "<link name='upper'><pose>5 0 1 0 1.5707963 0</pose></link>"
      "<link name='hand'><pose>6.25 0 1 0 1.5707963 0</pose></link></model></state>"));
}

TEST(SavedState, PutsJointsBackByTheirPositions) {
  expect_moved(*world_of(kArm +
                         "<state world_name='w'><model name='arm'><pose>5 0 0 0 0 0</pose><joint "
                         "name='shoulder'><angle axis='0'>1.5707963</angle></joint><joint "
                         "name='wrist'><angle axis='0'>0.25</angle></joint></model></state>"));
  expect_moved(*world_of(
      kArm +
      "<state world_name='w'><model_state name='arm'><pose>5 0 0 0 0 0</pose><joint_state "
      "name='shoulder'><axis_state><position "
      "degrees='true'>90</position></axis_state></joint_state>"
      "<joint_state name='wrist'><axis_state><position>0.25</position></axis_state></joint_state>"
      "</model_state></state>"));
}

// A drawer that is a third open; a joint that mimics it follows as before.
TEST(InitialPosition, MovesTheJointsChildren) {
  const auto world = world_of(
      "<model name='m'><link name='a'/><link name='b'/><link name='c'/><joint name='j' "
      "type='prismatic'><parent>a</parent><child>b</child><axis><xyz>1 0 0</xyz>"
      "<initial_position>0.3</initial_position><limit><lower>0</lower><upper>0.9</upper></limit>"
      "</axis></joint><joint name='k' "
      "type='prismatic'><parent>a</parent><child>c</child><axis><xyz>1 "
      "0 0</xyz><mimic joint='j'><multiplier>2</multiplier></mimic></axis></joint></model>");
  EXPECT_THAT(texts(*world),
              ElementsAre("it begins at 0.3 m of its file, and its positions count from there"));
  const Model& model = *world->models.at(0).model;
  EXPECT_EQ(link_of(model, "b").X_ML.translation, Vec3(0.3, 0, 0));
  EXPECT_NEAR(model.joints[0].axis.upper, 0.6, 1e-12);
  // Of 0 there, which is 0.3 of the file: 2 (0 - reference) = 0.6.
  EXPECT_NEAR(-2 * model.joints[1].mimic_reference, 0.6, 1e-12);
}

// As gz_ros2_control has it.
TEST(InitialPosition, OfRos2Control) {
  const auto world = load_world_text(
      "<robot name='r'><link name='a'/><link name='b'/><joint name='j' type='prismatic'><parent "
      "link='a'/><child link='b'/><axis xyz='0 0 1'/><limit lower='0' upper='1' effort='1' "
      "velocity='1'/></joint><ros2_control name='s' type='system'><joint name='j'><state_interface "
      "name='position'><param name='initial_value'>0.7</param></state_interface></joint>"
      "</ros2_control></robot>",
      "/nowhere/r.urdf");
  EXPECT_THAT(texts(*world), ElementsAre(HasSubstr("it begins at 0.7 m of its file")));
  EXPECT_EQ(link_of(*world->models.back().model, "b").X_ML.translation, Vec3(0, 0, 0.7));
}

TEST(SavedState, ReportsStatesThatItCannotRestore) {
  const auto world =
      world_of(kArm +
               "<state world_name='w'><model name='arm'><pose>5 0 0 0 0 0</pose>"
               "<link name='base'><pose>5 0 0 0 0 0</pose><velocity>0.5 0 0 0 0 0</velocity></link>"
               "<link name='upper'><pose>5 0 4 0 0 0</pose></link></model></state>");
  EXPECT_THAT(texts(*world),
              ElementsAre("<velocity> is not supported: everything begins at rest",
                          HasSubstr("its link 'upper' was elsewhere than any position")));
}

// Its joints are put back all the same.
TEST(SavedState, OfAModelWithoutAPose) {
  const auto world =
      world_of(kArm +
               "<state world_name='w'><model name='arm'><joint name='wrist'><angle axis='0'>0.25"
               "</angle></joint></model><model name='gone'/></state>");
  EXPECT_THAT(texts(*world), ElementsAre("it has no <pose>; the model is where its own pose says",
                                         "it has no <pose>; the model is where its own pose says",
                                         HasSubstr("it begins at 0.25 m of"),
                                         "the world has no model 'gone'; its state is left out"));
  EXPECT_NEAR(link_of(*world->models.at(0).model, "hand").X_ML.translation.z(), 2.25, 1e-9);
}

TEST(SavedState, ReportsUnknownElements) {
  EXPECT_THAT(
      texts(*world_of(kArm +
                      "<state world_name='w'><modle name='arm'/><model name='arm'><pose>5 0 0 0 0 0"
                      "</pose><joint name='wrist'><angel>1</angel></joint></model></state>")),
      ElementsAre("<modle> is not known and left out; did you mean <model>?",
                  "<angel> is not known and left out; did you mean <angle>?"));
  EXPECT_THAT(texts(*world_of(kArm + "<state><model><pose>5 0 0 0 0 0</pose></model></state>")),
              ElementsAre("<model> has no name; it is left out"));
}

TEST(SavedState, NamesASecondStateOfAModel) {
  const auto state = [](const std::string& x, const std::string& inside) {
    return "<model name='arm'><pose>" + x + " 0 0 0 0 0</pose>" + inside + "</model>";
  };
  const std::string slide = "<joint name='wrist'><angle>0</angle></joint>";
  const auto world = world_of(kArm + "<state>" + state("1", slide + slide) + "</state><state>" +
                              state("2", "") + "</state>");
  EXPECT_THAT(texts(*world),
              ElementsAre("a second state of 'wrist' is left out; the first one counts",
                          "a second state of this model; this one counts"));
  EXPECT_EQ(world->models.at(0).X_WM.translation.x(), 2.0);
}

TEST(SavedState, PutsTheModelsOfAFleetBack) {
  const TemporaryFolder folder;
  folder.write("arm.sdf", "<sdf version='1.9'>" + kArm + "</sdf>");
  const auto world = load_world_text(
      "<sdf version='1.9'><world name='w'><ruedo:fleet name='f'><include><uri>arm.sdf</uri>"
      "</include><ruedo:count>2</ruedo:count></ruedo:fleet><state><model name='f_2'><pose>7 0 0 0 "
      "0 0</pose></model></state></world></sdf>",
      folder / "w.sdf");
  EXPECT_THAT(texts(*world), ElementsAre());
  EXPECT_EQ(world->models.at(1).name, "f_2");
  EXPECT_EQ(world->models.at(1).X_WM.translation.x(), 7.0);
  EXPECT_NE(world->models.at(0).X_WM.translation.x(), 7.0);
}

TEST(SavedState, PutsLightsBack) {
  const auto world = world_of(
      "<light name='lamp' type='point'><pose>0 0 1 0 0 0</pose></light><state "
      "world_name='w'><light name='lamp'><pose>0 0 3 0 0 0</pose></light></state>");
  EXPECT_EQ(world->lights.at(0).pose.translation, Vec3(0, 0, 3));
}

}  // namespace
}  // namespace ruedo::world
