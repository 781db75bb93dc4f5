// Joints under the controllers of Gazebo's plugins, against closed forms: a rotor of moment J =
// 0.1 kg m^2 on a body that the world holds, about the vertical; and a lever of 1 kg, 0.1 m long.
#include <cmath>

#include <gtest/gtest.h>

#include <ruedo/joint_command_t.hpp>

#include "sim.h"

namespace ruedo::robot::testing {
namespace {

constexpr int8_t kPosition = joint_command_t::POSITION, kVelocity = joint_command_t::VELOCITY,
                 kPositionGain = joint_command_t::POSITION_GAIN;
constexpr double kJ = 0.1, kG = 9.8;

// more: in the joint's <axis>. center: of the child's mass, with the axis `xyz`.
std::string machine(const std::string& plugins, const std::string& more = "",
                    const std::string& xyz = "0 0 1", const std::string& center = "0 0 0") {
  const std::string moments = "<inertia><ixx>0.1</ixx><iyy>0.1</iyy><izz>0.1</izz></inertia>";
  return "<model name='m'><link name='base'><inertial><mass>1</mass>" + moments +
         "</inertial></link><joint name='held' type='fixed'><parent>world</parent>"
         "<child>base</child></joint><link name='part'><inertial><pose>" +
         center + " 0 0 0</pose><mass>1</mass>" + moments +
         "</inertial></link><joint name='axle' type='revolute'><parent>base</parent>"
         "<child>part</child><axis><xyz>" +
         xyz + "</xyz>" + more + "</axis></joint>" + plugins + "</model>";
}

std::string plugin(const std::string& system, const std::string& parameters) {
  return "<plugin name='gz::sim::systems::" + system +
         "' filename='f'><joint_name>axle"
         "</joint_name>" +
         parameters + "</plugin>";
}

std::string gain(const std::string& name, double value) {
  return "<" + name + ">" + std::to_string(value) + "</" + name + ">";
}
std::string pid(double p, double i, double d) {
  return gain("p_gain", p) + gain("i_gain", i) + gain("d_gain", d);
}

struct Machine : Sim {
  explicit Machine(const std::string& models, int64_t step_us = 1000) : Sim(models, step_us) {}
  void tell(int8_t mode, double value) {
    robots.apply({RobotIndex(0), JointCommand{{"axle"}, {mode}, {value}}});
  }
  double at() const { return state.joint_positions.at(0); }
  double rate() const { return state.joint_velocities.at(0); }
};

// J x'' = p (1 - x) - d x' from rest.
double step_response(double p, double d, double t) {
  const double w0 = std::sqrt(p / kJ), damped = d / (2.0 * kJ),
               w = std::sqrt(w0 * w0 - damped * damped);
  return 1.0 - std::exp(-damped * t) * (std::cos(w * t) + damped / w * std::sin(w * t));
}

TEST(JointPid, APositionIsReachedAsSpringAndDamperDo) {
  for (const int64_t step_us : {1000, 4000}) {
    Machine machine(
        ::ruedo::robot::testing::machine(plugin("JointPositionController", pid(10.0, 0.0, 1.0))),
        step_us);
    machine.tell(kPosition, 1.0);
    for (const double t : {0.1, 0.2, 0.3, 0.4, 0.6, 0.8}) {
      machine.run(t - 1e-6 * static_cast<double>(machine.state.time));
      EXPECT_NEAR(machine.at(), step_response(10.0, 1.0, t),
                  6.0 * 1e-6 * static_cast<double>(step_us))
          << t << " " << step_us;
    }
  }
}

TEST(JointPid, IsStableAtStepsThatGazebosWouldNotBe) {
  Machine machine(::ruedo::robot::testing::machine(
                      plugin("JointPositionController",
                             pid(1e6, 0.0, 0.0) + gain("cmd_max", 1e9) + gain("cmd_min", -1e9))),
                  20000);
  machine.tell(kPosition, 0.5);
  machine.run(2.0);
  EXPECT_NEAR(machine.at(), 0.5, 1e-3);
}

// It sags by m g l / p; the integral removes that, as far as its limits allow.
TEST(JointPid, HoldsFromTheStartWithTheSagOfItsGains) {
  const auto sag = [](double p, double i, double most) {
    Machine lever(machine(plugin("JointPositionController",
                                 pid(p, i, 20.0) + gain("i_max", most) + gain("i_min", -most)),
                          "", "0 1 0", "0.1 0 0"));
    lever.run(30.0);
    return lever.at();  // about y, down is positive
  };
  const double moment = 1.0 * kG * 0.1;
  EXPECT_NEAR(sag(100.0, 0.0, 1.0), moment / 100.0, 1e-4);
  EXPECT_NEAR(sag(100.0, 100.0, 10.0), 0.0, 2e-4);
  EXPECT_NEAR(sag(100.0, 100.0, 0.5), (moment - 0.5) / 100.0, 1e-4);
}

TEST(JointPid, WithoutAControllerALeverHangs) {
  Machine lever(machine("<ruedo:joints/>", "<dynamics><damping>0.2</damping></dynamics>", "0 1 0",
                        "0.1 0 0"));
  lever.run(30.0);
  EXPECT_NEAR(lever.at(), M_PI / 2, 1e-3);
}

TEST(JointPid, ItsEffortIsLimitedToBothSidesApart) {
  Machine machine(::ruedo::robot::testing::machine(
      plugin("JointPositionController",
             pid(1e4, 0.0, 0.0) + gain("cmd_max", 0.3) + gain("cmd_min", -0.1))));
  machine.tell(kPosition, 100.0);
  machine.run(1.0);
  EXPECT_NEAR(machine.at(), 0.5 * 0.3 / kJ, 0.01);
  EXPECT_NEAR(machine.rate(), 0.3 / kJ, 1e-6);
  machine.tell(kPosition, -100.0);
  machine.run(1.0);
  EXPECT_NEAR(machine.rate(), (0.3 - 0.1) / kJ, 1e-6);
}

TEST(JointPid, AnOffsetPushesWithoutAnError) {
  Machine machine(::ruedo::robot::testing::machine(
      plugin("JointPositionController", pid(10.0, 0.0, 5.0) + gain("cmd_offset", 2.0))));
  machine.run(10.0);
  EXPECT_NEAR(machine.at(), 2.0 / 10.0, 1e-4);
}

TEST(JointPid, ARateIsReachedByForceInTheTimeJOverP) {
  Machine machine(::ruedo::robot::testing::machine(
      plugin("JointController", "<use_force_commands>true</use_force_commands>" + pid(0.2, 0, 0))));
  machine.tell(kVelocity, 2.0);
  machine.run(0.5);
  EXPECT_NEAR(machine.rate(), 2.0 * (1.0 - std::exp(-0.2 / kJ * 0.5)), 2e-3);
}

// p (r - w) = b w
TEST(JointPid, TheJointsOwnDampingActsBeside) {
  Machine machine(::ruedo::robot::testing::machine(
      plugin("JointController", "<use_force_commands>true</use_force_commands>" + pid(0.2, 0, 0)),
      "<dynamics><damping>0.3</damping></dynamics>"));
  machine.tell(kVelocity, 2.0);
  machine.run(5.0);
  EXPECT_NEAR(machine.rate(), 0.2 * 2.0 / (0.2 + 0.3), 1e-5);
  EXPECT_NEAR(machine.state.joint_efforts[0], 0.3 * machine.rate(), 1e-5);
}

TEST(JointPid, FrictionHoldsAgainstASmallerEffort) {
  const auto end = [](double p) {
    Machine machine(
        ::ruedo::robot::testing::machine(plugin("JointPositionController", pid(p, 0, 0.5)),
                                         "<dynamics><friction>0.5</friction></dynamics>"));
    machine.tell(kPosition, 0.1);
    machine.run(5.0);
    return machine.at();
  };
  EXPECT_NEAR(end(4.0), 0.0, 1e-4);         // 0.4 N m against 0.5
  EXPECT_NEAR(end(40.0), 0.1, 0.5 / 40.0);  // stops where p e is less than friction
  EXPECT_GT(end(40.0), 0.05);
}

TEST(JointPid, StartsWithItsInitialCommand) {
  Machine held(machine(
      plugin("JointPositionController", pid(10.0, 0.0, 2.0) + gain("initial_position", 0.7))));
  held.run(10.0);
  EXPECT_NEAR(held.at(), 0.7, 1e-4);
  Machine turned(machine(plugin("JointController", gain("initial_velocity", 1.5))));
  turned.run(1.0);
  EXPECT_NEAR(turned.rate(), 1.5, 1e-6);
  turned.robots.reset(InstanceIndex(0));
  turned.run(1.0);
  EXPECT_NEAR(turned.at(), 1.5, 0.01);  // from 0 again
}

TEST(JointPid, AnExactControllerIsAsFastAsItsCommandMayBe) {
  Machine machine(::ruedo::robot::testing::machine(
      plugin("JointPositionController",
             "<use_velocity_commands>true</use_velocity_commands>" + gain("cmd_max", 0.4))));
  machine.tell(kPosition, 1.0);
  machine.run(1.0);
  EXPECT_NEAR(machine.at(), 0.4, 1e-3);
  machine.run(5.0);
  EXPECT_NEAR(machine.at(), 1.0, 1e-4);
}

// The velocity gain brakes: it adds to d of the position's.
TEST(JointPid, AddsTheVelocityGainToThePositionsD) {
  Machine machine(::ruedo::robot::testing::machine(plugin(
      "JointTrajectoryController", gain("position_p_gain", 10.0) + gain("position_d_gain", 0.4) +
                                       gain("velocity_p_gain", 0.6))));
  machine.tell(kPosition, 1.0);
  machine.run(0.3);
  EXPECT_NEAR(machine.at(), step_response(10.0, 1.0, 0.3), 6e-3);
}

// A gain by message is that of docs/world-files.md: the rate is in proportion to what is missing.
TEST(JointPid, AGainByMessageTakesItsPlace) {
  Machine machine(
      ::ruedo::robot::testing::machine(plugin("JointPositionController", pid(10.0, 0.0, 1.0))));
  machine.tell(kPositionGain, 2.0);
  machine.tell(kPosition, 1.0);
  machine.run(0.5);
  EXPECT_NEAR(machine.at(), 1.0 - std::exp(-2.0 * 0.5), 2e-3);
}

}  // namespace
}  // namespace ruedo::robot::testing
