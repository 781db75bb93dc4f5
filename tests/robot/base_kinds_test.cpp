// Drives other than differential ones, on a free plane: the closed forms of their motion, their
// limits, their wheels.
#include <cmath>

#include <gtest/gtest.h>

#include "robot/base_motion.h"
#include "sim.h"

namespace ruedo::robot::testing {
namespace {

// Of the robots that come with Ruedo.
std::string shipped(const std::string& name) {
  return plane_sdf() + "<include><uri>" RUEDO_SOURCE_DIR "/worlds/robots/" + name +
         "/model.sdf</uri><name>r</name></include>";
}

class Bases : public Sim {
 public:
  explicit Bases(const std::string& models, int64_t step_us = 5000) : Sim(models, step_us) {}
  void twist(double vx, double vy, double omega) {
    robots.apply({RobotIndex(0), VelocityCommand{vx, vy, omega}});
  }
  double yaw() const { return heading(robot().X_WBase.rotation); }
  double angle(const std::string& joint) const {
    for (size_t i = 0; i < layout.wheels.size(); ++i) {
      if (world->models.back().model->joints[layout.wheels[i].joint].name == joint)
        return state.wheel_angles[i];
    }
    return NAN;
  }
  void hold(double vx, double vy, double omega, double seconds) {
    for (double t = 0; t < seconds - 1e-9; t += 0.25) {
      twist(vx, vy, omega);
      run(std::min(0.25, seconds - t));
    }
  }
};

// A holonomic base keeps its velocity in its own turning frame: a circle. x + iy = (v / (i omega))
// (exp(i omega t) - 1).
TEST(BaseMotion, ConstantTwistIsACircle) {
  const double vx = 0.4, vy = -0.3, omega = 0.7, t = 3.0;
  const Displacement way = along_twist(vx * t, vy * t, omega * t);
  EXPECT_NEAR(way.x, (vx * std::sin(omega * t) + vy * (std::cos(omega * t) - 1)) / omega, 1e-15);
  EXPECT_NEAR(way.y, (vy * std::sin(omega * t) - vx * (std::cos(omega * t) - 1)) / omega, 1e-15);
}

// However the time is divided, the path is the same.
TEST(BaseMotion, QuadraturesDoNotDependOnTheStep) {
  const Limits limits{2.0, 0.7, 0.7};
  const Profile v = Profile::to_velocity(0.2, 1.0, limits),
                side = Profile::to_velocity(-0.1, 0.5, limits),
                omega = Profile::to_velocity(0.0, 1.2, {2.0, 0.9, 0.9});
  const SteeringPlan steering = SteeringPlan::between(-0.3, 0.5, 0.8);
  const Displacement whole = integrate(v, side, omega, 0, 2),
                     steered = integrate_steered(v, steering, 0.5, 0, 2);
  Displacement parts, steered_parts;
  for (int i = 0; i < 400; ++i) {
    parts = chained(parts, integrate(v, side, omega, i * 0.005, (i + 1) * 0.005));
    steered_parts =
        chained(steered_parts, integrate_steered(v, steering, 0.5, i * 0.005, (i + 1) * 0.005));
  }
  EXPECT_NEAR(whole.x, parts.x, 1e-12);
  EXPECT_NEAR(whole.y, parts.y, 1e-12);
  EXPECT_NEAR(steered.x, steered_parts.x, 1e-12);
  EXPECT_NEAR(steered.y, steered_parts.y, 1e-12);
  EXPECT_NEAR(steered.angle, steered_parts.angle, 1e-12);
  // While the steering turns at a constant speed, theta = -(v / (r L)) ln(cos(delta) /
  // cos(delta_0)).
  const Displacement even =
      integrate_steered(Profile::to_velocity(0.8, 0.8, limits), steering, 0.5, 0, 1);
  EXPECT_NEAR(even.angle, -0.8 / (0.8 * 0.5) * std::log(std::cos(0.5) / std::cos(-0.3)), 1e-13);
}

TEST(Mecanum, MovesSidewaysAndItsWheelsRoll) {
  Bases sim(shipped("mecanum"));
  sim.hold(0.0, 0.4, 0.0, 2.0);  // to 0.4 m/s at 1 m/s^2: 0.08 m less than 0.8 m
  EXPECT_NEAR(sim.position().x(), 0.0, 1e-12);
  EXPECT_NEAR(sim.position().y(), 0.72, 1e-9);
  EXPECT_NEAR(sim.robot().twist.linear.y(), 0.4, 1e-12);
  const double turned = 0.72 / 0.08;
  EXPECT_NEAR(sim.angle("front_left_joint"), -turned, 1e-9);
  EXPECT_NEAR(sim.angle("front_right_joint"), turned, 1e-9);
  EXPECT_NEAR(sim.angle("rear_left_joint"), turned, 1e-9);
  EXPECT_NEAR(sim.angle("rear_right_joint"), -turned, 1e-9);
}

// Rates that a twist asks for bring that twist about: v = r/4 sum, and so on.
TEST(Mecanum, TakesRatesOfItsWheels) {
  Bases sim(shipped("mecanum"));
  const double vx = 0.2, vy = -0.1, omega = 0.5, r = 0.08, arm = 0.35;
  sim.robots.apply(
      {RobotIndex(0), WheelCommand{{(vx - vy - arm * omega) / r, (vx + vy - arm * omega) / r,
                                    (vx + vy + arm * omega) / r, (vx - vy + arm * omega) / r}}});
  sim.run(0.5);
  EXPECT_NEAR(sim.robot().twist.linear.x(), vx, 1e-12);
  EXPECT_NEAR(sim.robot().twist.linear.y(), vy, 1e-12);
  EXPECT_NEAR(sim.robot().twist.angular.z(), omega, 1e-12);
}

TEST(Omni, MovesInEveryDirection) {
  Bases sim(shipped("omni"));
  sim.hold(0.3, 0.3, 0.0, 2.0);  // each reaches 0.3 m/s in 0.3 s
  EXPECT_NEAR(sim.position().x(), 0.555, 1e-9);
  EXPECT_NEAR(sim.position().y(), 0.555, 1e-9);
  // The wheel at the front, whose axle points ahead or back, rolls by the way to the side alone.
  EXPECT_NEAR(std::abs(sim.angle("wheel_1_joint")), 0.555 / 0.05, 1e-6);
}

TEST(Holonomic, TurnsAndMovesAtOnce) {
  Bases sim(shipped("puck"));
  sim.hold(0.0, 0.0, 0.5, 2.0);  // to 0.5 rad/s at 5 rad/s^2: 0.025 rad less
  EXPECT_NEAR(sim.yaw(), 0.975, 1e-9);
  EXPECT_LT(sim.position().head<2>().norm(), 1e-12);
}

TEST(Tracked, TurnsByTheDifferenceOfItsTracks) {
  Bases sim(shipped("crawler"));
  sim.hold(0.0, 0.0, 0.5, 2.0);  // at 4 rad/s^2: 0.03125 rad less
  EXPECT_NEAR(sim.yaw(), 0.96875, 1e-9);
  EXPECT_NEAR(sim.angle("front_left_joint"), -0.96875 * 0.17 / 0.08, 1e-9);
  sim.twist(0.0, 0.1, 0.0);
  sim.step();
  EXPECT_EQ(sim.robot().motion.state,
            Status::STATE_RUNNING);  // the command before it holds; to the side it cannot
}

// The bicycle model: once the wheels are steered, the rear axle's middle goes round a circle of v /
// omega.
TEST(Car, GoesRoundACircle) {
  Bases sim(shipped("car"));
  sim.hold(0.5, 0.0, 0.5, 2.0);
  const Pose begin = sim.robot().X_WBase;
  const double yaw = sim.yaw();
  EXPECT_NEAR(sim.robot().twist.angular.z(), 0.5, 1e-12);
  sim.hold(0.5, 0.0, 0.5, 2.0);
  EXPECT_NEAR(wrap_angle(sim.yaw() - yaw), 1.0, 1e-9);
  const Vec3 moved = begin.inverse() * sim.robot().X_WBase.translation;  // radius 1 m
  EXPECT_NEAR(moved.x(), std::sin(1.0), 1e-9);
  EXPECT_NEAR(moved.y(), 1 - std::cos(1.0), 1e-9);
  // Ackermann: every axle points to the circle's middle, 1 m to the left of the rear axle.
  // Wheelbase 0.5 m, track 0.36 m.
  EXPECT_NEAR(sim.angle("left_knuckle_joint"), std::atan2(0.5, 1 - 0.18), 1e-12);
  EXPECT_NEAR(sim.angle("right_knuckle_joint"), std::atan2(0.5, 1 + 0.18), 1e-12);
}

TEST(Car, ItsSteeringAndItsCircleAreLimited) {
  Bases sim(shipped("car"));
  sim.hold(0.5, 0.0, 2.5, 3.0);  // 0.2 m would be the radius; 0.5 / tan(0.56) it is
  EXPECT_NEAR(sim.robot().twist.angular.z(), 0.5 * std::tan(0.56) / 0.5, 1e-12);
  sim.hold(0.0, 0.0, 1.0, 2.0);  // it cannot turn on the spot
  EXPECT_EQ(sim.robot().twist.angular.z(), 0.0);
  Bases still(shipped("car"));
  still.hold(0.0, 0.0, 1.0, 1.0);
  EXPECT_EQ(still.yaw(), 0.0);
  EXPECT_GT(still.angle("left_knuckle_joint"), 0.5);
}

// At 2 rad/s the steering is at 0.2 rad after 0.1 s.
TEST(Car, ItsSteeringTakesItsTime) {
  Bases sim(shipped("car"));
  sim.twist(0.0, 0.0, 1.0);
  sim.run(0.1);
  const double curvature = std::tan(0.2) / 0.5;
  EXPECT_NEAR(sim.angle("left_knuckle_joint"), std::atan2(curvature * 0.5, 1 - curvature * 0.18),
              1e-9);
}

TEST(Car, PrimitivesThatItCannotDoAreRefused) {
  constexpr int8_t kNotPossible = motion_status_t::REASON_NOT_POSSIBLE;
  for (const auto& [kind, value, radius] :
       {std::tuple(Move::ROTATE, 1.0, 0.0), std::tuple(Move::HEADING, 1.0, 0.0),
        std::tuple(Move::ARC, 1.0, 0.4)}) {
    Bases sim(shipped("car"));
    sim.move(kind, value, radius);
    sim.step();
    ASSERT_FALSE(sim.state.motion_ends.empty());
    EXPECT_EQ(sim.state.motion_ends[0].state.state, Status::STATE_REFUSED);
    EXPECT_EQ(sim.state.motion_ends[0].state.reason, kNotPossible);
  }
}

TEST(Car, DrivesAnArcAndALine) {
  Bases sim(shipped("car"));
  sim.move(Move::ARC, M_PI / 2, 1.5, 0.5);
  sim.run(8.0);
  EXPECT_EQ(sim.robot().motion.state, Status::STATE_DONE);
  EXPECT_NEAR(sim.position().x(), 1.5, 1e-9);
  EXPECT_NEAR(sim.position().y(), 1.5, 1e-9);
  EXPECT_NEAR(sim.yaw(), M_PI / 2, 1e-9);
}

TEST(Tricycle, StandsOnTheMiddleOfItsRearAxle) {
  Bases sim(shipped("tricycle"));
  sim.hold(0.3, 0.0, 0.3, 4.0);
  const double yaw = sim.yaw();
  const double rolled = sim.angle("front_joint");
  sim.hold(0.3, 0.0, 0.3, 1.0);
  EXPECT_NEAR(wrap_angle(sim.yaw() - yaw), 0.3, 1e-9);
  EXPECT_NEAR(sim.angle("fork_joint"), std::atan(0.55), 1e-12);  // curvature 1 / m
  EXPECT_NEAR(sim.angle("front_joint") - rolled, 0.3 * std::hypot(1.0, 0.55) / 0.1, 1e-9);
}

}  // namespace
}  // namespace ruedo::robot::testing
