// The kinematic robot as a body: cargo, slopes, falls, what carries it, and what it assumes about
// its wheels.
#include <cmath>

#include <gtest/gtest.h>

#include "sim.h"

namespace ruedo::robot::testing {
namespace {

const std::string kNoWatchdog = "<ruedo:watchdog>0</ruedo:watchdog>";

// The chassis of robot_sdf ends 0.235 m above the ground.
TEST(KinematicBody, CargoRidesOnItsDeck) {
  Sim sim(plane_sdf() +
          robot_sdf("r", "0 0 0 0 0 0", kNoWatchdog + limits(0.6, 1.0, 0.3, 0.3, 0.5)) +
          box_sdf("cargo", "0 0 0.286 0 0 0", "0.1 0.1 0.1", 2.0, 0.8));
  sim.run(0.5);
  const int cargo = sim.body("cargo/l");
  const auto on_deck = [&] {
    return Vec3(sim.robot().X_WBase.inverse() * sim.state.bodies[cargo].translation);
  };
  const Vec3 start = on_deck();
  sim.velocity(0.6, 0.0);
  sim.run(3.0);
  sim.velocity(0.4, 0.6);
  sim.run(4.0);
  sim.velocity(0.0, 0.0);
  sim.run(3.0);
  EXPECT_GT(sim.position().x(), 1.0);
  EXPECT_LT((on_deck() - start).norm(), 0.01);
}

std::string slope(double angle, double mu) {  // through the origin, up along x
  return box_sdf("slope",
                 std::to_string(0.1 * std::sin(angle)) + " 0 " +
                     std::to_string(-0.1 * std::cos(angle)) + " 0 " + std::to_string(-angle) + " 0",
                 "40 4 0.2", 0.0, mu);
}

// A robot climbs what friction holds it on: tan(angle) < mu.
TEST(KinematicBody, ASlopeCanBeTooSteep) {
  for (const double degrees : {30.0, 45.0}) {
    const double angle = degrees * M_PI / 180;
    Sim sim(slope(angle, 0.8) + robot_sdf("r",
                                          std::to_string(-0.003 * std::sin(angle)) + " 0 " +
                                              std::to_string(0.003 * std::cos(angle)) + " 0 " +
                                              std::to_string(-angle) + " 0",
                                          kNoWatchdog + limits(1.0, 1.0, 1.0, 1.0, 1.0)));
    sim.velocity(0.5, 0.0);
    sim.run(3.0);
    const double along = sim.position().x() / std::cos(angle);
    if (degrees < 38.66) {
      EXPECT_NEAR(along, 0.5 * 3.0 - 0.125, 0.05);
    } else {  // slides at g (sin - mu cos), 1.386 m/s^2
      EXPECT_NEAR(along, -0.5 * 9.8 * (std::sin(angle) - 0.8 * std::cos(angle)) * 9.0, 0.7);
    }
  }
}

// On its back its wheels drive nothing, and friction stops it.
TEST(KinematicBody, OnItsBackItIsABody) {
  Sim sim(plane_sdf() + robot_sdf("r", "0 0 0.24 3.14159265358979 0 0", kNoWatchdog));
  sim.robots.set_twist(InstanceIndex(1), {{1.0, 0, 0}, Vec3::Zero()});
  sim.velocity(0.5, 0.0);
  sim.run(3.0);
  const Vec3 rest = sim.position();
  EXPECT_LT(rest.x(), 0.5);
  sim.run(3.0);
  EXPECT_LT((sim.position() - rest).norm(), 1e-3);
}

// On ice a robot pushes with mu m g at most.
TEST(KinematicBody, OnIceItPushesLittle) {
  std::string ice = plane_sdf();
  ice.insert(ice.find("</collision>"),
             "<surface><friction><ode><mu>0.1</mu><mu2>0.1</mu2></ode></friction></surface>");
  for (const bool traction : {true, false}) {
    Sim sim(ice +
            robot_sdf("r", "0 0 0 0 0 0",
                      kNoWatchdog + (traction ? "" : "<ruedo:traction>false</ruedo:traction>")) +
            box_sdf("wall", "1.1 0 0.5 0 0 0", "0.2 4 1"));
    sim.velocity(1.0, 0.0);
    sim.run(3.0);
    double force = 0.0;
    for (const Contact& contact : sim.state.contacts) force += contact.force;
    EXPECT_NEAR(force, traction ? 0.1 * 20 * 9.8 : 20 * 9.8, 2.0);
  }
}

std::string mover(const std::string& size, const std::string& waypoints) {
  return "<model name='mover'><link name='l'><collision name='c'><geometry>" + size +
         "</geometry></collision></link><ruedo:path>" + waypoints + "</ruedo:path></model>";
}

// A platform of 0.2 m, its top at 0.2 m, moves 2 m ahead in 4 s; the robot keeps its place on it,
// and drives on it.
TEST(KinematicBody, APlatformCarriesIt) {
  for (const double v : {0.0, 0.1}) {
    Sim sim(
        plane_sdf() +
        mover("<box><size>3 2 0.2</size></box>",
              "<ruedo:waypoint>0 0 0 0.1 0 0 0</ruedo:waypoint><ruedo:waypoint>1 0 0 0.1 0 0 "
              "0</ruedo:waypoint>"
              "<ruedo:waypoint>5 2 0 0.1 0 0 0</ruedo:waypoint><ruedo:loop>false</ruedo:loop>") +
        robot_sdf("r", "0 0 0.203 0 0 0", kNoWatchdog));
    sim.run(1.0);
    sim.velocity(v, 0.0);
    sim.run(5.0);
    EXPECT_NEAR(sim.position().x(), 2.0 + 5.0 * v, 0.02);
    EXPECT_NEAR(sim.position().z(), 0.2, 2e-3);
  }
}

TEST(KinematicBody, ATurntableTurnsIt) {
  Sim sim(plane_sdf() +
          mover("<cylinder><radius>1</radius><length>0.2</length></cylinder>",
                "<ruedo:waypoint>0 0 0 0.1 0 0 0</ruedo:waypoint><ruedo:waypoint>1 0 0 0.1 0 0 "
                "0</ruedo:waypoint>"
                "<ruedo:waypoint>3 0 0 0.1 0 0 1</ruedo:waypoint><ruedo:loop>false</ruedo:loop>") +
          robot_sdf("r", "0.4 0 0.203 0 0 0", kNoWatchdog));
  sim.run(4.0);
  EXPECT_NEAR(sim.yaw(), 1.0, 0.02);
  EXPECT_NEAR(sim.position().x(), 0.4 * std::cos(1.0), 0.02);
  EXPECT_NEAR(sim.position().y(), 0.4 * std::sin(1.0), 0.02);
}

// Primitives measured by odometry: with a radius assumed 2 % too large a metre is 1 / 1.02 m, with
// a track assumed 5 % too wide a quarter turn is 1.05 of one.
TEST(KinematicBody, PrimitivesOnTheOdometryMissAsARealRobotDoes) {
  std::string robot = robot_sdf(
      "r", "0 0 0 0 0 0", limits(1, 1, 1, 1, 1) + "<ruedo:primitives>odometry</ruedo:primitives>");
  robot.insert(
      robot.find("</model>"),
      "<ruedo:odometry><ruedo:radius_error>0.02 "
      "0.02</ruedo:radius_error><ruedo:track_error>0.05</ruedo:track_error></ruedo:odometry>");
  Sim sim(plane_sdf() + robot);
  sim.move(Move::ADVANCE, 1.0);
  sim.run(4.0);
  EXPECT_NEAR(sim.position().x(), 1.0 / 1.02, 1e-9);
  sim.move(Move::ROTATE, M_PI / 2);
  sim.run(4.0);
  EXPECT_NEAR(sim.yaw(), M_PI / 2 * 1.05 / 1.02, 1e-9);
  EXPECT_EQ(sim.robot().motion.state, Status::STATE_DONE);
  EXPECT_EQ(sim.robot().motion.done, M_PI / 2);
}

}  // namespace
}  // namespace ruedo::robot::testing
