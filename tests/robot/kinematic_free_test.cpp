// The kinematic drive on a free plane: the closed form, whatever the step; primitives; the paper's
// experiment E1.
#include <cmath>
#include <utility>

#include <gtest/gtest.h>

#include "sim.h"

namespace ruedo::robot::testing {
namespace {

std::string free_robot(const std::string& drive = limits(2.0, 2.0, 0.5, 1.0, 1.5)) {
  return plane_sdf() + robot_sdf("r", "0 0 0 0 0 0", drive);
}

class FreeAtAnyStep : public ::testing::TestWithParam<int64_t> {};

// E1 of the paper: 1 m with a triangular profile, with the acceleration limit above the
// deceleration limit and the other way round. The paper's simulator drove 1126.40 mm and 1016.96
// mm.
TEST_P(FreeAtAnyStep, AdvanceOneMetreByTriangles) {
  for (const auto& [a, d] : {std::pair(4.2, 0.27), std::pair(0.27, 4.2)}) {
    Sim sim(free_robot(limits(5.0, 2.0, a, d, 1.0)), GetParam());
    sim.move(Move::ADVANCE, 1.0);
    sim.run(5.0);
    EXPECT_EQ(sim.robot().motion.state, Status::STATE_DONE);
    EXPECT_NEAR(sim.position().x(), 1.0, 1e-9);
    EXPECT_EQ(sim.position().y(), 0.0);
    EXPECT_EQ(sim.robot().twist.linear.x(), 0.0);
    EXPECT_EQ(sim.robot().motion.remaining, 0.0);
    EXPECT_EQ(sim.robot().motion.done, 1.0);
  }
}

// v omega to the left on a circle, and beside it the change of the speed: what an accelerometer
// shows, too.
TEST_P(FreeAtAnyStep, AccelerationTurnsWithTheRobot) {
  Sim sim(free_robot(limits(5.0, 5.0, 0.5, 1.0, 1e3) + "<ruedo:watchdog>0</ruedo:watchdog>"),
          GetParam());
  const auto expect = [&](double ahead, double left, double tolerance) {
    EXPECT_NEAR((sim.robot().acceleration - Vec3(ahead, left, 0)).norm(), 0.0, tolerance);
    const BodyIndex body = sim.layout.robots[RobotIndex(0)].body;
    const Vec3 shown =
        sim.robot().X_WBase.rotation.conjugate() * sim.state.body_accelerations[body];
    EXPECT_NEAR((shown - Vec3(ahead, left, 0)).norm(), 0.0, tolerance);
  };
  sim.velocity(2.0, 1.3);
  sim.run(2.0);
  ASSERT_NEAR(sim.robot().twist.linear.x(), 1.0, 1e-6);
  const double step_s = 1e-6 * static_cast<double>(GetParam());
  expect(0.5, 1.3 * 1.0, 0.5 * 1.3 * step_s + 3e-4);  // the speed changes on in half a step
  sim.run(2.5);
  expect(0.0, 1.3 * 2.0, 2e-4 * 2.6);
}

// The same commands at the same times give the same path, up to rounding. Commands come at
// multiples of 50 ms.
TEST_P(FreeAtAnyStep, FreeMotionDoesNotDependOnTheStep) {
  const auto drive = [](int64_t step_us) {
    Sim sim(free_robot(), step_us);
    sim.velocity(0.7, 1.1);
    sim.run(0.5);
    sim.velocity(0.9, -0.8);
    sim.run(0.45);
    sim.velocity(-0.3, 0.4);
    sim.run(0.55);
    sim.move(Move::ARC, -1.3, 0.8);
    sim.run(6.0);
    sim.move(Move::ROTATE, 2.0);
    sim.run(4.0);
    return sim.robot().X_WBase;
  };
  static const Pose reference = drive(100);
  const Pose pose = drive(GetParam());
  EXPECT_NEAR(pose.translation.x(), reference.translation.x(), 1e-10);
  EXPECT_NEAR(pose.translation.y(), reference.translation.y(), 1e-10);
  EXPECT_NEAR(wrap_angle(heading(pose.rotation) - heading(reference.rotation)), 0.0, 1e-10);
}

INSTANTIATE_TEST_SUITE_P(Steps, FreeAtAnyStep,
                         ::testing::Values(100, 1000, 2000, 5000, 12500, 25000, 50000));

TEST(KinematicFree, CircleOfConstantTwist) {
  Sim sim(free_robot(""));  // no limits: full speed at once
  sim.velocity(0.5, 1.0);
  sim.run(0.5);
  EXPECT_NEAR(sim.position().x(), 0.5 * std::sin(0.5), 1e-14);
  EXPECT_NEAR(sim.position().y(), 0.5 * (1.0 - std::cos(0.5)), 1e-14);
  EXPECT_NEAR(sim.yaw(), 0.5, 1e-14);
  EXPECT_EQ(sim.robot().twist.linear, Vec3(0.5, 0, 0));
  EXPECT_EQ(sim.robot().twist.angular, Vec3(0, 0, 1));
  // Centripetal: v omega to the left, by differences over the step.
  EXPECT_NEAR(sim.robot().acceleration.y(), 0.5, 1e-5);
  // Wheels: (v -+ omega 0.2) / 0.1.
  EXPECT_NEAR(sim.state.wheel_rates[0], 3.0, 1e-12);
  EXPECT_NEAR(sim.state.wheel_rates[2], 7.0, 1e-12);
  EXPECT_NEAR(sim.state.wheel_angles[1], 1.5, 1e-12);
  EXPECT_NEAR(sim.state.wheel_angles[3], 3.5, 1e-12);
}

// Also from as deep as its axles: contacts with the plane would throw it into the air.
TEST(KinematicFree, StandsOnThePlaneWithItsWheels) {
  for (const double height : {-0.09, -0.01, -0.004, 0.0, 0.004}) {
    Sim sim(plane_sdf() + robot_sdf("r", "0 0 " + std::to_string(height) + " 0 0 0.3"));
    EXPECT_NEAR(sim.position().z(), 0.0, 1e-12);
    sim.run(0.1);
    EXPECT_NEAR(sim.position().z(), 0.0, 1e-12);
    EXPECT_NEAR(sim.yaw(), 0.3, 1e-12);
  }
}

TEST(KinematicFree, SquareReturnsToItsStart) {
  Sim sim(free_robot());
  for (int side = 0; side < 4; ++side) {
    sim.move(Move::ADVANCE, 1.0);
    sim.run(4.0);
    sim.move(Move::ROTATE, M_PI / 2);
    sim.run(4.0);
  }
  EXPECT_NEAR(sim.position().x(), 0.0, 1e-9);
  EXPECT_NEAR(sim.position().y(), 0.0, 1e-9);
  EXPECT_NEAR(sim.yaw(), 0.0, 1e-9);
}

TEST(KinematicFree, LeftEqualsRightMirrored) {
  const auto drive = [](double sign) {
    Sim sim(free_robot());
    sim.velocity(0.6, sign * 0.9);
    sim.run(0.4);
    sim.move(Move::ARC, sign * 1.0, 0.5);
    sim.run(5.0);
    return sim.robot();
  };
  const RobotState left = drive(1.0), right = drive(-1.0);
  EXPECT_EQ(left.X_WBase.translation.x(), right.X_WBase.translation.x());
  EXPECT_EQ(left.X_WBase.translation.y(), -right.X_WBase.translation.y());
  EXPECT_EQ(left.X_WBase.rotation.z(), -right.X_WBase.rotation.z());
}

TEST(KinematicFree, ArcEndsOnItsCircle) {
  Sim sim(free_robot());
  sim.move(Move::ARC, -M_PI / 2, 2.0);
  sim.run(8.0);
  EXPECT_NEAR(sim.position().x(), 2.0, 1e-9);
  EXPECT_NEAR(sim.position().y(), -2.0, 1e-9);
  EXPECT_NEAR(sim.yaw(), -M_PI / 2, 1e-9);
  EXPECT_NEAR(sim.robot().motion.done, -M_PI / 2, 1e-9);
}

TEST(KinematicFree, HeadingIsInOdomAndTheShortestWay) {
  Sim sim(plane_sdf() + robot_sdf("r", "0 0 0 0 0 3.0", limits(2.0, 2.0, 0.5, 1.0, 1.5)));
  sim.move(Move::HEADING, 0.5);  // 3.5 rad in the world, by the left: through pi
  sim.run(3.0);
  EXPECT_NEAR(sim.yaw(), 3.5 - 2 * M_PI, 1e-9);
  sim.move(Move::HEADING, -3.0);
  sim.run(5.0);
  EXPECT_NEAR(wrap_angle(sim.yaw() - (3.0 - 3.0)), 0.0, 1e-9);
  EXPECT_NEAR(sim.robot().motion.done, 2 * M_PI - 3.5,
              1e-9);  // -3.0 - 0.5 = -3.5: the other way is shorter
  sim.robots.apply({RobotIndex(0), ResetOdometry{}});
  sim.move(Move::HEADING, 0.25);
  sim.run(3.0);
  EXPECT_NEAR(sim.yaw(), 0.25, 1e-9);
  EXPECT_EQ(sim.robot().odometry_resets, 1);
}

// Whatever command replaces another, no velocity changes faster than the limits.
TEST(KinematicFree, TakeOverWithinTheLimits) {
  Sim sim(free_robot(limits(1.0, 1.5, 0.5, 1.0, 1.5)));
  double v = 0.0, omega = 0.0;
  const auto run = [&](double seconds) {
    for (int i = 0; i < static_cast<int>(seconds * 200); ++i) {
      sim.step();
      const double v1 = sim.robot().wheel_v, omega1 = sim.robot().wheel_omega;
      const double allowed = std::abs(v1) > std::abs(v) ? 0.5 : 1.0;
      ASSERT_LE(std::abs(v1 - v), allowed * 0.005 + 1e-12);
      ASSERT_LE(std::abs(omega1 - omega), 1.5 * 0.005 + 1e-12);
      ASSERT_LE(std::abs(v1), 1.0);
      ASSERT_LE(std::abs(omega1), 1.5);
      v = v1;
      omega = omega1;
    }
  };
  sim.velocity(5.0, 9.0);  // above the limits: clamped
  run(0.55);
  sim.move(Move::ADVANCE, -2.0);
  run(0.8);
  sim.move(Move::ARC, 2.0, 0.3);
  run(0.7);
  sim.robots.apply({RobotIndex(0), WheelCommand{{12.0, -4.0}}});
  run(0.3);
  sim.move(Move::HEADING, -2.0);
  run(0.4);
  sim.move(Move::ADVANCE, 0.01);
  run(0.2);
  sim.move(Move::STOP, 0.0);
  run(2.0);
  EXPECT_EQ(v, 0.0);
  EXPECT_EQ(omega, 0.0);
  EXPECT_EQ(sim.robot().motion.state, Status::STATE_DONE);
}

TEST(KinematicFree, WatchdogStopsAtItsMicrosecond) {
  // 0.6 s at 0.5 m/s, then 1 m/s^2: 0.3 m and 0.125 m. The watchdog ends inside a step of 7 ms.
  for (const int64_t step_us : {1000, 5000, 7000}) {
    Sim sim(free_robot("<ruedo:deceleration>1</ruedo:deceleration>"), step_us);
    sim.velocity(0.5, 0.0);
    sim.run(2.1);
    EXPECT_NEAR(sim.position().x(), 0.425, 1e-12);
    EXPECT_EQ(sim.robot().motion.state, Status::STATE_ENDED);
    EXPECT_EQ(sim.robot().motion.reason, Status::REASON_WATCHDOG);
    EXPECT_EQ(sim.robot().motion.kind, Status::KIND_VELOCITY);
  }
}

TEST(KinematicFree, RepeatedCommandsFeedTheWatchdogAndChangeNothing) {
  Sim repeated(free_robot()),
      once(free_robot("<ruedo:watchdog>0</ruedo:watchdog>" + limits(2.0, 2.0, 0.5, 1.0, 1.5)));
  once.velocity(0.8, 0.3);
  for (int i = 0; i < 30; ++i) {
    repeated.velocity(0.8, 0.3);
    repeated.run(0.1);
    once.run(0.1);
  }
  EXPECT_EQ(repeated.position(), once.position());
  EXPECT_EQ(repeated.robot().motion.changes, 1);
}

TEST(KinematicFree, RestingRobotsSleepAndWakeForCommands) {
  Sim sim(free_robot());
  sim.run(1.0);
  EXPECT_TRUE(sim.physics.sleeping(BodyIndex(0)));
  sim.velocity(0.5, 0.0);
  sim.run(0.5);
  EXPECT_GT(sim.position().x(), 0.05);
}

struct Refused {
  Command command;
  int8_t reason;
};

TEST(Commands, RefusedOnesChangeNothingAndGiveAReason) {
  const double nan = std::nan(""), inf = INFINITY;
  const Refused table[] = {
      {{RobotIndex(0), VelocityCommand{nan, 0, 0}}, Status::REASON_NOT_FINITE},
      {{RobotIndex(0), VelocityCommand{0, inf, 0}}, Status::REASON_NOT_FINITE},
      {{RobotIndex(0), VelocityCommand{0, 0, -inf}}, Status::REASON_NOT_FINITE},
      {{RobotIndex(0), VelocityCommand{0.5, 0.1, 0}}, Status::REASON_BAD_VALUE},
      {{RobotIndex(0), WheelCommand{{1, nan}}}, Status::REASON_NOT_FINITE},
      {{RobotIndex(0), WheelCommand{{}}}, Status::REASON_BAD_VALUE},
      {{RobotIndex(0), WheelCommand{{1}}}, Status::REASON_BAD_VALUE},
      {{RobotIndex(0), WheelCommand{{1, 2, 3}}}, Status::REASON_BAD_VALUE},
      {{RobotIndex(0), MoveCommand{7, 0, 1, 0, 0, 0, 0}}, Status::REASON_BAD_KIND},
      {{RobotIndex(0), MoveCommand{7, 6, 1, 0, 0, 0, 0}}, Status::REASON_BAD_KIND},
      {{RobotIndex(0), MoveCommand{7, -3, 1, 0, 0, 0, 0}}, Status::REASON_BAD_KIND},
      {{RobotIndex(0), MoveCommand{7, Move::ADVANCE, nan, 0, 0, 0, 0}}, Status::REASON_NOT_FINITE},
      {{RobotIndex(0), MoveCommand{7, Move::ADVANCE, 1, 0, 0, inf, 0}}, Status::REASON_NOT_FINITE},
      {{RobotIndex(0), MoveCommand{7, Move::ADVANCE, 1, 0, -0.5, 0, 0}}, Status::REASON_BAD_VALUE},
      {{RobotIndex(0), MoveCommand{7, Move::ADVANCE, 1e300, 0, 0, 0, 0}}, Status::REASON_BAD_VALUE},
      {{RobotIndex(0), MoveCommand{7, Move::ADVANCE, 1, 0, 1e-300, 0, 0}},
       Status::REASON_BAD_VALUE},
      {{RobotIndex(0), MoveCommand{7, Move::ARC, 1, 0, 0, 0, 0}}, Status::REASON_BAD_VALUE},
      {{RobotIndex(0), MoveCommand{7, Move::ARC, 1, -2, 0, 0, 0}}, Status::REASON_BAD_VALUE},
      {{RobotIndex(0), MoveCommand{7, Move::ARC, 1e5, 1e5, 0, 0, 0}}, Status::REASON_BAD_VALUE},
      {{RobotIndex(0), JointCommand{{"arm"}, {1}, {0.5}}}, Status::REASON_BAD_VALUE},
      {{RobotIndex(0), JointCommand{{"arm"}, {1}, {}}}, Status::REASON_BAD_VALUE},
  };
  for (const Refused& refused : table) {
    Sim sim(free_robot("<ruedo:watchdog>0</ruedo:watchdog>")),
        calm(free_robot("<ruedo:watchdog>0</ruedo:watchdog>"));
    sim.velocity(0.5, 0.25);
    calm.velocity(0.5, 0.25);
    sim.step(10);
    calm.step(10);
    const int64_t changes = sim.robot().motion.changes;
    sim.robots.apply(refused.command);
    sim.step();
    ASSERT_EQ(sim.state.motion_ends.size(), 1u) << "row " << (&refused - table);
    EXPECT_EQ(sim.state.motion_ends[0].robot, 0);
    EXPECT_EQ(sim.state.motion_ends[0].state.state, Status::STATE_REFUSED);
    EXPECT_EQ(sim.state.motion_ends[0].state.reason, refused.reason)
        << "row " << (&refused - table);
    EXPECT_EQ(sim.robot().motion.changes, changes + 1);
    EXPECT_EQ(sim.robot().motion.state, Status::STATE_RUNNING);
    sim.step();
    calm.step(2);
    EXPECT_TRUE(sim.state.motion_ends.empty());
    EXPECT_EQ(sim.position(), calm.position());
  }
}

TEST(Commands, UnknownRobotsAndThoseWithoutADriveAreNotHarmed) {
  Sim sim(plane_sdf() + robot_sdf("r", "0 0 0 0 0 0") +
          "<model name='mast'><static>true</static><link name='l'><sensor name='s' "
          "type='gpu_lidar'/></link></model>");
  sim.robots.apply({RobotIndex(), VelocityCommand{1, 0, 0}});
  sim.robots.apply({RobotIndex(99), VelocityCommand{1, 0, 0}});
  ASSERT_EQ(sim.layout.robots.size(), 2u);
  sim.velocity(1, 0, RobotIndex(1));
  sim.step();
  ASSERT_EQ(sim.state.motion_ends.size(), 1u);
  EXPECT_EQ(sim.state.motion_ends[0].robot, 1);
  EXPECT_EQ(sim.state.motion_ends[0].state.state, Status::STATE_REFUSED);
  EXPECT_EQ(sim.state.motion_ends[0].state.reason, Status::REASON_NO_DRIVE);
}

TEST(Commands, AReplacedPrimitiveAndItsSuccessorShowAtTheSameStep) {
  Sim sim(free_robot());
  sim.move(Move::ADVANCE, 5.0, 0, 0, 0, 0, RobotIndex(0), 41);
  sim.step();
  EXPECT_EQ(sim.robot().motion.id, 41);
  sim.run(1.0);
  sim.move(Move::ARC, 1.0, 1.0, 0, 0, 0, RobotIndex(0), 42);  // replaced before it began
  sim.move(Move::ROTATE, 1.0, 0, 0, 0, 0, RobotIndex(0), 43);
  const double done = sim.robot().motion.done;
  EXPECT_NEAR(done, 0.25 * 1.005 * 1.005, 1e-12);  // half of 0.5 m/s^2 times the time's square
  sim.step();
  EXPECT_EQ(sim.robot().motion.id, 43);
  EXPECT_EQ(sim.robot().motion.state, Status::STATE_RUNNING);
  EXPECT_EQ(sim.robot().motion.changes, 4);  // 41 began; 41 and 42 ended, 43 began
  ASSERT_EQ(sim.state.motion_ends.size(), 2u);
  for (const int64_t i : {0, 1}) {
    const MotionState& end = sim.state.motion_ends[i].state;
    EXPECT_EQ(end.id, 41 + i);
    EXPECT_EQ(end.state, Status::STATE_ENDED);
    EXPECT_EQ(end.reason, Status::REASON_REPLACED);
    EXPECT_EQ(end.done, i == 0 ? done : 0.0);
  }
}

}  // namespace
}  // namespace ruedo::robot::testing
