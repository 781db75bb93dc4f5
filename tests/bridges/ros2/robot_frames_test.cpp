// Frames of links by hand; test_links.py holds /tf against robot_description and joint_states.
#include "bridges/ros2/messages/robot_frames.h"

#include <algorithm>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "world/load.h"

namespace ruedo::ros2 {
namespace {

using testing::HasSubstr;
using testing::Not;

// A robot whose links are not at their joints, whose left wheel's axis points to the right, and
// whose names are already taken.
constexpr const char* kRobot = R"(
  <sdf version='1.9' xmlns:ruedo='urn:ruedo'><world name='w'><model name='bot'>
    <link name='base_link'><pose>0 0 0.3 0 0 0</pose>
      <visual name='cap'><geometry><cone><radius>1</radius><length>1</length></cone></geometry></visual>
      <visual name='a -- b'><geometry><ellipsoid><radii>1 2 3</radii></ellipsoid></geometry></visual>
    </link>
    <link name='left'><pose>0 0.2 0.1 0 0 0</pose></link>
    <link name='right'><pose>0 -0.2 0.1 0 0 0</pose></link>
    <link name='eye'><pose>0.5 0 1 0 0 0</pose>
      <visual name='pill'><pose>0.1 0 0 0 0 0</pose><geometry><capsule><radius>0.1</radius><length>0.4</length></capsule></geometry></visual>
      <sensor name='eye' type='imu'><pose>0 0 0.2 0 0 0</pose></sensor></link>
    <joint name='l' type='continuous'><parent>base_link</parent><child>left</child><axis><xyz>0 -1 0</xyz></axis></joint>
    <joint name='r' type='continuous'><parent>base_link</parent><child>right</child><axis><xyz>0 1 0</xyz></axis></joint>
    <joint name='neck' type='revolute'><pose>-0.5 0 0 0 0 0</pose><parent>base_link</parent><child>eye</child>
      <axis><xyz>0 0 1</xyz><limit><lower>-1</lower><upper>2</upper></limit></axis></joint>
    <ruedo:drive><ruedo:left_joint>l</ruedo:left_joint><ruedo:right_joint>r</ruedo:right_joint><ruedo:wheel_radius>0.1</ruedo:wheel_radius></ruedo:drive>
  </model></world></sdf>)";

RobotFrames frames_of(const char* text) {
  return robot_frames(*world::load_world_text(text, "/nowhere/world.sdf")).at("bot");
}

const LinkFrame& frame(const RobotFrames& robot, const std::string& name) {
  for (const LinkFrame& each : robot.frames) {
    if (each.name == name) return each;
  }
  throw std::runtime_error("no frame " + name);
}

// Compares Eigen's vectors exactly: here nothing is rounded except by additions.
void expect_at(const Pose& X, double x, double y, double z) {
  EXPECT_LT((X.translation - Vec3(x, y, z)).norm(), 1e-12) << X.translation.transpose();
}

TEST(RobotFrames, ALinkWithANameOfAnotherFrameIsCalledAnother) {
  const RobotFrames robot = frames_of(kRobot);
  EXPECT_EQ(robot.frames[0].name, "base_link");
  EXPECT_EQ(robot.frames[0].link, -1);
  expect_at(frame(robot, "base_link_link").X_PF, 0, 0, 0.3);  // base_link is on the ground
  EXPECT_EQ(frame(robot, "eye_link").joint, 2);               // the sensor is called eye
}

TEST(RobotFrames, LieAtTheirJoints) {
  const RobotFrames robot = frames_of(kRobot);
  const LinkFrame& eye = frame(robot, "eye_link");
  expect_at(eye.at(0), 0, 0, 0.7);  // in base_link_link
  expect_at(eye.at(1), 0, 0, 0.7);
  EXPECT_LT(eye.at(0.5).rotation.angularDistance(Quat(Eigen::AngleAxisd(0.5, Vec3::UnitZ()))),
            1e-12);
  EXPECT_EQ(robot.carriers.at("eye"), static_cast<size_t>(&eye - robot.frames.data()));
  EXPECT_THAT(robot.description, HasSubstr("<joint name=\"neck\" type=\"revolute\">"));
  EXPECT_THAT(robot.description, HasSubstr("lower=\"-1\" upper=\"2\""));
}

TEST(RobotFrames, AWheelAheadTurnsItsJointAsItsAxisHasIt) {
  const RobotFrames robot = frames_of(kRobot);
  ASSERT_EQ(robot.wheels.size(), 2u);
  EXPECT_EQ(robot.wheels[0].sign, -1.0);
  EXPECT_EQ(robot.wheels[1].sign, 1.0);
  EXPECT_EQ(robot.frames[robot.wheels[0].frame].name, "left");
}

TEST(RobotFrames, LeaveOutShapesThatUrdfLacksWithAComment) {
  const std::string text = frames_of(kRobot).description;
  EXPECT_THAT(text, HasSubstr("<!-- visual cap: URDF has no such shape -->"));
  EXPECT_THAT(text, HasSubstr("<!-- visual a __ b: URDF has no such shape -->"));
  // A capsule is a cylinder with two spheres, half a metre and a tenth ahead of its joint.
  EXPECT_THAT(text, HasSubstr("<origin xyz=\"0.6 0 0.2\" rpy=\"0 0 0\"/><geometry><sphere"));
  EXPECT_THAT(text, HasSubstr("<origin xyz=\"0.6 0 -0.2\" rpy=\"0 0 0\"/><geometry><sphere"));
  EXPECT_THAT(text, Not(HasSubstr("nan")));
}

TEST(RobotFrames, ParentsOfTheBaseLinkHangBelowIt) {
  const RobotFrames robot = frames_of(R"(
    <sdf version='1.9' xmlns:ruedo='urn:ruedo'><world name='w'><model name='bot'>
      <link name='top'><pose>0 0 2 0 0 0</pose></link>
      <link name='left'><pose>0 0.2 0.1 0 0 0</pose></link><link name='right'><pose>0 -0.2 0.1 0 0 0</pose></link>
      <link name='axle'><pose>0 0 0.1 0 0 0</pose></link>
      <joint name='post' type='prismatic'><parent>top</parent><child>axle</child><axis><xyz>0 0 1</xyz></axis></joint>
      <joint name='l' type='continuous'><parent>axle</parent><child>left</child><axis><xyz>0 1 0</xyz></axis></joint>
      <joint name='r' type='continuous'><parent>axle</parent><child>right</child><axis><xyz>0 1 0</xyz></axis></joint>
      <ruedo:drive><ruedo:left_joint>l</ruedo:left_joint><ruedo:right_joint>r</ruedo:right_joint><ruedo:wheel_radius>0.1</ruedo:wheel_radius></ruedo:drive>
    </model></world></sdf>)");
  const LinkFrame& top = frame(robot, "top");
  EXPECT_EQ(robot.frames[top.parent].name, "axle");
  expect_at(top.at(0), 0, 0, 0);         // in the joint
  expect_at(top.at(0.25), 0, 0, -0.25);  // the axle rises below it
}

}  // namespace
}  // namespace ruedo::ros2
