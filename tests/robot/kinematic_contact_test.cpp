// The kinematic drive against the world: walls, boxes, other robots, ramps, steps, falls.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "sim.h"

namespace ruedo::robot::testing {
namespace {

const std::string kNoWatchdog = "<ruedo:watchdog>0</ruedo:watchdog>";
constexpr double kFront_m = 0.25;  // of the chassis before base_link

class WallAtAnyStep : public ::testing::TestWithParam<int64_t> {};

TEST_P(WallAtAnyStep, AWallStopsTheRobotAtFullSpeed) {
  Sim sim(plane_sdf() + robot_sdf("r", "0 0 0 0 0 0", kNoWatchdog) +
              box_sdf("wall", "1.1 0 0.5 0 0 0", "0.2 4 1"),
          GetParam());
  sim.velocity(1.2, 0.0);
  double furthest = 0.0;
  for (int i = 0; i < 2'000'000 / GetParam(); ++i) {
    sim.step();
    furthest = std::max(furthest, sim.position().x());
  }
  EXPECT_NEAR(sim.position().x() + kFront_m, 1.0, 2e-3);
  EXPECT_LT(furthest + kFront_m, 1.005);
  EXPECT_NEAR(sim.yaw(), 0.0, 2e-3);  // it hits at 1.2 m/s, and steps are up to 50 ms
  EXPECT_NEAR(sim.position().z(), 0.0, 1e-12);
  EXPECT_NEAR(sim.robot().twist.linear.x(), 0.0, 0.02);
  // The wheels turn as commanded: 1.2 m/s on 0.1 m for 2 s.
  EXPECT_EQ(sim.robot().wheel_v, 1.2);
  EXPECT_NEAR(sim.state.wheel_angles[0], 24.0, 1e-9);
  ASSERT_FALSE(sim.state.contacts.empty());
  EXPECT_NEAR(sim.state.contacts[0].normal.x(), -1.0, 1e-6);  // from the wall towards the robot
}

TEST_P(WallAtAnyStep, AwayFromTheWallItIsFreeAgain) {
  Sim sim(plane_sdf() + robot_sdf("r", "0 0 0 0 0 0", kNoWatchdog) +
              box_sdf("wall", "1.1 0 0.5 0 0 0", "0.2 4 1"),
          GetParam());
  sim.velocity(0.8, 0.0);
  sim.run(1.5);
  sim.velocity(-0.5, 0.0);
  sim.run(0.5);
  EXPECT_NEAR(sim.yaw(), 0.0, 1e-5);  // the wall may turn it: sweeps end at 1e-5 m/s
  const Vec3 start = sim.position();
  sim.run(1.0);
  EXPECT_NEAR((sim.position() - start).norm(), 0.5, 1e-12);
}

INSTANTIATE_TEST_SUITE_P(Steps, WallAtAnyStep, ::testing::Values(1000, 5000, 10000, 20000, 50000));

TEST(KinematicContact, TheForceOnAWallIsTheDrivesLimit) {
  Sim sim(plane_sdf() +
          robot_sdf("r", "0 0 0 0 0 0", kNoWatchdog + "<ruedo:max_force>60</ruedo:max_force>") +
          box_sdf("wall", "1.1 0 0.5 0 0 0", "0.2 4 1"));
  sim.velocity(1.0, 0.0);
  sim.run(3.0);
  double force = 0.0;
  for (const Contact& contact : sim.state.contacts) force += contact.force;
  EXPECT_NEAR(force, 60.0, 1.0);
}

TEST(KinematicContact, SlidesAlongASlantedWall) {
  // A wall at 30 degrees to the robot's path.
  Sim sim(plane_sdf() + robot_sdf("r", "0 0 0 0 0 0", kNoWatchdog) +
          box_sdf("wall", "2 0.2 0.5 0 0 0.5236", "8 0.2 1"));
  sim.velocity(0.5, 0.0);
  sim.run(10.0);
  EXPECT_GT(sim.position().x(), 1.5);
}

TEST(KinematicContact, PushesALightBoxNotAHeavyOne) {
  const auto push = [](double mass) {
    Sim sim(plane_sdf() + robot_sdf("r", "0 0 0 0 0 0", kNoWatchdog) +
            box_sdf("box", "0.6 0 0.15 0 0 0", "0.3 0.3 0.3", mass, 0.6));
    sim.velocity(0.3, 0.0);
    sim.run(4.0);
    return sim.state.bodies[1].translation.x() - 0.6;
  };
  EXPECT_NEAR(push(5.0), 1.2 - 0.2,
              0.05);             // 5 kg, 29 N of friction: pushed nearly as fast as commanded
  EXPECT_LT(push(100.0), 0.01);  // 590 N of friction against the robot's weight of 196 N
}

TEST(KinematicContact, AnotherRobotStopsIt) {
  Sim sim(plane_sdf() + robot_sdf("a", "0 0 0 0 0 0", kNoWatchdog) +
          robot_sdf("b", "1.5 0 0 0 0 3.14159265358979", kNoWatchdog));
  sim.velocity(0.5, 0.0, RobotIndex(0));
  sim.velocity(0.5, 0.0, RobotIndex(1));
  sim.run(4.0);
  EXPECT_NEAR(sim.position(1).x() - sim.position(0).x(), 2 * kFront_m, 5e-3);
  EXPECT_NEAR(sim.position(0).x(), 0.5, 0.03);  // alike, they hold each other in the middle
}

TEST(KinematicContact, APrimitiveBlockedByAWallEnds) {
  Sim sim(plane_sdf() + robot_sdf("r", "0 0 0 0 0 0", limits(0.6, 1.0, 0.5, 0.5, 1.0)) +
          box_sdf("wall", "1.1 0 0.5 0 0 0", "0.2 4 1"));
  sim.move(Move::ADVANCE, 3.0, 0, 0, 0, 0, RobotIndex(0), 9);
  sim.run(6.0);
  EXPECT_EQ(sim.robot().motion.id, 9);
  EXPECT_EQ(sim.robot().motion.state, Status::STATE_ENDED);
  EXPECT_EQ(sim.robot().motion.reason, Status::REASON_BLOCKED);
  EXPECT_NEAR(sim.robot().motion.done, 0.75, 5e-3);
  EXPECT_NEAR(sim.robot().motion.remaining, 2.25, 5e-3);
  EXPECT_EQ(sim.robot().wheel_v, 0.0);
}

// A velocity command stays active, and its status says that the robot is blocked, until it is not.
TEST(KinematicContact, AWallBlocksAVelocity) {
  Sim sim(plane_sdf() + robot_sdf("r", "0 0 0 0 0 0", kNoWatchdog) +
          box_sdf("wall", "1.1 0 0.5 0 0 0", "0.2 4 1"));
  sim.velocity(0.5, 0.0);
  sim.run(1.0);
  EXPECT_EQ(sim.robot().motion.reason, Status::REASON_NONE);  // on its way
  sim.run(3.0);
  EXPECT_EQ(sim.robot().motion.kind, Status::KIND_VELOCITY);
  EXPECT_EQ(sim.robot().motion.state, Status::STATE_RUNNING);
  EXPECT_EQ(sim.robot().motion.reason, Status::REASON_BLOCKED);
  sim.velocity(0.5, 0.0);  // said again, it is still blocked
  sim.run(0.1);
  EXPECT_EQ(sim.robot().motion.reason, Status::REASON_BLOCKED);
  sim.velocity(-0.3, 0.0);
  sim.run(1.0);
  EXPECT_EQ(sim.robot().motion.reason, Status::REASON_NONE);
}

std::string blocked_by(const Sim& sim, int robot = 0) {
  return world::body_name(*sim.world, sim.layout, sim.robot(robot).motion.blocked_by);
}

// A controller corrects its command all the time.
TEST(KinematicContact, AVelocityThatKeepsChangingIsBlocked) {
  for (const char* drive : {"kinematic", "wheels"}) {
    for (const std::string& limited : {std::string(), limits(0.6, 1.0, 0.5, 0.5, 1.0)}) {
      Sim sim(plane_sdf() + robot_sdf("r", "0 0 0 0 0 0", limited + kNoWatchdog, drive) +
              box_sdf("wall", "1.1 0 0.5 0 0 0", "0.2 4 1"));
      int blocked = 0;
      for (int i = 0; i < 100; ++i) {
        sim.velocity(i % 3 == 0 ? 0.4 : 0.39, i % 2 == 0 ? 0.01 : -0.01);
        sim.run(0.1);
        if (i < 20) {
          EXPECT_EQ(blocked_by(sim), "") << drive << i;  // on its way
        }
        if (i >= 40) blocked += blocked_by(sim) == "wall/l" ? 1 : 0;
      }
      EXPECT_EQ(blocked, 60) << drive;
      sim.velocity(-0.3, 0.01);  // the other way: not blocked
      EXPECT_EQ(blocked_by(sim), "wall/l");
      sim.run(0.05);
      EXPECT_EQ(blocked_by(sim), "") << drive;
    }
  }
}

// A mecanum base that rubs along a wall moves as it is driven, and one that is driven against it
// does not.
TEST(KinematicContact, SidewaysIsAWayAsWell) {
  Sim sim(plane_sdf() +
          "<model name='m'><link name='l'><pose>0 0 0.1 0 0 0</pose><collision name='c'><geometry>"
          "<box><size>0.4 0.4 0.2</size></box></geometry></collision></link>"
          "<ruedo:drive steering='holonomic'>" +
          kNoWatchdog + "</ruedo:drive></model>" +
          box_sdf("wall", "0.3001 0 0.5 0 0 0", "0.2 9 1"));
  const auto drive = [&](double vx, double vy) {
    sim.robots.apply({RobotIndex(0), VelocityCommand{vx, vy, 0.0}});
    sim.run(1.2);
    return blocked_by(sim);
  };
  EXPECT_EQ(drive(0.3, 0.3), "");
  EXPECT_EQ(drive(0.3, 0.0), "wall/l");
}

// The robot rubs along a wall at its side all the way, and stops at a crate in the end.
TEST(KinematicContact, ReportsTheLinkThatBlocks) {
  for (const char* drive : {"kinematic", "wheels"}) {
    Sim sim(plane_sdf() + robot_sdf("r", "0 0 0 0 0 0", kNoWatchdog, drive) +
            box_sdf("side", "1 0.3299 0.5 0 0 0", "6 0.2 1") +
            box_sdf("crate", "1 0 0.5 0 0 0", "0.4 0.4 1", 400.0));
    sim.velocity(0.4, 0.0);
    EXPECT_EQ(blocked_by(sim), "") << drive;
    sim.run(5.0);
    EXPECT_EQ(sim.robot().motion.reason, Status::REASON_BLOCKED) << drive;
    EXPECT_EQ(blocked_by(sim), "crate/l") << drive;
    sim.velocity(-0.4, 0.0);
    sim.run(1.0);
    EXPECT_EQ(blocked_by(sim), "") << drive;
  }
}

TEST(KinematicContact, ReportsTheLinkThatBlocksAPrimitiveUntilTheNextCommand) {
  Sim sim(plane_sdf() + robot_sdf("r", "0 0 0 0 0 0") + robot_sdf("s", "0 2 0 0 0 0") +
          box_sdf("wall", "1.1 0 0.5 0 0 0", "0.2 6 1"));
  sim.move(Move::ADVANCE, 3.0);
  sim.run(6.0);
  EXPECT_EQ(sim.robot().motion.reason, Status::REASON_BLOCKED);
  EXPECT_EQ(blocked_by(sim), "wall/l");
  sim.run(2.0);
  EXPECT_EQ(blocked_by(sim), "wall/l");
  EXPECT_EQ(blocked_by(sim, 1), "");
  sim.move(Move::ADVANCE, -0.2);
  sim.step();
  EXPECT_EQ(blocked_by(sim), "");
}

// It is commanded to back off while its wheels still turn ahead: they brake at the wall for 1.2 s,
// which does not count as blocked.
TEST(KinematicContact, BackingOffAWallIsNotBlockedByIt) {
  for (const bool primitive : {true, false}) {
    Sim sim(plane_sdf() +
            robot_sdf("r", "0 0 0 0 0 0", limits(0.6, 1.0, 0.5, 0.5, 1.0) + kNoWatchdog) +
            box_sdf("wall", "1.1 0 0.5 0 0 0", "0.2 4 1"));
    sim.move(Move::ADVANCE, 3.0);
    while (sim.robot().motion.reason != Status::REASON_BLOCKED) sim.step();
    primitive ? sim.move(Move::ADVANCE, -0.5, 0, 0, 0, 0, RobotIndex(0), 7)
              : sim.velocity(-0.2, 0.0);
    for (int i = 0; i < 1200; ++i) {
      sim.step();
      EXPECT_NE(sim.robot().motion.reason, Status::REASON_BLOCKED);
    }
    EXPECT_LT(sim.position().x(), 0.35);
    if (primitive) {
      EXPECT_EQ(sim.robot().motion.state, Status::STATE_DONE);
    }
  }
}

// It does not fit between two posts, and cannot turn there.
TEST(KinematicContact, ReportsTheLinkThatBlocksATurn) {
  Sim sim(plane_sdf() + robot_sdf("r", "0 0 0 0 0 0", kNoWatchdog) +
          box_sdf("post", "0.2 0.29 0.5 0 0 0", "0.1 0.1 1") +
          box_sdf("other", "-0.2 -0.29 0.5 0 0 0", "0.1 0.1 1"));
  sim.velocity(0.0, 0.5);
  sim.run(4.0);
  EXPECT_EQ(sim.robot().motion.reason, Status::REASON_BLOCKED);
  EXPECT_TRUE(blocked_by(sim) == "post/l" || blocked_by(sim) == "other/l") << blocked_by(sim);
}

// A slope that is too steep blocks like a wall.
TEST(KinematicContact, ReportsASlopeThatIsTooSteep) {
  Sim sim(plane_sdf() + robot_sdf("r", "0 0 0 0 0 0", kNoWatchdog) +
          box_sdf("ramp", "2.3 0 0.4 0 -0.9 0", "3 3 0.1"));
  sim.velocity(0.5, 0.0);
  sim.run(8.0);
  EXPECT_EQ(sim.robot().motion.reason, Status::REASON_BLOCKED);
  EXPECT_EQ(blocked_by(sim), "ramp/l");
}

// A robot whose file says that its primitives end by odometry trusts its wheels, but whether a
// velocity is blocked depends on the surroundings.
TEST(KinematicContact, ARobotThatBelievesItsWheelsIsBlockedAllTheSame) {
  Sim sim(
      plane_sdf() +
      robot_sdf("r", "0 0 0 0 0 0", kNoWatchdog + "<ruedo:primitives>odometry</ruedo:primitives>") +
      box_sdf("wall", "1.1 0 0.5 0 0 0", "0.2 4 1"));
  sim.velocity(0.5, 0.0);
  sim.run(4.0);
  EXPECT_EQ(sim.robot().motion.reason, Status::REASON_BLOCKED);
  EXPECT_EQ(blocked_by(sim), "wall/l");
}

std::vector<std::string> collides_with(const Sim& sim, int robot = 0) {
  std::vector<std::string> names;
  for (const Collision& each : sim.state.collisions) {
    const Contact& contact = sim.state.contacts[each.contact];
    if (each.robot != robot) continue;
    names.push_back(
        world::body_name(*sim.world, sim.layout, each.as_a ? contact.link_b : contact.link_a));
  }
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  return names;
}

// Two robots that meet each report the other, whichever is first in the world; what carries them
// and what they carry is left out.
TEST(KinematicContact, CollisionsAreWithNeitherTheFloorNorTheCargo) {
  for (const char* drive : {"kinematic", "wheels"}) {
    Sim sim(plane_sdf() + robot_sdf("a", "0 0 0 0 0 0", kNoWatchdog, drive) +
            robot_sdf("b", "1.5 0 0 0 0 3.14159265358979", kNoWatchdog, drive) +
            box_sdf("cargo", "0 0 0.3 0 0 0", "0.1 0.1 0.1", 1.0));
    sim.run(1.0);
    EXPECT_TRUE(sim.state.collisions.empty()) << drive;
    EXPECT_FALSE(sim.state.contacts.empty()) << drive;  // the cargo's
    sim.velocity(0.5, 0.0, RobotIndex(0));
    sim.velocity(0.3, 0.0, RobotIndex(1));
    sim.run(3.0);
    EXPECT_EQ(collides_with(sim, 0), (std::vector<std::string>{"b/base"})) << drive;
    EXPECT_EQ(collides_with(sim, 1), (std::vector<std::string>{"a/base"})) << drive;
  }
}

// A robot at rest against something still reports the contact. One on wheels rolls back
// from the wall by some 0.1 mm once its wheels push no more.
TEST(KinematicContact, AsleepAtAWallItStillTouchesIt) {
  for (const char* drive : {"kinematic", "wheels"}) {
    Sim sim(plane_sdf() + robot_sdf("a", "0 0 0 0 0 0", "", drive) +
            box_sdf("wall", "1.1 0 0.5 0 0 0", "0.2 4 1"));
    sim.move(Move::ADVANCE, 3.0);
    sim.run(6.0);
    const std::vector<std::string> wall = {"wall/l"};
    ASSERT_EQ(collides_with(sim), wall) << drive;
    sim.run(5.0);
    const std::vector<std::string> at_rest = collides_with(sim);
    if (drive == std::string("kinematic")) EXPECT_EQ(at_rest, wall);
    sim.run(60.0);
    EXPECT_EQ(collides_with(sim), at_rest) << drive;
  }
}

TEST(KinematicContact, APrimitiveThatPushesABoxStillEndsAtItsDistance) {
  Sim sim(plane_sdf() + robot_sdf("r", "0 0 0 0 0 0", limits(0.5, 1.0, 0.5, 0.5, 1.0)) +
          box_sdf("box", "0.6 0 0.15 0 0 0", "0.3 0.3 0.3", 5.0));
  sim.move(Move::ADVANCE, 1.0);
  sim.run(8.0);
  EXPECT_EQ(sim.robot().motion.state, Status::STATE_DONE);
  EXPECT_NEAR(sim.position().x(), 1.0, 1e-3);
}

// A ramp of 15 degrees, 3 m long, its lower edge in the ground at x = 1.
std::string ramp_sdf() { return box_sdf("ramp", "2.435 0 0.2872 0 -0.2618 0", "3 3 0.2"); }

TEST(KinematicContact, ClimbsARampAndHoldsThere) {
  Sim sim(plane_sdf() +
          robot_sdf("r", "0 0 0 0 0 0", kNoWatchdog + limits(1.0, 1.0, 1.0, 1.0, 1.0)) +
          ramp_sdf());
  sim.velocity(0.5, 0.0);
  sim.run(4.5);
  EXPECT_GT(sim.position().z(), 0.15);
  EXPECT_NEAR(std::asin((sim.robot().X_WBase.rotation * Vec3::UnitX()).z()), 0.2618, 5e-3);
  sim.velocity(0.0, 0.0);
  sim.run(3.0);
  const Pose held = sim.robot().X_WBase;
  sim.run(600.0);
  EXPECT_LT((sim.robot().X_WBase.translation - held.translation).norm(), 1e-6);
  EXPECT_LT(sim.robot().X_WBase.rotation.angularDistance(held.rotation), 1e-6);
}

TEST(KinematicContact, TheWayOnARampIsTheCommandedOne) {
  Sim sim(plane_sdf() + robot_sdf("r", "2.2 0 0.4 0 -0.2618 0", limits(1.0, 1.0, 1.0, 1.0, 1.0)) +
          ramp_sdf());
  sim.run(2.0);  // falls onto the ramp
  const Vec3 before = sim.position();
  sim.move(Move::ADVANCE, 0.8);
  sim.run(3.0);
  EXPECT_NEAR((sim.position() - before).norm(), 0.8, 1e-3);
  sim.move(Move::ADVANCE, -0.8);
  sim.run(3.0);
  EXPECT_LT((sim.position() - before).norm(), 2e-3);
}

TEST(KinematicContact, BackOnThePlaneItIsAnalyticAgain) {
  Sim sim(plane_sdf() +
          robot_sdf("r", "0 0 0 0 0 0", kNoWatchdog + limits(1.0, 1.0, 1.0, 1.0, 1.0)) +
          ramp_sdf());
  sim.velocity(0.5, 0.0);
  sim.run(4.0);
  EXPECT_GT(sim.position().z(), 0.1);
  sim.velocity(-0.5, 0.0);
  sim.run(6.0);
  EXPECT_EQ(sim.position().z(), 0.0);
  EXPECT_EQ(sim.robot().X_WBase.rotation.x(), 0.0);
}

TEST(KinematicContact, DrivesOverALowStep) {
  Sim sim(plane_sdf() +
          robot_sdf("r", "0 0 0 0 0 0", kNoWatchdog + limits(1.0, 1.0, 1.0, 1.0, 1.0)) +
          box_sdf("step", "2 0 0.01 0 0 0", "1 3 0.02"));
  sim.velocity(0.5, 0.0);
  sim.run(4.0);
  EXPECT_NEAR(sim.position().x(), 0.5 * 4.0 - 0.125, 0.01);  // 0.125 m less for the start
  EXPECT_NEAR(sim.position().z(), 0.02, 2e-3);
  sim.run(4.0);
  EXPECT_NEAR(sim.position().z(), 0.0, 1e-9);
}

TEST(KinematicContact, OnABoxFloorItDrivesTheClosedForm) {
  Sim sim(box_sdf("floor", "0 0 -0.5 0 0 0", "20 20 1") +
          robot_sdf("r", "0 0 0.001 0 0 0", limits(1.0, 1.0, 0.5, 1.0, 1.0)));
  sim.run(1.0);
  sim.move(Move::ADVANCE, 1.0);
  sim.run(4.0);
  EXPECT_NEAR(sim.position().x(), 1.0, 1e-4);
  EXPECT_NEAR(sim.position().z(), 0.0, 1e-3);
}

TEST(KinematicContact, FallsFreelyAndLands) {
  Sim sim(plane_sdf() + robot_sdf("r", "0 0 1 0 0 0", kNoWatchdog));
  sim.velocity(0.5, 0.0);
  sim.run(0.3);
  EXPECT_NEAR(sim.position().z(), 1.0 - 0.5 * 9.8 * 0.09, 0.01);
  EXPECT_NEAR(sim.position().x(), 0.0, 1e-9);  // wheels in the air drive nothing
  sim.run(3.0);
  EXPECT_NEAR(sim.position().z(), 0.0, 1e-9);
  EXPECT_GT(sim.position().x(), 0.5);
}

TEST(KinematicContact, APlaneThatIsNotLevelIsARamp) {
  // 0.1 rad about y: x goes down.
  const std::string slope =
      "<model name='ground'><static>true</static><pose>0 0 0 0 0.1 0</pose><link "
      "name='l'><collision name='c'><geometry><plane>"
      "<normal>0 0 1</normal><size>100 100</size></plane></geometry></collision></link></model>";
  Sim sim(slope + robot_sdf("r", "0 0 0.002 0 0.1 0", limits(1.0, 1.0, 0.5, 1.0, 1.0)));
  sim.run(2.0);
  const Vec3 start = sim.position();
  sim.run(10.0);
  EXPECT_LT((sim.position() - start).norm(), 1e-6);
  sim.move(Move::ADVANCE, 1.0);
  sim.run(4.0);
  EXPECT_NEAR(sim.position().x() - start.x(), std::cos(0.1), 1e-4);
  EXPECT_NEAR(sim.position().z() - start.z(), -std::sin(0.1), 1e-4);
}

TEST(KinematicContact, AMoverPushesARestingRobot) {
  Sim sim(plane_sdf() + robot_sdf("r", "0 0 0 0 0 0", "<ruedo:max_force>20</ruedo:max_force>") +
          "<model name='mover'><link name='l'><collision name='c'><geometry><box><size>0.4 0.4 "
          "0.4</size></box></geometry></collision></link>"
          "<ruedo:path><ruedo:waypoint>0 -1 0 0.25 0 0 0</ruedo:waypoint><ruedo:waypoint>4 0 0 "
          "0.25 0 0 0</ruedo:waypoint>"
          "<ruedo:loop>false</ruedo:loop></ruedo:path></model>");
  sim.run(5.0);
  EXPECT_NEAR(sim.state.bodies[1].translation.x(), 0.0, 1e-12);  // wherever the path says
  // Pushed at 0.25 m/s up to 0.45 m, then braked by 20 N on 20 kg: 1 m/s^2.
  EXPECT_NEAR(sim.position().x(), 0.45 + 0.5 * 0.25 * 0.25, 2e-3);
}

}  // namespace
}  // namespace ruedo::robot::testing
