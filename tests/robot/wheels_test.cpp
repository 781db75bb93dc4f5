// The wheels drive: servos that follow wheel rates, odometry that trusts them, and physics that
// decides the result.
#include <cmath>

#include <gtest/gtest.h>

#include "sim.h"

namespace ruedo::robot::testing {
namespace {

const std::string kNoWatchdog = "<ruedo:watchdog>0</ruedo:watchdog>";

std::string wheeled(const std::string& pose,
                    const std::string& drive = limits(0.7, 1.0, 0.5, 0.5, 1.5)) {
  return robot_sdf("r", pose, kNoWatchdog + drive, "wheels");
}

double rate_of(Sim& sim, double settle_s, double measure_s) {
  sim.run(settle_s);
  double turned = 0.0, last = sim.yaw();
  for (int i = 0; i < static_cast<int>(measure_s * 100); ++i) {
    sim.run(0.01);
    turned += wrap_angle(sim.yaw() - last);
    last = sim.yaw();
  }
  return turned / measure_s;
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

// Steps until the primitive is done; returns the time in s, 0 if it was not done.
double run_until_done(Sim& sim) {
  for (int i = 1; i < 4000; ++i) {
    sim.step();
    if (sim.robot().motion.state == Status::STATE_DONE) return 0.005 * i;
  }
  return 0.0;
}

// When the primitive reports its end, the robot has arrived, and stands.
TEST(Wheels, APrimitiveEndsAtItsGoalAndAtRest) {
  struct Case {
    double acceleration, deceleration, seconds;
  };  // of the plan: sqrt(2 s (1/a + 1/d))
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
    sim.run(1.0);  // nor does it move on afterwards
    EXPECT_NEAR((sim.position() - start).norm(), 1.0, 2e-3) << c.acceleration;
  }
}

// Four wheels at (+-a, +-b) with the same friction in all directions: in a turn on the spot the
// moment of the slipping wheels vanishes at omega = omega_wheels b^2 / (a^2 + b^2), which depends
// neither on friction nor on load or heading.
TEST(Wheels, SkidSteeringTurnsAsCoulombHasIt) {
  const double a = 0.13, b = 0.2;
  for (const double heading : {0.0, 0.4, 2.0}) {
    Sim sim(plane_sdf() + wheeled("0 0 0 0 0 " + std::to_string(heading)));
    sim.velocity(0.0, 0.5);
    EXPECT_NEAR(rate_of(sim, 2.0, 4.0), 0.5 * b * b / (a * a + b * b), 0.007) << heading;
    EXPECT_NEAR(sim.robot().wheel_omega, 0.5, 1e-3);  // as commanded: the servos see to that
    EXPECT_LT(sim.position().head<2>().norm(), 0.02);
  }
}

// The wheels turn at the commanded rates.
TEST(Wheels, WheelCommandsAreWheelRates) {
  Sim sim(plane_sdf() + wheeled("0 0 0 0 0 0", limits(5, 50, 50, 50, 50)));
  sim.robots.apply({RobotIndex(0), WheelCommand{{2.0, 3.0}}});
  sim.run(2.0);
  EXPECT_NEAR(sim.state.wheel_rates[0], 2.0, 5e-3);
  EXPECT_NEAR(sim.state.wheel_rates[3], 3.0, 5e-3);
}

// 2 N m at the wheels are 80 N on the 20 kg and the four wheels' 0.005 kg m^2: a = 4 T / r / (m + 4
// I / r^2).
TEST(Wheels, TheTorqueLimitLimitsTheAcceleration) {
  Sim sim(plane_sdf() +
          wheeled("0 0 0 0 0 0", limits(50, 50, 1e3, 1e3, 1e3) +
                                     "<ruedo:max_wheel_torque>2</ruedo:max_wheel_torque>"));
  sim.run(0.5);
  sim.velocity(5.0, 0.0);
  sim.run(0.5);
  EXPECT_NEAR(sim.robot().twist.linear.x(), 0.5 * 80.0 / (20.0 + 4 * 0.005 / 0.01), 0.03);
}

// A motor of 0.2 N m and 400 rad/s behind a gear of 20: 4 N m at stall, 20 rad/s without a load.
// The robot approaches that as v = v0 (1 - exp(-t / tau)), tau = M v0 / F, and no further.
TEST(Wheels, TheMotorsLineEndsAtItsNoLoadRate) {
  Sim sim(plane_sdf() +
          wheeled("0 0 0 0 0 0",
                  limits(50, 50, 1e3, 1e3, 1e3) +
                      "<ruedo:gear>20</ruedo:gear><ruedo:stall_torque>0.2</"
                      "ruedo:stall_torque><ruedo:no_load_rate>400</ruedo:no_load_rate>"));
  sim.run(0.5);
  sim.velocity(10.0, 0.0);
  const double tau = 22.0 * 2.0 / 160.0;  // 22 kg with the wheels' turning, 2 m/s, 160 N at stall
  sim.run(tau);
  EXPECT_NEAR(sim.robot().twist.linear.x(), 2.0 * (1 - std::exp(-1.0)), 0.05);
  sim.run(10 * tau);
  EXPECT_NEAR(sim.robot().twist.linear.x(), 2.0, 0.01);
}

TEST(Wheels, FourWheelsShareTheWeight) {
  Sim sim(plane_sdf() + wheeled("0 0 0 0 0 0"));
  sim.velocity(0.0, 0.5);
  sim.run(2.0);
  ASSERT_EQ(sim.state.contacts.size(), 4u);
  for (const Contact& contact : sim.state.contacts)
    EXPECT_NEAR(contact.force, 20.0 * 9.8 / 4.0, 2.0);
}

// A control loop over the gyro compensates for skidding; a wrong gyro is trusted.
TEST(Wheels, AYawLoopTurnsAtTheGyrosRate) {
  for (const double error : {0.0, 0.05}) {
    Sim sim(plane_sdf() + wheeled("0 0 0 0 0 0.3",
                                  limits(0.7, 1.0, 0.5, 0.5, 1.5) +
                                      "<ruedo:yaw_gain>8</ruedo:yaw_gain><ruedo:gyro_scale_error>" +
                                      std::to_string(error) + "</ruedo:gyro_scale_error>"));
    sim.velocity(0.0, 0.5);
    EXPECT_NEAR(rate_of(sim, 2.0, 4.0), 0.5 / (1.0 + error), 0.005);
    EXPECT_GT(sim.robot().wheel_omega, 0.6);
  }
}

// Primitives end by the odometry: a rotation by 90 degrees that skids ends too early, and one with
// a track that is calibrated for skidding is right.
TEST(Wheels, PrimitivesBelieveTheOdometry) {
  const double skid = (0.13 * 0.13 + 0.2 * 0.2) / (0.2 * 0.2);
  for (const bool calibrated : {false, true}) {
    std::string robot = wheeled("0 0 0 0 0 0");
    if (calibrated)
      robot.insert(robot.find("</model>"), "<ruedo:odometry><ruedo:track_error>" +
                                               std::to_string(skid - 1.0) +
                                               "</ruedo:track_error></ruedo:odometry>");
    Sim sim(plane_sdf() + robot);
    sim.run(1.0);
    sim.move(Move::ROTATE, M_PI / 2);
    EXPECT_GT(run_until_done(sim), 0.0);
    EXPECT_NEAR(sim.yaw(), calibrated ? M_PI / 2 : M_PI / 2 / skid, 0.04);
    EXPECT_NEAR(sim.robot().motion.done, M_PI / 2,
                0.01);  // what stands on tyres sticks a little before
  }
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
    sim.velocity(0.3, 0.0);  // and it wakes
    sim.run(2.0);
    EXPECT_GT((sim.position() - rest).norm(), 0.3);
  }
}

// Contacts would throw it into the air from a depth of centimetres.
TEST(Wheels, LeavesTheGroundInWhichItStarts) {
  for (const double height : {-0.09, -0.03, -0.01, 0.0}) {
    Sim sim(plane_sdf() + wheeled("0 0 " + std::to_string(height) + " 0 0 0.3"));
    double highest = 0.0;
    for (int i = 0; i < 400; ++i) {
      sim.step();
      highest = std::max(highest, sim.position().z());
    }
    EXPECT_LT(highest, 1e-3) << height;
    EXPECT_NEAR(sim.position().z(), 0.0, 1e-3) << height;
    EXPECT_LT(sim.position().head<2>().norm(), 1e-3) << height;
  }
}

TEST(Wheels, AWallStopsIt) {
  Sim sim(plane_sdf() +
          wheeled("0 0 0 0 0 0", limits(0.7, 1.0, 0.5, 0.5, 1.5) +
                                     "<ruedo:max_wheel_torque>5</ruedo:max_wheel_torque>") +
          box_sdf("wall", "1.1 0 0.5 0 0 0", "0.2 4 1"));
  sim.velocity(0.7, 0.0);
  sim.run(4.0);
  EXPECT_LT(sim.position().x() + 0.25, 1.01);
  EXPECT_GT(sim.position().x() + 0.25, 0.97);
}

TEST(Wheels, AnotherRobotPushesIt) {
  // Its motors yield before its tyres slip, which the other one's grip would just not make them.
  Sim sim(plane_sdf() +
          wheeled("0.8 0 0 0 0 0", limits(0.7, 1.0, 0.5, 0.5, 1.5) +
                                       "<ruedo:max_wheel_torque>2</ruedo:max_wheel_torque>") +
          robot_sdf("k", "0 0 0 0 0 0", kNoWatchdog));
  sim.run(1.0);
  sim.velocity(0.5, 0.0, RobotIndex(1));
  sim.run(3.0);
  EXPECT_GT(sim.position(0).x(), 0.9);
}

// Across a slope of 25 degrees a robot stands with a friction of 1, and slides with 0.3: tan(25
// degrees) is 0.466.
TEST(Wheels, StandsAcrossASlopeWithTheFrictionOfItsFile) {
  for (const double mu : {1.0, 0.3}) {
    const double slope = 25.0 * M_PI / 180.0;
    Sim sim(box_sdf("slope", "0 0 0 " + std::to_string(-slope) + " 0 0", "20 20 0.2", 0.0, mu) +
            wheeled("0 " + std::to_string(0.11 * std::sin(slope)) + " " +
                    std::to_string(0.11 * std::cos(slope)) + " " + std::to_string(-slope) +
                    " 0 0"));
    sim.run(1.0);
    const Vec3 start = sim.position();
    sim.run(2.0);
    const double way = (sim.position() - start).norm();
    if (mu == 1.0) {
      EXPECT_LT(way, 2e-3);
    } else {  // a = g (sin - mu cos), 1.477 m/s^2, from 1 s to 3 s: 8 / 2 of it
      EXPECT_NEAR(way, 0.5 * 9.8 * (std::sin(slope) - mu * std::cos(slope)) * 8.0, 0.6);
    }
  }
}

// The file limits neither force nor torque, so that friction does: nose up, where the rear wheels
// bear nearly all, it holds to a slope of atan(mu), and above it slides with g (sin - mu cos).
TEST(Wheels, HoldsOnASlopeAsFarAsFrictionDoes) {
  const double mu = 0.8;
  for (const double more : {-0.01, 0.03}) {
    for (const bool up : {true, false}) {
      const double slope = std::atan(mu) + more;
      Sim sim(box_sdf("slope", "0 0 0 0 " + std::to_string(-slope) + " 0", "40 40 0.2", 0.0, mu) +
              wheeled(std::to_string(-0.1 * std::sin(slope)) + " 0 " +
                      std::to_string(0.1 * std::cos(slope)) +
                      (up ? " 0 " + std::to_string(-slope) + " 0"
                          : " 0 " + std::to_string(slope) + " " + std::to_string(M_PI))));
      sim.velocity(0.0, 0.0);
      sim.run(1.0);
      const Vec3 start = sim.position();
      const double v = sim.robot().twist.linear.norm();
      sim.run(2.0);
      const double way = (sim.position() - start).norm();
      if (more < 0.0) {
        EXPECT_LT(way, 2e-3) << up;
      } else {
        const double a = 9.8 * (std::sin(slope) - mu * std::cos(slope));
        EXPECT_NEAR(way, 2.0 * v + 0.5 * a * 4.0, 0.03 * way) << up;
      }
    }
  }
}

TEST(Wheels, BrakesAsHardAsFrictionAllows) {
  const double mu = 0.8, v = 2.0;
  Sim sim(box_sdf("floor", "0 0 -0.1 0 0 0", "60 20 0.2", 0.0, mu) +
          wheeled("0 0 0 0 0 0", limits(50, 50, 5, 1e3, 1e3)));
  sim.velocity(v, 0.0);
  sim.run(2.0);
  ASSERT_NEAR(sim.robot().twist.linear.x(), v, 1e-3);
  const Vec3 start = sim.position();
  sim.velocity(0.0, 0.0);
  sim.run(1.0);
  EXPECT_NEAR((sim.position() - start).norm(), v * v / (2 * mu * 9.8), 0.01);
}

// A limit that the file gives, for the drive as a whole: each of the four wheels has a quarter.
TEST(Wheels, TheForceOfItsFileLimitsTheAcceleration) {
  Sim sim(plane_sdf() + wheeled("0 0 0 0 0 0", limits(50, 50, 1e3, 1e3, 1e3) +
                                                   "<ruedo:max_force>80</ruedo:max_force>"));
  sim.run(0.5);
  sim.velocity(5.0, 0.0);
  sim.run(0.5);
  EXPECT_NEAR(sim.robot().twist.linear.x(), 0.5 * 80.0 / (20.0 + 4 * 0.005 / 0.01), 0.03);
}

// Two wheels, and a caster ahead and behind: rigid casters may carry all of the load, since rigid
// bodies do not determine how it is shared. Sprung ones leave it to the wheels.
TEST(Wheels, SprungCastersLeaveTheLoadToTheWheels) {
  const auto wheel = [](const std::string& name, const std::string& y) {
    return "<link name='" + name + "'><pose>0 " + y +
           " 0.1 -1.5707963267948966 0 0</pose><inertial><mass>1</mass><inertia><ixx>0.003</ixx>"
           "<iyy>0.003</iyy><izz>0.005</izz></inertia></inertial><collision name='c'><geometry>"
           "<cylinder><radius>0.1</radius><length>0.04</length></cylinder></geometry></collision>"
           "</link><joint name='" +
           name + "_joint' type='continuous'><parent>base</parent><child>" + name +
           "</child><axis><xyz>0 0 1</xyz></axis></joint>";
  };
  const auto caster = [](const std::string& name, const std::string& x) {
    return "<collision name='" + name + "'><pose>" + x +
           " 0 -0.15 0 0 0</pose><geometry><sphere><radius>0.05</radius></sphere></geometry>"
           "<surface><friction><ode><mu>0</mu><mu2>0</mu2></ode></friction><contact><ode>"
           "<kp>1e5</kp><kd>1e3</kd></ode></contact></surface></collision>";
  };
  Sim sim(plane_sdf() +
          "<model name='r'><link name='base'><pose>0 0 0.2 0 0 0</pose><inertial><mass>20</mass>"
          "<inertia><ixx>0.5</ixx><iyy>1</iyy><izz>1.5</izz></inertia></inertial>" +
          caster("front", "0.3") + caster("rear", "-0.3") + "</link>" + wheel("l", "0.3") +
          wheel("r", "-0.3") +
          "<ruedo:drive type='wheels'><ruedo:left_joint>l_joint</ruedo:left_joint>"
          "<ruedo:right_joint>r_joint</ruedo:right_joint><ruedo:acceleration>1</"
          "ruedo:acceleration><ruedo:watchdog>0</ruedo:watchdog></ruedo:drive></model>");
  sim.velocity(0.5, 0.0);
  sim.run(5.0);  // 0.125 m while it gains speed, then 4.5 s
  EXPECT_NEAR(sim.position().x(), 2.375, 0.02);
}

}  // namespace
}  // namespace ruedo::robot::testing
