// Commands to the joints of a robot that drives: a pan, a tilt and a lift on a kinematic base.
#include <cmath>

#include <gtest/gtest.h>

#include <ruedo/joint_command_t.hpp>

#include "physics/state_check.h"
#include "sim.h"

namespace ruedo::robot::testing {
namespace {

constexpr int8_t kPosition = joint_command_t::POSITION, kVelocity = joint_command_t::VELOCITY,
                 kEffort = joint_command_t::EFFORT;

// The pan turns about z and carries the tilt, which is balanced and turns about y; the lift goes
// up. Moments of 0.1 kg m^2.
std::string gimbal() {
  const std::string inertial =
      "<inertial><mass>1</mass><inertia><ixx>0.1</ixx><iyy>0.1</iyy><izz>0.1</izz></inertia></"
      "inertial>";
  std::string text = robot_sdf("r", "0 0 0 0 0 0", "<ruedo:watchdog>0</ruedo:watchdog>");
  text.resize(text.size() - std::string("</model>").size());
  return text + "<link name='head'><pose>0 0 0.4 0 0 0</pose>" + inertial +
         "</link><link name='eye'><pose>0 0 0.5 0 0 0</pose>" + inertial +
         "</link><link name='fork'><pose>0.4 0 0.3 0 0 0</pose>" + inertial +
         "</link>"
         "<joint name='pan' type='revolute'><parent>base</parent><child>head</child><axis><xyz>0 0 "
         "1</xyz><limit><lower>-1.5</lower><upper>1.5</upper></limit></axis></joint>"
         "<joint name='tilt' type='revolute'><parent>head</parent><child>eye</child><axis><xyz>0 1 "
         "0</xyz><limit><lower>-1</lower><upper>1</upper>"
         "<velocity>0.5</velocity></limit></axis></joint>"
         "<joint name='lift' type='prismatic'><parent>base</parent><child>fork</child><axis><xyz>0 "
         "0 1</xyz><limit><lower>0</lower><upper>0.6</upper></limit></axis></joint></model>";
}

struct Gimbal : ::testing::Test {
  void tell(const std::string& joint, int8_t mode, double value) {
    sim.robots.apply({RobotIndex(0), JointCommand{{joint}, {mode}, {value}}});
  }
  size_t index(const std::string& joint) const {
    for (size_t i = 0; i < sim.layout.joints.size(); ++i) {
      if (sim.world->models[1].model->joints[sim.layout.joints[i].joint].name == joint) return i;
    }
    throw std::logic_error("no joint " + joint);
  }
  double position(const std::string& joint) const {
    return sim.state.joint_positions.at(index(joint));
  }
  double rate(const std::string& joint) const {
    return sim.state.joint_velocities.at(index(joint));
  }
  Sim sim{plane_sdf() + gimbal()};
};

TEST_F(Gimbal, GoesToItsPositionsWhileItDrives) {
  sim.velocity(0.5, 0.2);
  tell("pan", kPosition, 0.8);
  tell("tilt", kPosition, -0.6);
  tell("lift", kPosition, 0.25);
  sim.run(4.0);
  EXPECT_NEAR(position("pan"), 0.8, 5e-3);
  EXPECT_NEAR(position("tilt"), -0.6, 5e-3);
  EXPECT_NEAR(position("lift"), 0.25, 5e-3);
  EXPECT_NEAR(sim.yaw(), 0.8, 1e-9);  // the drive keeps to its closed form
  // Both turn about the vertical: the head looks in the direction of the sum.
  EXPECT_NEAR(heading(sim.state.bodies[sim.body("r/head")].rotation), 1.6, 1e-2);
}

TEST_F(Gimbal, APositionBeyondTheLimitIsTheLimit) {
  tell("pan", kPosition, 9.0);
  sim.run(4.0);
  EXPECT_NEAR(position("pan"), 1.5, 0.01);
}

TEST_F(Gimbal, HoldsVelocitiesWithinTheJointsOwn) {
  tell("lift", kVelocity, 0.1);
  tell("tilt", kVelocity, 2.0);  // 0.5 rad/s is what it can
  sim.run(1.0);
  EXPECT_NEAR(position("lift"), 0.1, 2e-3);
  EXPECT_NEAR(rate("lift"), 0.1, 1e-3);
  EXPECT_NEAR(rate("tilt"), 0.5, 5e-3);
  tell("lift", kVelocity, 0.0);
  sim.run(2.0);
  EXPECT_NEAR(position("lift"), 0.1, 3e-3);  // against its weight
}

TEST_F(Gimbal, AnEffortAccelerates) {
  tell("pan", kEffort, 0.04);  // on the head and the eye: 0.2 kg m^2
  sim.run(2.0);
  EXPECT_NEAR(rate("pan"), 0.4, 0.01);
  EXPECT_NEAR(sim.state.joint_efforts.at(index("pan")), 0.04, 1e-12);
}

TEST_F(Gimbal, TheNewestCommandHoldsAndARefusedOneChangesNothing) {
  tell("pan", kVelocity, 0.3);
  tell("pan", kPosition, 0.5);
  for (const auto& [joint, mode, value] :
       {std::tuple("pan", int8_t{7}, 1.0), std::tuple("pan", kPosition, std::nan("")),
        std::tuple("fl_joint", kVelocity, 1.0)}) {
    tell(joint, mode, value);
    sim.step();
    ASSERT_EQ(sim.state.motion_ends.size(), 1u) << joint;
    EXPECT_EQ(sim.state.motion_ends[0].state.state, Status::STATE_REFUSED);
  }
  sim.run(3.0);
  EXPECT_NEAR(position("pan"), 0.5, 5e-3);
}

// Head and eye have 0.2 kg m^2 about the pan: 0.1 N m make 0.5 rad/s^2 of that, 0.2 N m 1 rad/s^2.
TEST_F(Gimbal, ALimitOfEffortComesByMessage) {
  tell("pan", kVelocity, 10.0);
  tell("pan", joint_command_t::EFFORT_LIMIT, 0.1);
  sim.run(0.5);
  const double inertia = 0.2;  // head and eye
  EXPECT_NEAR(rate("pan"), 0.1 / inertia * 0.5, 2e-3);
  tell("pan", joint_command_t::EFFORT_LIMIT, 0.2);  // the earlier command continues within it
  sim.run(0.5);
  EXPECT_NEAR(rate("pan"), (0.1 + 0.2) / inertia * 0.5, 4e-3);
}

TEST_F(Gimbal, ALimitOfVelocityComesByMessageAndMayBeAboveTheFiles) {
  tell("tilt", kVelocity, 2.0);
  sim.run(0.2);
  EXPECT_NEAR(rate("tilt"), 0.5, 5e-3);
  tell("tilt", joint_command_t::VELOCITY_LIMIT, 0.8);
  sim.run(0.2);
  EXPECT_NEAR(rate("tilt"), 0.8, 5e-3);
  tell("tilt", joint_command_t::VELOCITY_LIMIT, 0.0);
  sim.run(0.2);
  EXPECT_NEAR(rate("tilt"), 0.0, 5e-3);
}

// Towards a position the error falls as exp(-k t).
TEST_F(Gimbal, APositionGainComesByMessage) {
  tell("pan", joint_command_t::POSITION_GAIN, 2.0);
  tell("pan", kPosition, 1.0);
  sim.run(1.0);
  EXPECT_NEAR(1.0 - position("pan"), std::exp(-2.0), 2e-3);
  tell("pan", joint_command_t::POSITION_GAIN, 4.0);
  sim.run(0.5);
  EXPECT_NEAR(1.0 - position("pan"), std::exp(-4.0), 1e-3);
}

// With k N s/m the lift's 1 kg sinks at m g / k.
TEST_F(Gimbal, ARateGainComesByMessage) {
  tell("lift", kPosition, 0.4);
  sim.run(3.0);
  tell("lift", kVelocity, 0.0);
  tell("lift", joint_command_t::RATE_GAIN, 196.0);
  sim.run(0.5);
  EXPECT_NEAR(rate("lift"), -9.8 / 196.0, 1e-3);
}

// After a reset it is as its file says.
TEST_F(Gimbal, SettingsEndWhenItStartsAgain) {
  tell("tilt", joint_command_t::VELOCITY_LIMIT, 0.1);
  tell("pan", joint_command_t::POSITION_GAIN, 1e-3);
  sim.robots.reset(InstanceIndex(1));
  tell("tilt", kVelocity, 2.0);
  tell("pan", kPosition, 1.0);
  sim.run(1.0);
  EXPECT_NEAR(rate("tilt"), 0.5, 5e-3);
  EXPECT_NEAR(position("pan"), 1.0, 1e-3);
}

TEST_F(Gimbal, SettingsThatAreNotAllowedAreRefused) {
  struct Case {
    int8_t mode;
    double value;
  };
  for (const Case& each :
       {Case{joint_command_t::POSITION_GAIN, 0.0}, Case{joint_command_t::POSITION_GAIN, -1.0},
        Case{joint_command_t::RATE_GAIN, 0.0}, Case{joint_command_t::RATE_GAIN, 1e30},
        Case{joint_command_t::EFFORT_LIMIT, -1e-3}, Case{joint_command_t::VELOCITY_LIMIT, -1.0},
        Case{joint_command_t::VELOCITY_LIMIT, std::nan("")}, Case{7, 1.0}, Case{-1, 1.0}}) {
    // The first of the two is valid; together with the other neither counts.
    sim.robots.apply({RobotIndex(0), JointCommand{{"tilt", "tilt"},
                                                  {joint_command_t::VELOCITY_LIMIT, each.mode},
                                                  {0.1, each.value}}});
    sim.step();
    EXPECT_EQ(sim.state.motion_ends.size(), 1u) << int{each.mode} << " " << each.value;
  }
  tell("tilt", kVelocity, 2.0);
  sim.run(0.2);
  EXPECT_NEAR(rate("tilt"), 0.5, 5e-3);
}

TEST_F(Gimbal, ExtremeNumbersLeaveAState) {
  for (const char* joint : {"pan", "tilt", "lift"}) {
    for (int8_t mode = 0; mode < 11; ++mode) {
      for (const double value : extremes()) {
        const std::string what =
            joint + (" mode " + std::to_string(mode)) + " " + ::testing::PrintToString(value);
        tell(joint, mode, value);
        ASSERT_NO_THROW(sim.step(3)) << what;
        ASSERT_NO_THROW(physics::check_finite(sim.state, *sim.world, sim.layout)) << what;
      }
    }
  }
}

}  // namespace
}  // namespace ruedo::robot::testing
