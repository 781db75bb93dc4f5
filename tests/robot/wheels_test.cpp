// The wheels drive: distances, turn rates, rest, walls, ramps.
#include <cmath>

#include <gtest/gtest.h>

#include "sim.h"

namespace ruedo::robot::testing {
namespace {

const std::string kNoWatchdog = "<ruedo:watchdog>0</ruedo:watchdog>";

std::string wheeled(const std::string& pose, const std::string& drive = limits(0.7, 1.0, 0.5, 0.5, 1.5)) {
  return robot_sdf("r", pose, kNoWatchdog + drive, "wheels");
}

TEST(Wheels, AdvancesOneMetre) {
  for (const double heading : {0.0, 0.6, 2.5}) {
    Sim sim(plane_sdf() + wheeled("0 0 0 0 0 " + std::to_string(heading)));
    sim.run(1.0);
    const Vec3 start = sim.position();
    sim.move(Move::ADVANCE, 1.0);
    sim.run(6.0);
    EXPECT_NEAR((sim.position() - start).norm(), 1.0, 2e-3);
    EXPECT_NEAR(sim.yaw(), heading, 2e-3);
    EXPECT_EQ(sim.robot().motion.state, Status::STATE_DONE);
  }
}

// Steps until the primitive is done; s that it took, 0 when it was not.
double run_until_done(Sim& sim) {
  for (int i = 1; i < 4000; ++i) {
    sim.step();
    if (sim.robot().motion.state == Status::STATE_DONE) return 0.005 * i;
  }
  return 0.0;
}

// What a client sees that takes the primitive's end for its end: the robot is there, and stands.
TEST(Wheels, IsAtItsGoalAndAtRestWhenItSaysDone) {
  struct Case { double acceleration, deceleration, seconds; };    // of the plan: sqrt(2 s (1/a + 1/d))
  for (const Case& c : {Case{4.2, 0.27, 2.808}, Case{0.27, 4.2, 2.808}, Case{0.3, 0.6, 3.162}}) {
    Sim sim(plane_sdf() + wheeled("0 0 0 0 0 0", limits(2.0, 2.0, 5.0, 5.0, 1.74)));
    sim.run(1.0);
    const Vec3 start = sim.position();
    sim.move(Move::ADVANCE, 1.0, 0, 2.0, c.acceleration, c.deceleration);
    const double took = run_until_done(sim);
    EXPECT_GE(took, c.seconds);
    EXPECT_LE(took, c.seconds + 0.6);
    EXPECT_NEAR((sim.position() - start).norm(), 1.0, 2e-3) << c.acceleration;
    EXPECT_LT(sim.robot().twist.linear.norm(), 5e-3);
    EXPECT_NEAR(sim.robot().motion.remaining, 0.0, 5e-4);
    EXPECT_NEAR(sim.robot().motion.done + sim.robot().motion.remaining, 1.0, 1e-12);
    sim.run(1.0);    // nor does it move on afterwards
    EXPECT_NEAR((sim.position() - start).norm(), 1.0, 2e-3) << c.acceleration;

    const double before = sim.yaw();
    sim.move(Move::ROTATE, M_PI / 2);
    EXPECT_GT(run_until_done(sim), 0.0);
    EXPECT_NEAR(wrap_angle(sim.yaw() - before), M_PI / 2, 2e-3);
    sim.run(1.0);
    EXPECT_NEAR(wrap_angle(sim.yaw() - before), M_PI / 2, 2e-3);
  }
}

TEST(Wheels, TurnsAtTheCommandedRateWhateverItsHeading) {
  for (const double heading : {0.0, 0.8, 2.0}) {
    Sim sim(plane_sdf() + wheeled("0 0 0 0 0 " + std::to_string(heading)));
    sim.velocity(0.0, 0.5);
    sim.run(2.0);
    const double before = sim.yaw();
    sim.run(4.0);
    EXPECT_NEAR(wrap_angle(sim.yaw() - before), 2.0, 0.04);
    // Skid steering slips: the wheels turn faster than the robot.
    EXPECT_GT(sim.robot().wheel_omega, 0.503);
    EXPECT_LT(sim.robot().wheel_omega, 0.6);
  }
}

TEST(Wheels, FourWheelsShareTheWeight) {
  Sim sim(plane_sdf() + wheeled("0 0 0 0 0 0"));
  sim.velocity(0.0, 0.5);
  sim.run(2.0);
  ASSERT_EQ(sim.state.contacts.size(), 4u);
  for (const Contact& contact : sim.state.contacts) EXPECT_NEAR(contact.force, 20.0 * 9.8 / 4.0, 2.0);
}

TEST(Wheels, DrivesACircle) {
  Sim sim(plane_sdf() + wheeled("0 0 0 0 0 0"));
  sim.velocity(0.4, 0.4);
  sim.run(3.0);
  const double before = sim.yaw();
  sim.run(5.0);
  EXPECT_NEAR(wrap_angle(sim.yaw() - before), 2.0, 0.04);
  EXPECT_NEAR(sim.robot().twist.linear.x(), 0.4, 0.02);
}

TEST(Wheels, RestsWithoutDrift) {
  for (const bool ramp : {false, true}) {
    Sim sim(plane_sdf() + wheeled(ramp ? "2.4 0 0.5 0 -0.2618 0" : "0 0 0.005 0 0 0") +
            (ramp ? box_sdf("ramp", "2.435 0 0.2872 0 -0.2618 0", "3 3 0.2", 0.0, 1.0) : ""));
    sim.run(4.0);
    const Vec3 rest = sim.position();
    EXPECT_GT(rest.z(), ramp ? 0.2 : -0.01);
    sim.run(600.0);
    EXPECT_LT((sim.position() - rest).norm(), 1e-6);
    sim.velocity(0.3, 0.0);    // and it wakes
    sim.run(2.0);
    EXPECT_GT((sim.position() - rest).norm(), 0.3);
  }
}

TEST(Wheels, AWallStopsIt) {
  Sim sim(plane_sdf() + wheeled("0 0 0 0 0 0", limits(0.7, 1.0, 0.5, 0.5, 1.5) + "<ruedo:max_wheel_torque>5</ruedo:max_wheel_torque>") +
          box_sdf("wall", "1.1 0 0.5 0 0 0", "0.2 4 1"));
  sim.velocity(0.7, 0.0);
  sim.run(4.0);
  EXPECT_LT(sim.position().x() + 0.25, 1.01);
  EXPECT_GT(sim.position().x() + 0.25, 0.97);
}

TEST(Wheels, AnotherRobotPushesIt) {
  Sim sim(plane_sdf() + wheeled("0.8 0 0 0 0 0") + robot_sdf("k", "0 0 0 0 0 0", kNoWatchdog));
  sim.run(1.0);
  sim.velocity(0.5, 0.0, 1);
  sim.run(3.0);
  EXPECT_GT(sim.position(0).x(), 0.9);
}

}  // namespace
}  // namespace ruedo::robot::testing
