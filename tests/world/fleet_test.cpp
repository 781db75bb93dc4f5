// <ruedo:fleet> and --drive: positions computed by hand, room, names, a shared model, and what is
// refused.
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "temporary_folder.h"
#include "world/drives/placement.h"
#include "world/load.h"

namespace ruedo::world {
namespace {

// A box of 0.6 x 0.8 m (circle of radius 0.5 m) that reaches from z = 0 to 0.4 m.
const char* kBot =
    "<sdf version='1.9'><model name='bot'><link name='base'><pose>0 0 0.2 0 0 0</pose><collision "
    "name='c'><geometry><box><size>0.6 0.8 0.4</size>"
    "</box></geometry></collision><sensor name='imu' type='imu'/></link></model></sdf>";
const char* kGround =
    "<model name='ground'><static>true</static><link name='l'><collision "
    "name='c'><geometry><plane/></geometry></collision></link></model>";

std::string box(const std::string& name, const std::string& pose, const std::string& size) {
  return "<model name='" + name + "'><static>true</static><pose>" + pose +
         "</pose><link name='l'><collision name='c'><geometry><box><size>" + size +
         "</size></box></geometry></collision></link></model>";
}

class Fleets : public testing::Test {
 protected:
  void SetUp() override { folder.write("bot.sdf", kBot); }
  std::shared_ptr<const WorldModel> load(const std::string& attributes, const std::string& inside,
                                         const std::string& others = "") const {
    return load_world(folder.write(
        "world.sdf", std::string("<sdf version='1.9'><world name='w'>\n<ruedo:fleet ") +
                         attributes + "><include><uri>bot.sdf</uri></include>" + inside +
                         "</ruedo:fleet>\n" + kGround + others + "</world></sdf>"));
  }
  std::string error_of(const std::string& attributes, const std::string& inside,
                       const std::string& others = "") const {
    try {
      load(attributes, inside, others);
    } catch (const InputError& error) {
      return error.message();
    }
    return "";
  }
  TemporaryFolder folder;
};

TEST_F(Fleets, GridIsCentredOnTheGround) {
  const auto world = load(
      "name='r'",
      "<ruedo:count>5</ruedo:count><ruedo:columns>3</ruedo:columns><ruedo:spacing>2</ruedo:spacing>"
      "<ruedo:center>10 20</ruedo:center><ruedo:heading>0.5</ruedo:heading>",
      box("stage", "12 19 0.1 0 0 0", "1.5 1.5 0.2"));
  ASSERT_EQ(world->models.size(), 7u);  // after the world's own
  const double expected[5][3] = {{8, 19, 0}, {10, 19, 0}, {12, 19, 0.2}, {8, 21, 0}, {10, 21, 0}};
  for (size_t i = 0; i < 5; ++i) {
    const ModelInstance& robot = world->models[2 + i];
    EXPECT_EQ(robot.name, "r_" + std::to_string(i + 1));
    EXPECT_LT(
        (robot.X_WM.translation - Vec3(expected[i][0], expected[i][1], expected[i][2])).norm(),
        1e-6)
        << robot.X_WM.translation.transpose();
    EXPECT_NEAR(heading(robot.X_WM.rotation), 0.5, 1e-12);
    EXPECT_EQ(robot.model, world->models[2].model);  // read once
  }
}

// Without a spacing, circles about the robots are 0.2 m apart: 2 * 0.5 + 0.2.
TEST_F(Fleets, RingLooksOutwards) {
  const auto world = load("name='r' arrangement='ring'", "<ruedo:count>6</ruedo:count>");
  for (int i = 0; i < 6; ++i) {
    const Pose& X = world->models[1 + static_cast<size_t>(i)].X_WM;
    const double angle = i * std::numbers::pi / 3;
    EXPECT_NEAR(X.translation.x(), 1.2 * std::cos(angle),
                1e-9);  // of six, the radius is the spacing
    EXPECT_NEAR(X.translation.y(), 1.2 * std::sin(angle), 1e-9);
    EXPECT_NEAR(std::remainder(heading(X.rotation) - angle, 2 * std::numbers::pi), 0, 1e-9);
  }
  EXPECT_NEAR(load("name='r' arrangement='ring'",
                   "<ruedo:count>2</ruedo:count><ruedo:radius>7</ruedo:radius>")
                  ->models[1]
                  .X_WM.translation.x(),
              7, 1e-9);
}

TEST_F(Fleets, RandomPlacesAreApartAndRepeat) {
  const std::string inside =
      "<ruedo:count>60</ruedo:count><ruedo:size>16 "
      "12</ruedo:size><ruedo:spacing>1.1</ruedo:spacing>";
  const std::string wall = box("wall", "0 0 1 0 0 0.3", "10 0.3 2");
  const auto world = load("name='r' arrangement='random'", inside, wall);
  ASSERT_EQ(world->models.size(), 62u);
  for (size_t i = 2; i < world->models.size(); ++i) {
    const Vec3& at = world->models[i].X_WM.translation;
    EXPECT_LE(std::abs(at.x()), 8);
    EXPECT_LE(std::abs(at.y()), 6);
    for (size_t k = 2; k < i; ++k) EXPECT_GE((at - world->models[k].X_WM.translation).norm(), 1.1);
    WorldModel alone;
    alone.models = {world->models[1]};
    EXPECT_EQ(overlapped(alone, *world->models[i].model, world->models[i].X_WM), "");
  }
  const auto again = load("name='r' arrangement='random'", inside, wall);
  const auto other =
      load("name='r' arrangement='random'", inside + "<ruedo:seed>2</ruedo:seed>", wall);
  EXPECT_EQ(again->models[40].X_WM.translation, world->models[40].X_WM.translation);
  EXPECT_NE(other->models[40].X_WM.translation, world->models[40].X_WM.translation);
}

TEST_F(Fleets, RefuseMoreRobotsThanFit) {
  const std::string two = "<ruedo:count>2</ruedo:count>";
  EXPECT_EQ(error_of("name='r'", two, box("wall", "0.6 0 1 0 0 0", "0.2 4 2")),
            "<ruedo:fleet>: there is no room for 'r_2' at 0.6 0: it would stand in 'wall'");
  EXPECT_EQ(error_of("name='r'", two + "<ruedo:spacing>0.5</ruedo:spacing>"),
            "<ruedo:fleet>: there is no room for 'r_2' at 0.25 0: it would stand in 'r_1'");
  EXPECT_EQ(error_of("name='r' arrangement='random'", two + "<ruedo:size>0.5 0.5</ruedo:size>"),
            "<ruedo:fleet>: there is room for 1 of 2 robots in 0.5 x 0.5 m; a larger <ruedo:size> "
            "or a smaller <ruedo:spacing> helps");
}

TEST_F(Fleets, RefuseInvalidElements) {
  const std::string two = "<ruedo:count>2</ruedo:count>";
  EXPECT_EQ(error_of("", two), "<ruedo:fleet>: has no name; the attribute name is required");
  EXPECT_EQ(error_of("name='r'", ""), "<ruedo:fleet>: has no <ruedo:count>");
  EXPECT_EQ(error_of("name='r' arrangement='line'", two),
            "<ruedo:fleet>: arrangement 'line' is not allowed; allowed are grid, ring and random");
  EXPECT_EQ(error_of("name='r'", two + "<ruedo:radius>1</ruedo:radius>"),
            "<ruedo:radius>: is for arrangement=\"ring\"");
  EXPECT_EQ(error_of("name='r'", two + "<include><uri>bot.sdf</uri></include>"),
            "<ruedo:fleet>: has 2 <include>; it needs one, of the model that is placed");
  EXPECT_EQ(error_of("name='r'", "<ruedo:cuont>2</ruedo:cuont>"),
            "<ruedo:cuont> is not known in <ruedo:fleet>; did you mean <ruedo:count>?");
  EXPECT_EQ(error_of("name='r'", two, box("r_2", "50 0 0.5 0 0 0", "1 1 1")),
            "<ruedo:fleet>: the name 'r_2' is taken by another model of the world");
  EXPECT_EQ(
      error_of("name='r'", "<ruedo:count>0</ruedo:count>"),
      "<ruedo:fleet/ruedo:count>: '0' is not allowed; allowed is a whole number from 1 to 100000");
}

const char* kUrdf =
    R"(<robot name="bot"><link name="base"><collision><origin xyz="0 0 0.2"/><geometry><box size="0.4 0.3 0.2"/></geometry></collision></link>
  <link name="wl"><collision><origin rpy="1.5707963 0 0"/><geometry><cylinder radius="0.1" length="0.04"/></geometry></collision></link>
  <link name="wr"><collision><origin rpy="1.5707963 0 0"/><geometry><cylinder radius="0.1" length="0.04"/></geometry></collision></link>
  <joint name="jl" type="continuous"><parent link="base"/><child link="wl"/><origin xyz="0 0.2 0.1"/><axis xyz="0 1 0"/></joint>
  <joint name="jr" type="continuous"><parent link="base"/><child link="wr"/><origin xyz="0 -0.2 0.1"/><axis xyz="0 1 0"/></joint></robot>)";

// A robot without a plugin: by an option, by two lines in an <include>, alone and spawned.
TEST(DriveOption, GivesARobotItsWheels) {
  TemporaryFolder folder;
  const std::string urdf = folder.write("bot.urdf", kUrdf);
  LoadOptions options;
  options.drives = {{"bot", {"jl"}, {"jr"}}};
  const auto expect_drive = [](const ModelInstance& bot) {
    ASSERT_TRUE(bot.model->drive) << bot.name;
    EXPECT_DOUBLE_EQ(bot.model->drive->wheel_radius, 0.1);
    EXPECT_NEAR(bot.model->drive->track, 0.4, 1e-12);
    EXPECT_NEAR(bot.X_WM.translation.z(), 0, 1e-6);
  };
  expect_drive(load_world(urdf, options)->models[1]);
  const std::string empty = folder.write(
      "empty.sdf", std::string("<sdf version='1.9'><world name='w'>") + kGround + "</world></sdf>");
  options.spawns = {{"bot.urdf", "bot", 1, 0, 0}, {"bot.urdf", "other", 3, 0, 0}};
  const auto spawned = load_world(empty, options);
  expect_drive(spawned->models[1]);
  ASSERT_TRUE(spawned->models[2].model->drive);  // not in the file: its wheels are found
  EXPECT_TRUE(spawned->models[2].model->drive->guessed);
  EXPECT_EQ(spawned->findings.size(), 1u);
  const auto included = load_world(
      folder.write("w.sdf", std::string("<sdf version='1.9'><world name='w'>") + kGround +
                                "<include><uri>bot.urdf</uri><ruedo:drive><ruedo:left_joint>jl</"
                                "ruedo:left_joint><ruedo:right_joint>jr</ruedo:right_joint></"
                                "ruedo:drive></include></world></sdf>"));
  expect_drive(included->models[1]);
  EXPECT_TRUE(included->findings.empty());  // nothing of a guess that did not count
}

TEST(DriveOption, ErrorsListTheJoints) {
  TemporaryFolder folder;
  const std::string urdf = folder.write("bot.urdf", kUrdf);
  const auto error = [&](const world::DriveOption& drive) {
    LoadOptions options;
    options.drives = {drive};
    try {
      load_world(urdf, options);
    } catch (const InputError& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  EXPECT_EQ(
      error({"bott", {"jl"}, {"jr"}}),
      "--drive bott: there is no model 'bott'; did you mean 'bot'?; there are ground_plane, bot");
  EXPECT_EQ(error({"bot", {"jll"}, {"jr"}}),
            "--drive bot: <ruedo:left_joint>: there is no joint 'jll' in the model 'bot'; did you "
            "mean 'jl'?");
  EXPECT_EQ(error({"ground_plane", {"jl"}, {"jr"}}),
            "--drive ground_plane: the model is static, and cannot drive");
}

}  // namespace
}  // namespace ruedo::world
