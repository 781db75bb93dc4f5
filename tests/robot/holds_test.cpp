// Detachable joints: a held thing moves with its holder, and falls when it is released.
#include <cmath>

#include <gtest/gtest.h>

#include <ruedo/joint_command_t.hpp>

#include "sim.h"

namespace ruedo::robot::testing {
namespace {

constexpr int8_t kAttached = joint_command_t::ATTACHED;
constexpr double kG = 9.8;

std::string hold(const std::string& model, const std::string& link = "l",
                 const std::string& parent = "base") {
  return "<plugin filename='gz-sim-detachable-joint-system' "
         "name='gz::sim::systems::DetachableJoint'><parent_link>" +
         parent + "</parent_link><child_model>" + model + "</child_model><child_link>" + link +
         "</child_link></plugin>";
}

// A box of 2 kg that the world holds at 0 0 3, and what the box holds.
std::string gantry(const std::string& plugins) {
  return "<model name='gantry'><pose>0 0 3 0 0 0</pose><link name='base'><inertial><mass>2</mass>"
         "<inertia><ixx>0.1</ixx><iyy>0.1</iyy><izz>0.1</izz></inertia></inertial></link><joint "
         "name='fast' type='fixed'><parent>world</parent><child>base</child></joint>" +
         plugins + "</model>";
}

std::string with(std::string model, const std::string& more) {
  return model.insert(model.rfind("</model>"), more);
}

void tell(Sim& sim, const std::string& name, double value, RobotIndex robot = RobotIndex(0)) {
  sim.robots.apply({robot, JointCommand{{name}, {kAttached}, {value}}});
}

Vec3 place(const Sim& sim, const std::string& body) {
  return sim.state.bodies[sim.body(body)].translation;
}

TEST(Holds, AHeldBodyFallsWhenReleased) {
  Sim sim(gantry(hold("box")) + box_sdf("box", "0.5 0 2 0 0 0", "0.2 0.2 0.2", 1.0), 1000);
  sim.run(2.0);
  EXPECT_NEAR(place(sim, "box/l").z(), 2.0, 1e-4);
  EXPECT_NEAR(place(sim, "box/l").x(), 0.5, 1e-4);
  tell(sim, "box", 0.0);
  sim.run(0.5);
  EXPECT_NEAR(place(sim, "box/l").z(), 2.0 - kG * 0.25 / 2, 5e-3);
  EXPECT_NEAR(place(sim, "box/l").x(), 0.5, 1e-4);
}

TEST(Holds, HoldsAgainAtTheCurrentPose) {
  Sim sim(gantry(hold("box")) + box_sdf("box", "0 0 2 0 0 0", "0.2 0.2 0.2", 1.0), 1000);
  tell(sim, "box", 0.0);
  sim.run(0.3);
  tell(sim, "box", 1.0);
  sim.run(0.2);
  const double there = place(sim, "box/l").z();
  EXPECT_NEAR(there, 2.0 - kG * 0.09 / 2, 0.01);
  sim.run(1.0);
  EXPECT_NEAR(place(sim, "box/l").z(), there, 1e-4);
}

// m v = (m + M) u: 1 kg at 2 m/s takes 3 kg with it.
TEST(Holds, MomentumIsShared) {
  Sim sim(with(box_sdf("a", "0 0 5 0 0 0", "0.2 0.2 0.2", 1.0), hold("b", "l", "l")) +
              box_sdf("b", "1 0 5 0 0 0", "0.2 0.2 0.2", 3.0),
          1000);
  sim.step();
  sim.robots.set_twist(InstanceIndex(0), {Vec3(2.0, 0.0, 0.0), Vec3::Zero()});
  sim.run(0.2);
  for (const char* body : {"a/l", "b/l"})
    EXPECT_NEAR(sim.state.body_twists[sim.body(body)].linear.x(), 0.5, 1e-3);
}

TEST(Holds, ARobotCarriesItsHeldBody) {
  Sim sim(plane_sdf() +
          with(robot_sdf("r", "0 0 0 0 0 0", "<ruedo:watchdog>0</ruedo:watchdog>"), hold("box")) +
          box_sdf("box", "0.6 0 0.3 0 0 0", "0.2 0.2 0.2", 0.5));
  sim.velocity(0.5, 0.3);
  sim.run(4.0);
  const double turned = 0.3 * 4.0, radius = 0.5 / 0.3;
  EXPECT_NEAR(sim.position().x(), radius * std::sin(turned), 2e-3);
  const Vec3 ahead = sim.robot().X_WBase.inverse() * place(sim, "box/l");
  EXPECT_NEAR((ahead - Vec3(0.6, 0.0, 0.3)).norm(), 0.0, 5e-3);
  tell(sim, "box", 0.0);
  sim.run(2.0);
  EXPECT_NEAR(place(sim, "box/l").z(), 0.1, 5e-3);  // it lies on the floor
}

TEST(Holds, SetPoseMovesTheHeldBodyToo) {
  Sim sim(plane_sdf() + with(robot_sdf("r", "0 0 0 0 0 0"), hold("box")) +
          box_sdf("box", "0.6 0 0.3 0 0 0", "0.2 0.2 0.2", 0.5));
  sim.run(0.1);
  sim.robots.set_pose(InstanceIndex(1), Pose::from_xyz_rpy({5, 2, 0}, {0, 0, M_PI / 2}));
  sim.run(0.5);
  EXPECT_NEAR((place(sim, "box/l") - Vec3(5.0, 2.6, 0.3)).norm(), 0.0, 5e-3);
  tell(sim, "box", 0.0);
  sim.run(1.0);
  sim.robots.reset(InstanceIndex(1));
  sim.robots.reset(InstanceIndex(2));
  sim.run(0.5);
  EXPECT_NEAR((place(sim, "box/l") - Vec3(0.6, 0.0, 0.3)).norm(), 0.0, 5e-3);
}

TEST(Holds, AReleasedBodyLandsOnItsHolder) {
  Sim sim(plane_sdf() +
          with(box_sdf("tray", "0 0 0.25 0 0 0", "1 1 0.5", 20.0), hold("box", "l", "l")) +
          box_sdf("box", "0.1 0 0.9 0 0 0", "0.2 0.2 0.2", 1.0));
  sim.run(0.5);
  EXPECT_NEAR(place(sim, "box/l").z(), 0.9, 5e-3);
  tell(sim, "box", 0.0);
  sim.run(1.5);
  EXPECT_NEAR(place(sim, "box/l").z(), 0.6, 5e-3);  // and does not fall through it
  sim.robots.reset(InstanceIndex(2));
  sim.run(1.5);
  EXPECT_NEAR(place(sim, "box/l").z(), 0.6, 5e-3) << "once more";
}

TEST(Holds, ANameThatItDoesNotHoldIsRefused) {
  Sim sim(plane_sdf() + with(robot_sdf("r", "0 0 0 0 0 0"), hold("box")) +
          box_sdf("box", "0.6 0 0.3 0 0 0", "0.2 0.2 0.2", 0.5));
  for (const auto& [name, value] : {std::pair("bax", 0.0), std::pair("box", 0.5)}) {
    tell(sim, name, value);
    sim.step();
    ASSERT_EQ(sim.state.motion_ends.size(), 1u) << name;
    EXPECT_EQ(sim.state.motion_ends[0].state.reason, Status::REASON_BAD_VALUE) << name;
    sim.run(0.5);
    EXPECT_NEAR(place(sim, "box/l").z(), 0.3, 5e-3);
  }
}

}  // namespace
}  // namespace ruedo::robot::testing
