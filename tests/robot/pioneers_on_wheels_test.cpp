// The Pioneers of worlds/robots with the wheels drive: four wheels that skid, two wheels and a
// caster; on level ground, over bumps and ramps, against objects and robots, and back to the start.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "sim.h"

namespace ruedo::robot::testing {
namespace {

// As a world file selects the drive. Its speed limits are above what the tests command.
std::string p3at(const std::string& pose, const std::string& more = "") {
  return "<include><uri>model://p3at</uri><name>p3at</name><pose>" + pose +
         "</pose><ruedo:drive type='wheels'>"
         "<ruedo:left_joint>front_left_wheel_joint</"
         "ruedo:left_joint><ruedo:left_joint>rear_left_wheel_joint</ruedo:left_joint>"
         "<ruedo:right_joint>front_right_wheel_joint</"
         "ruedo:right_joint><ruedo:right_joint>rear_right_wheel_joint</ruedo:right_joint>"
         "<ruedo:base>0 0 0 0 0 0</ruedo:base><ruedo:watchdog>0</ruedo:watchdog>" +
         limits(2.0, 2.0, 5.0, 5.0, 1.74) + more + "</ruedo:drive></include>";
}

std::string p3dx(const std::string& pose, const std::string& more = "") {
  return "<include><uri>model://p3dx</uri><name>p3dx</name><pose>" + pose +
         "</pose><ruedo:drive type='wheels'>"
         "<ruedo:left_joint>left_wheel_joint</"
         "ruedo:left_joint><ruedo:right_joint>right_wheel_joint</ruedo:right_joint>"
         "<ruedo:base>0 0 0 0 0 0</ruedo:base><ruedo:watchdog>0</ruedo:watchdog>" +
         limits(2.0, 2.0, 5.0, 5.0, 1.74) + more + "</ruedo:drive></include>";
}

struct Pioneer {
  const char* name;
  std::string (*sdf)(const std::string& pose, const std::string& more);
  double acceleration, deceleration;  // of its advances
  double skid;                        // turn of the wheels for one of the robot on the spot
};

// Four wheels at (0.1345, 0.197) m: 1 + a^2 / b^2. T. Wang et al., "Analysis and experimental
// kinematics of a skid-steering wheeled robot", Sensors 15 (2015) 9681, give the same for a P3-AT
// that turns on the spot.
constexpr double kSkidOfP3at = 1.466;

class OnWheels : public ::testing::TestWithParam<Pioneer> {
 protected:
  std::string robot(const std::string& pose, const std::string& more = "") const {
    return GetParam().sdf(pose, more);
  }
};

// Steps until the primitive has ended; returns whether it is done.
bool done(Sim& sim) {
  for (int i = 0; i < 6000; ++i) {
    sim.step();
    if (sim.robot().motion.state != Status::STATE_RUNNING) break;
  }
  return sim.robot().motion.state == Status::STATE_DONE;
}

double tilt(const Sim& sim) {
  return std::acos(std::clamp((sim.robot().X_WBase.rotation * Vec3::UnitZ()).z(), -1.0, 1.0));
}

TEST_P(OnWheels, StandsUpright) {
  Sim sim(plane_sdf() + robot("0 0 0.01 0 0 0.5"));
  sim.run(2.0);
  EXPECT_NEAR(sim.position().z(), 0.0, 2e-3);
  EXPECT_LT(tilt(sim), 0.01);
  EXPECT_NEAR(sim.yaw(), 0.5, 2e-3);
}

// Includes the two cases of E1: measured at the moment of DONE, not a second later.
TEST_P(OnWheels, AnAdvanceEndsOneMetreAhead) {
  Sim sim(plane_sdf() + robot("0 0 0 0 0 0.4"));
  sim.run(1.0);
  const Pose start = sim.robot().X_WBase;
  sim.move(Move::ADVANCE, 1.0, 0, 2.0, GetParam().acceleration, GetParam().deceleration);
  ASSERT_TRUE(done(sim));
  const Vec3 way = start.rotation.conjugate() * (sim.position() - start.translation);
  EXPECT_NEAR(way.x(), 1.0, 2e-3);
  EXPECT_NEAR(way.y(), 0.0, 5e-3);  // encoders do not measure sideways slip
  EXPECT_NEAR(sim.yaw(), 0.4, 3e-3);
  EXPECT_LT(sim.robot().twist.linear.norm(), 5e-3);
  sim.run(1.0);  // and stays there
  EXPECT_NEAR((sim.position() - start.translation).norm(), 1.0, 2e-3);
}

TEST_P(OnWheels, TurnsByAnAngleAndAtARate) {
  Sim sim(plane_sdf() + robot("0 0 0 0 0 0"));
  sim.run(1.0);
  sim.move(Move::ROTATE, M_PI / 2);
  ASSERT_TRUE(done(sim));
  const double skid = GetParam().skid;
  EXPECT_NEAR(sim.yaw(), M_PI / 2 / skid, skid == 1.0 ? 2e-3 : 0.03);
  EXPECT_LT(sim.position().head<2>().norm(), 0.02);  // on the spot, but for what slips
  for (const double rate : {0.5, -0.5}) {
    sim.velocity(0.0, rate);
    sim.run(2.0);
    const double before = sim.yaw();
    sim.run(4.0);
    EXPECT_NEAR(wrap_angle(sim.yaw() - before) / (4.0 * rate), 1.0 / skid, 0.01);
  }
}

TEST_P(OnWheels, CrossesABump) {
  // A bar of 15 mm in the path of all wheels.
  Sim sim(plane_sdf() + robot("0 0 0 0 0 0") +
          box_sdf("bump", "0.8 0 0.0075 0 0 0", "0.1 2 0.015", 0.0, 1.0));
  sim.run(0.5);
  sim.velocity(0.4, 0.0);
  double highest = 0.0, steepest = 0.0;
  for (int i = 0; i < 1000; ++i) {
    sim.step();
    highest = std::max(highest, sim.position().z());
    steepest = std::max(steepest, tilt(sim));
  }
  EXPECT_GT(highest, 0.005);
  EXPECT_LT(highest, 0.05);
  EXPECT_GT(steepest, 0.02);  // 15 mm over 0.27 m between the axles: 0.056
  EXPECT_LT(steepest, 0.25);
  EXPECT_GT(sim.position().x(), 1.5);
  EXPECT_NEAR(sim.position().z(), 0.0, 3e-3);
  EXPECT_NEAR(sim.robot().twist.linear.x(), 0.4, 0.03);
}

TEST_P(OnWheels, PushesALightBox) {
  Sim sim(plane_sdf() + robot("0 0 0 0 0 0") +
          box_sdf("box", "0.7 0 0.15 0 0 0", "0.3 0.4 0.3", 1.0, 0.4));
  sim.run(0.5);
  const int box = sim.body("box/l");
  ASSERT_GE(box, 0);
  sim.velocity(0.3, 0.0);
  sim.run(4.0);
  EXPECT_GT(sim.state.bodies[box].translation.x(),
            1.2);  // 1.2 m of way, the first 0.3 without it
  EXPECT_GT(sim.position().x(), 0.9);
  EXPECT_LT(sim.position().x(), 1.25);
}

// 8 degrees up to a deck 0.278 m high, and down again on the other side.
TEST_P(OnWheels, ClimbsARampAndComesDown) {
  const double slope = 8.0 * M_PI / 180.0, length = 2.0, height = length * std::sin(slope),
               foot = 1.0;
  const double run = length * std::cos(slope);
  const auto ramp = [&](const std::string& name, double x,
                        double pitch) {  // a board 0.1 m thick, its top on the line
    const double sink = 0.05;
    return box_sdf(name,
                   std::to_string(x - sink * std::sin(pitch)) + " 0 " +
                       std::to_string(0.5 * height - sink * std::cos(pitch)) + " 0 " +
                       std::to_string(pitch) + " 0",
                   std::to_string(length) + " 3 0.1", 0.0, 1.0);
  };
  Sim sim(
      plane_sdf() + robot("0 0 0 0 0 0") + ramp("up", foot + 0.5 * run, -slope) +
      box_sdf("deck",
              std::to_string(foot + run + 1.0) + " 0 " + std::to_string(0.5 * height) + " 0 0 0",
              "2 3 " + std::to_string(height), 0.0, 1.0) +
      ramp("down", foot + run + 2.0 + 0.5 * run, slope));
  sim.run(0.5);
  sim.velocity(0.5, 0.0);
  double highest = 0.0, on_ramp = 0.0;
  for (int i = 0; i < 3800 && sim.position().x() < foot + 2 * run + 3.0; ++i) {
    sim.step();
    highest = std::max(highest, sim.position().z());
    if (std::abs(sim.position().x() - foot - 0.5 * run) < 0.005)
      on_ramp = sim.robot().twist.linear.x();
    ASSERT_LT(tilt(sim), 0.3);
  }
  EXPECT_NEAR(highest, height, 0.04);
  EXPECT_NEAR(on_ramp, 0.5, 0.03);  // uphill, too
  EXPECT_GT(sim.position().x(), foot + 2 * run + 2.9);
  EXPECT_NEAR(sim.position().z(), 0.0, 5e-3);
  EXPECT_NEAR(sim.robot().twist.linear.x(), 0.5, 0.03);
  EXPECT_NEAR(sim.position().y(), 0.0, 0.05);
}

// Asleep, it does not move; what runs into it wakes it and moves it.
TEST_P(OnWheels, AContactWakesIt) {
  Sim sim(plane_sdf() + robot("1 0 0 0 0 1.5708") +
          robot_sdf("pusher", "0 0 0 0 0 0", "<ruedo:watchdog>0</ruedo:watchdog>"));
  sim.run(3.0);
  const int body = sim.layout.robots[0].body;
  EXPECT_TRUE(sim.physics.sleeping(BodyIndex(body)));
  const Vec3 rest = sim.position();
  sim.run(1.0);
  EXPECT_EQ(sim.position(), rest);
  sim.velocity(0.5, 0.0, RobotIndex(1));
  sim.run(0.5);
  EXPECT_TRUE(sim.physics.sleeping(BodyIndex(body)));  // the other is on its way
  sim.run(2.5);
  EXPECT_GT(sim.position().x(), rest.x() + 0.01);  // as far as tyres let it go sideways
  sim.velocity(-0.5, 0.0, RobotIndex(1));
  sim.run(3.0);
  EXPECT_TRUE(sim.physics.sleeping(BodyIndex(body)));  // left alone, it sleeps again
}

// There by arc, line and turn, and back the same way: the difference is slip.
TEST_P(OnWheels, ComesBackTheWayItWent) {
  Sim sim(plane_sdf() + robot("0 0 0 0 0 0"));
  sim.run(1.0);
  const Vec3 start = sim.position();
  const double heading = sim.yaw();
  const auto drive = [&](int8_t kind, double value, double radius = 0.0, double speed = 0.5) {
    sim.move(kind, value, radius, speed, 0.5, 0.5);
    ASSERT_TRUE(done(sim));
  };
  drive(Move::ADVANCE, 1.0);
  drive(Move::ROTATE, 1.0);
  drive(Move::ADVANCE, 0.7);
  EXPECT_GT((sim.position() - start).norm(), 1.3);
  drive(Move::ADVANCE, -0.7);
  drive(Move::ROTATE, -1.0);
  drive(Move::ADVANCE, -1.0);
  const bool skids = GetParam().skid != 1.0;
  EXPECT_LT((sim.position() - start).norm(), skids ? 0.03 : 0.01);
  EXPECT_NEAR(sim.yaw(), heading, skids ? 0.03 : 3e-3);
  RecordProperty("missed_um", static_cast<int>(1e6 * (sim.position() - start).norm()));
}

INSTANTIATE_TEST_SUITE_P(Pioneers, OnWheels,
                         ::testing::Values(Pioneer{"p3at", p3at, 4.2, 0.27, kSkidOfP3at},
                                           Pioneer{"p3at_late", p3at, 0.27, 4.2, kSkidOfP3at},
                                           Pioneer{"p3dx", p3dx, 0.3, 0.3, 1.0}),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace ruedo::robot::testing
