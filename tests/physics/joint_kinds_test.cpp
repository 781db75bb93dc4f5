// Joints that are led by others, threads, and the gains of a file.
#include <gtest/gtest.h>

#include "world.h"

namespace ruedo::physics::testing {
namespace {

std::string link(const std::string& name, const std::string& pose, double mass = 1.0) {
  return "<link name='" + name + "'><pose>" + pose + "</pose><inertial><mass>" +
         std::to_string(mass) +
         "</mass><inertia><ixx>0.01</ixx><iyy>0.01</iyy><izz>0.01</izz></inertia></inertial></"
         "link>";
}
std::string joint(const std::string& name, const std::string& type, const std::string& parent,
                  const std::string& child, const std::string& xyz, const std::string& axis = "",
                  const std::string& more = "") {
  return "<joint name='" + name + "' type='" + type + "'><parent>" + parent + "</parent><child>" +
         child + "</child><axis><xyz>" + xyz + "</xyz>" + axis + "</axis>" + more + "</joint>";
}

// A gripper: one finger is told, the other follows with -1 times its way, 2 cm off.
TEST(JointKinds, AMimicFollowsItsLeader) {
  World w(
      "<model name='m'>" + link("l", "0 0 1 0 0 0") + link("r", "0 0 1 0 0 0") +
          joint("right", "prismatic", "world", "r", "0 1 0",
                "<mimic joint='left'><multiplier>-1</multiplier><offset>0.02</offset></mimic>") +
          joint("left", "prismatic", "world", "l", "0 1 0") + "</model>",
      5000);
  const int follower = 0, leader = 1;
  w.run(0.2);
  EXPECT_NEAR(w.physics.joint_position(follower), 0.02, 1e-6);
  w.physics.drive_joint_velocity(leader, 0.1, 1e3);
  for (int i = 0; i < 100; ++i) {
    w.physics.step();
    EXPECT_NEAR(w.physics.joint_position(follower), 0.02 - w.physics.joint_position(leader), 1e-3);
  }
  EXPECT_NEAR(w.physics.joint_position(leader), 0.05, 1e-3);
  EXPECT_NEAR(w.physics.joint_velocity(follower), -0.1, 1e-4);
}

// A load of 1 kg on a vertical thread of 10 mm a turn: it goes down at 10 mm a turn when it is
// turned, and where nothing holds it falls with m g = (m + J / p^2) a, p the way of a radian.
TEST(JointKinds, AScrewAdvancesByItsPitch) {
  const double pitch = 0.6, p = pitch / (2 * M_PI);  // a steep thread turns by its load
  World w("<model name='m'>" + link("nut", "0 0 1 0 0 0") +
              joint("s", "screw", "world", "nut", "0 0 1", "",
                    "<screw_thread_pitch>" + std::to_string(pitch) + "</screw_thread_pitch>") +
              "</model>",
          5000);
  w.run(0.5);
  const double a = 10.0 / (1.0 + 0.01 / (p * p)), fallen = 0.5 * a * 0.25;
  EXPECT_NEAR(w.position("m/nut").z(), 1.0 - fallen, 0.01 * fallen);
  EXPECT_NEAR(w.physics.joint_position(0), -fallen / p, 0.01 * fallen / p);
  w.physics.drive_joint_velocity(0, 2.0, 1e3);
  const double before = w.position("m/nut").z();
  w.run(1.0);
  EXPECT_NEAR(w.position("m/nut").z() - before, 2.0 * p, 2e-3);
  // The effort is the load's: m g p.
  EXPECT_NEAR(w.physics.joint_effort(0), 10.0 * p, 0.02 * 10.0 * p);
}

// A stop at two turns of a right-handed thread, in either of the ways to write it.
TEST(JointKinds, AScrewHasLimitsAndItsOldPitchIsLeftHanded) {
  World w("<model name='m'>" + link("nut", "0 0 1 0 0 0") +
              joint("s", "screw", "world", "nut", "0 0 1",
                    "<limit><lower>-3</lower><upper>12.566</upper></limit>",
                    "<thread_pitch>-62.83185307</thread_pitch>") +
              "</model>",
          5000);
  w.physics.drive_joint_velocity(0, 10.0, 20.0);
  w.run(3.0);
  EXPECT_NEAR(w.physics.joint_position(0), 12.566, 0.02);
  EXPECT_NEAR(w.position("m/nut").z(), 1.2, 1e-3);
}

// With 500 N m s/rad an arm of m g r = 5 N m that is told to stand still sinks at 0.01 rad/s, as
// long as it is level.
TEST(JointKinds, ARateGainYields) {
  World w(
      "<model name='m'><link name='arm'><pose>0 0 1 0 0 0</pose><inertial><pose>0.5 0 0 0 0 "
      "0</pose><mass>1</mass><inertia><ixx>0.01</ixx><iyy>0.01</iyy><izz>0.01</izz></inertia></"
      "inertial></link>" +
          joint("j", "revolute", "world", "arm", "0 1 0",
                "<ruedo:rate_gain>500</ruedo:rate_gain>") +
          "</model>",
      5000);
  w.physics.drive_joint_velocity(0, 0.0, 1e3);
  w.run(0.5);
  EXPECT_NEAR(w.physics.joint_velocity(0), 5.0 / 500.0, 1e-4);
}

}  // namespace
}  // namespace ruedo::physics::testing
