// Velocity profiles against hand-computed plans, and the unicycle's integrals against known curves.
#include "robot/profile.h"

#include <cmath>

#include <gtest/gtest.h>

#include "robot/base_motion.h"
#include "robot/unicycle.h"

namespace ruedo::robot {
namespace {

TEST(Profile, ReachesAVelocityThroughRest) {
  // From -1 m/s at 2 m/s^2 to rest in 0.5 s and 0.25 m, then at 1 m/s^2 to 0.5 m/s in 0.5 s and
  // 0.125 m.
  const Profile p = Profile::to_velocity(-1.0, 0.5, {10.0, 1.0, 2.0});
  EXPECT_DOUBLE_EQ(p.end(), 1.0);
  EXPECT_DOUBLE_EQ(p.velocity(0.25), -0.5);
  EXPECT_DOUBLE_EQ(p.position(0.5), -0.25);
  EXPECT_DOUBLE_EQ(p.velocity(0.75), 0.25);
  EXPECT_DOUBLE_EQ(p.position(1.0), -0.125);
  EXPECT_DOUBLE_EQ(p.position(3.0), 0.875);
}

TEST(Profile, UnlimitedAccelerationJumps) {
  const Profile p = Profile::to_velocity(0.0, 0.5, {});
  EXPECT_EQ(p.end(), 0.0);
  EXPECT_EQ(p.velocity(0.0), 0.5);
  EXPECT_EQ(p.position(2.0), 1.0);
}

TEST(Profile, Triangle) {
  // a = 1, d = 0.5 over 1.5 m: peak^2 (1/2 + 1) = 1.5, so 1 m/s after 1 s and 0.5 m; at rest after
  // 3 s.
  const Profile p = Profile::to_distance(0.0, 1.5, {5.0, 1.0, 0.5});
  EXPECT_DOUBLE_EQ(p.end(), 3.0);
  EXPECT_DOUBLE_EQ(p.velocity(1.0), 1.0);
  EXPECT_DOUBLE_EQ(p.position(1.0), 0.5);
  EXPECT_EQ(p.position(3.0), 1.5);
  EXPECT_EQ(p.velocity(3.0), 0.0);
}

TEST(Profile, Trapezoid) {
  // 0.5 m/s at 1 m/s^2 both ways over -1 m: 0.5 s and 0.125 m each, 0.75 m of cruise in 1.5 s.
  const Profile p = Profile::to_distance(0.0, -1.0, {0.5, 1.0, 1.0});
  EXPECT_DOUBLE_EQ(p.end(), 2.5);
  EXPECT_DOUBLE_EQ(p.velocity(1.0), -0.5);
  EXPECT_DOUBLE_EQ(p.position(2.0), -0.875);
  EXPECT_EQ(p.position(2.5), -1.0);
}

struct Start {
  double velocity, distance;
};
void PrintTo(const Start& start, std::ostream* out) {
  *out << start.velocity << " m/s, " << start.distance << " m to go";
}
class FromAnyVelocity : public ::testing::TestWithParam<Start> {};

TEST_P(FromAnyVelocity, EndsAtRestThereWithinTheLimits) {
  const Limits limits{0.6, 0.3, 0.7};
  const Profile p = Profile::to_distance(GetParam().velocity, GetParam().distance, limits);
  EXPECT_EQ(p.velocity(p.end() + 1.0), 0.0);
  EXPECT_EQ(p.final_position(), GetParam().distance);
  EXPECT_NEAR(p.position(p.end() - 1e-9), GetParam().distance, 1e-9);  // no jump at the end
  double last_v = GetParam().velocity, last_x = 0.0;
  const double dt = 1e-3;
  for (double t = 0.0; t < p.end() + 0.1; t += dt) {
    const double v = p.velocity(t), x = p.position(t);
    const bool may_brake = std::abs(v) <= std::abs(last_v) ||
                           v * last_v < 0.0;  // a sample may lie on either side of rest
    const double rate = may_brake ? limits.deceleration : limits.acceleration;
    EXPECT_LE(std::abs(v - last_v), rate * dt + 1e-12);
    EXPECT_NEAR(x - last_x, t > 0 ? 0.5 * (v + last_v) * dt : 0.0,
                1e-6);  // v is the derivative of x
    EXPECT_LE(std::abs(v), std::max(0.6, std::abs(GetParam().velocity)) + 1e-12);
    last_v = v;
    last_x = x;
  }
}

INSTANTIATE_TEST_SUITE_P(Starts, FromAnyVelocity,
                         ::testing::Values(Start{0, 1}, Start{0, -1}, Start{0.5, 2},
                                           Start{0.5, 0.1}, Start{0.5, -1}, Start{-0.5, 1},
                                           Start{1.0, 3}, Start{1.0, 0.75}, Start{-1.2, -0.2},
                                           Start{0.3, 0}, Start{0, 1e-9}, Start{0, 0},
                                           Start{0.6, 0.6 * 0.6 / 1.4}));

TEST(Unicycle, QuarterCircle) {
  const Displacement d = along_arc(M_PI / 2, M_PI / 2);
  EXPECT_NEAR(d.x, 1.0, 1e-15);
  EXPECT_NEAR(d.y, 1.0, 1e-15);
}

TEST(Unicycle, TinyAnglesAreWellConditioned) {
  const Displacement d = along_arc(1.0, 1e-12);
  EXPECT_EQ(d.x, 1.0);
  EXPECT_NEAR(d.y, 0.5e-12, 1e-27);
}

TEST(Unicycle, TheSmallestAnglesLeadStraightOn) {
  for (const double angle : {5e-324, -5e-324, 1e-323, 1e-310}) {
    for (const Displacement& d : {along_arc(0.5, angle), along_twist(0.5, 0.25, angle)}) {
      EXPECT_EQ(d.x, 0.5) << angle;
      EXPECT_NEAR(d.y, d.side, 1e-300) << angle;
    }
  }
}

// theta = t^2 / 2 at v = 1: a clothoid; x = integral of cos(t^2 / 2). Values of the series, summed
// in exact fractions.
TEST(Unicycle, Clothoid) {
  const Profile v = Profile::to_velocity(0.0, 1.0, {});
  const Profile omega = Profile::to_velocity(0.0, 5.0, {5.0, 1.0, 1.0});  // 1 rad/s^2 for 5 s
  double x = 0.0, y = 0.0, term = 1.0;
  for (int n = 0; n < 40;
       ++n) {  // (-1)^k (t^2/2)^n / n! alternate between x and y, integrated from 0 to 1
    if (n > 0) term *= 0.5 / n;
    const double part = term / (2 * n + 1) * (n % 4 < 2 ? 1.0 : -1.0);
    (n % 2 == 0 ? x : y) += part;
  }
  const Displacement d = integrate(v, omega, 0.0, 1.0);
  EXPECT_NEAR(d.x, x, 1e-15);
  EXPECT_NEAR(d.y, y, 1e-15);
}

TEST(Unicycle, OneSpanEqualsManySpans) {
  const Profile v = Profile::to_distance(0.2, 3.0, {0.9, 0.4, 0.7});
  const Profile omega = Profile::to_velocity(-2.0, 3.0, {4.0, 1.3, 2.1});
  const Displacement whole = integrate(v, omega, 0.0, 6.0);
  Displacement sum;
  for (int i = 0; i < 6000; ++i) sum = chained(sum, integrate(v, omega, i * 1e-3, (i + 1) * 1e-3));
  EXPECT_NEAR(sum.x, whole.x, 1e-11);
  EXPECT_NEAR(sum.y, whole.y, 1e-11);
  EXPECT_NEAR(sum.angle, whole.angle, 1e-11);
}

}  // namespace
}  // namespace ruedo::robot
