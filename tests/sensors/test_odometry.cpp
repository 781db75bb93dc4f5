// Odometry against paths that are known in closed form: the wheels are turned by the test, the
// world is empty.
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "ruedo/odometry_t.hpp"
#include "ruedo/odometry_twist_t.hpp"
#include "sensors/sensor_bench.h"

namespace ruedo {
namespace {

using test::Device;
using test::SensorBench;

constexpr double kRadius = 0.1, kTrack = 0.4;  // m

// A robot with two wheels (or four), and what is in <ruedo:odometry>.
std::string world(const std::string& odometry, bool four_wheels = false) {
  std::string wheels, drive;
  for (const char* end : {"front", "rear"}) {
    if (end == std::string("rear") && !four_wheels) continue;
    for (const char* side : {"left", "right"}) {
      const std::string name = std::string(end) + "_" + side;
      const std::string y = side == std::string("left") ? "0.2" : "-0.2";
      wheels += "<link name='" + name + "'><pose>" +
                (end == std::string("front") ? "0.1 " : "-0.1 ") + y +
                " 0.1 0 0 0</pose></link>"
                "<joint name='" +
                name + "_joint' type='revolute'><parent>base</parent><child>" + name +
                "</child>"
                "<axis><xyz>0 1 0</xyz></axis></joint>";
      drive +=
          "<ruedo:" + std::string(side) + "_joint>" + name + "_joint</ruedo:" + side + "_joint>";
    }
  }
  return "<sdf version='1.9'><world name='w'><model name='rover'><pose>3 -2 0 0 0 0.7</pose>"
         "<link name='base'><pose>0 0 0.1 0 0 0</pose><collision name='c'><geometry><box><size>0.4 "
         "0.3 0.1</size></box></geometry></collision></link>" +
         wheels + "<ruedo:drive>" + drive +
         "<ruedo:wheel_radius>0.1</ruedo:wheel_radius><ruedo:track>0.4</ruedo:track></ruedo:drive>"
         "<ruedo:odometry>" +
         odometry + "</ruedo:odometry></model></world></sdf>";
}

// Turns the wheels of one robot and passes the states to its odometry.
class Drive {
 public:
  explicit Drive(const std::string& odometry, bool four_wheels = false,
                 SensorBench::Options options = {})
      : bench(world(odometry, four_wheels)),
        device(bench.make("rover", "odometry", options)),
        now(bench.snapshot()) {
    test::step(device, now, out, 0);
  }

  // The state after dt_us in which the sides have turned to these angles, at these rates at its
  // end.
  void to(double left, double right, int64_t dt_us, double left_rate = 0.0, double right_rate = 0.0,
          bool due = true) {
    ++now.step;
    now.time += dt_us;
    for (size_t i = 0; i < now.wheel_angles.size(); ++i) {
      const bool is_left = bench.layout.wheels[i].left;
      now.wheel_angles[i] = is_left ? left : right;
      now.wheel_rates[i] = is_left ? left_rate : right_rate;
    }
    test::step(device, now, out, due ? ++samples : -1);
  }

  odometry_t last() const { return Device::decode<odometry_t>(out, 0).back(); }
  odometry_twist_t twist() const { return Device::decode<odometry_twist_t>(out, 1).back(); }

  SensorBench bench;
  Device device;
  Snapshot now;
  Outbox out;
  int64_t samples = 0;
};

TEST(Odometry, StartsAtZeroWhereverTheRobotStands) {
  const odometry_t m = Drive("").last();
  EXPECT_EQ(m.utime, 0);
  EXPECT_EQ(m.x, 0.0);
  EXPECT_EQ(m.y, 0.0);
  EXPECT_EQ(m.theta, 0.0);
  EXPECT_EQ(m.n, 2);
  EXPECT_EQ(m.resets, 0);
}

TEST(Odometry, ChannelTypeAndRate) {
  Drive drive("<ruedo:rate>20</ruedo:rate>");
  EXPECT_EQ(drive.device.channels,
            (std::vector<std::string>{"rover/odometry", "rover/odometry/twist"}));
  EXPECT_EQ(drive.device.rate, (Rate{20, 1}));
  EXPECT_TRUE(drive.device.sensor->observes());
}

TEST(Odometry, StraightAndOnTheSpot) {
  Drive drive("");
  drive.to(1.0, 1.0, 5000, 4.0, 4.0);
  odometry_t m = drive.last();
  EXPECT_NEAR(m.x, kRadius, 1e-16);
  EXPECT_EQ(m.y, 0.0);
  EXPECT_EQ(m.theta, 0.0);
  EXPECT_NEAR(m.v, 0.4, 1e-16);
  EXPECT_EQ(m.omega, 0.0);
  EXPECT_EQ(m.ticks[0], 0);
  drive.to(0.0, 2.0, 5000, -3.0, 3.0);  // right ahead, left back: to the left by 2 * 0.1 / 0.4
  m = drive.last();
  EXPECT_NEAR(m.x, kRadius, 1e-16);
  EXPECT_NEAR(m.theta, 0.5, 1e-16);
  EXPECT_NEAR(m.omega, 1.5, 1e-15);
  EXPECT_EQ(m.angle, (std::vector<double>{0.0, 2.0}));
  EXPECT_EQ(m.rate, (std::vector<double>{-3.0, 3.0}));
}

// A quarter of a circle of radius 1 m in a single step.
TEST(Odometry, ArcIsExactForAConstantTwist) {
  Drive drive("<ruedo:integrator>arc</ruedo:integrator>");
  const double turn = M_PI / 2;
  drive.to(turn * (1.0 - kTrack / 2) / kRadius, turn * (1.0 + kTrack / 2) / kRadius, 50'000);
  const odometry_t m = drive.last();
  EXPECT_NEAR(m.x, 1.0, 1e-15);
  EXPECT_NEAR(m.y, 1.0, 1e-15);
  EXPECT_NEAR(m.theta, turn, 1e-15);
}

TEST(Odometry, FourWheelsAreAveragedOnEachSide) {
  Drive drive("", true);
  EXPECT_EQ(drive.last().n, 4);
  ++drive.now.step;
  drive.now.time += 5000;
  double next_left = 1.0;
  for (size_t i = 0; i < 4; ++i) {  // left: 1 and 3; right: 2 and 2
    const bool left = drive.bench.layout.wheels[i].left;
    drive.now.wheel_angles[i] = left ? next_left : 2.0;
    if (left) next_left = 3.0;
  }
  test::step(drive.device, drive.now, drive.out, 1);
  EXPECT_NEAR(drive.last().x, 2.0 * kRadius, 1e-16);
  EXPECT_NEAR(drive.last().theta, 0.0, 1e-16);
}

// Eqs. 4 to 8 by hand: from rest to v = 0.5 m/s, omega = 1 rad/s within 0.1 s.
TEST(Odometry, TrapezoidFollowsThePapersEquations) {
  Drive drive("<ruedo:integrator>trapezoid</ruedo:integrator>");
  drive.to(0.15, 0.35, 100'000, 3.0, 7.0);
  odometry_t m = drive.last();
  EXPECT_NEAR(m.theta, 0.1 * (1.0 + 0.0) / 2, 1e-16);
  EXPECT_NEAR(m.x, 0.1 * (0.5 * std::cos(0.05) + 0.0) / 2, 1e-16);
  EXPECT_NEAR(m.y, 0.1 * (0.5 * std::sin(0.05) + 0.0) / 2, 1e-16);
  drive.to(0.45, 1.05, 100'000, 3.0, 7.0);
  m = drive.last();
  EXPECT_NEAR(m.theta, 0.15, 1e-15);
  EXPECT_NEAR(m.x, 0.025 * std::cos(0.05) + 0.025 * (std::cos(0.15) + std::cos(0.05)), 1e-15);
}

// Distance (or angle) after t along a path with a trapezoidal speed profile, and the speed.
struct Profile {
  double length, speed, acceleration;
  double ramp() const { return speed / acceleration; }
  double duration() const { return length / speed + ramp(); }
  double at(double t) const {
    if (t <= 0) return 0;
    if (t >= duration()) return length;
    if (t < ramp()) return 0.5 * acceleration * t * t;
    if (t > duration() - ramp()) return length - 0.5 * acceleration * std::pow(duration() - t, 2);
    return speed * (t - 0.5 * ramp());
  }
  double rate(double t) const {
    if (t <= 0 || t >= duration()) return 0;
    return std::min({speed, acceleration * t, acceleration * (duration() - t)});
  }
};

// Drives the square of 1 m with legs and turns of trapezoidal speed, `laps` times; ends where it
// began.
void drive_square(Drive& drive, int laps, int64_t dt_us) {
  const Profile leg{1.0, 0.4, 0.3}, turn{M_PI / 2, 1.2, 1.7};
  double left = 0, right = 0;
  for (int side = 0; side < 4 * laps; ++side) {
    for (const bool turning : {false, true}) {
      const Profile& profile = turning ? turn : leg;
      const double arm = turning ? 0.5 * kTrack : 1.0;
      const double sign_left = turning ? -1.0 : 1.0;
      const double l0 = left, r0 = right;
      double t = 0;
      while (t < profile.duration()) {
        t += 1e-6 * static_cast<double>(dt_us);
        const double way = profile.at(t) * arm / kRadius, rate = profile.rate(t) * arm / kRadius;
        left = l0 + sign_left * way;
        right = r0 + way;
        drive.to(left, right, dt_us, sign_left * rate, rate, false);
      }
    }
  }
  drive.to(left, right, dt_us, 0, 0, true);
}

TEST(Odometry, SquaresCloseWithArcAtEveryStepSize) {
  for (const int64_t dt_us : {100, 1000, 5000, 50'000}) {
    Drive drive("");
    drive_square(drive, dt_us < 1000 ? 1 : 3, dt_us);
    const odometry_t m = drive.last();
    EXPECT_NEAR(m.x, 0.0, 1e-9) << dt_us;  // the target is 1e-6 m, 1e-9 rad
    EXPECT_NEAR(m.y, 0.0, 1e-9) << dt_us;
    EXPECT_NEAR(m.theta, (dt_us < 1000 ? 1 : 3) * 2 * M_PI, 1e-10) << dt_us;
  }
}

TEST(Odometry, EncoderTicksKeepTheSquareWithinHalfAMillimetre) {
  // A P3-AT counts some 34 000 ticks per turn of a wheel; with as many the error is below 0.5 mm.
  Drive drive(
      "<ruedo:ticks_per_turn>34000</ruedo:ticks_per_turn><ruedo:counter_bits>16</"
      "ruedo:counter_bits>");
  drive_square(drive, 3, 5000);
  EXPECT_NEAR(drive.last().x, 0.0, 0.5e-3);
  EXPECT_NEAR(drive.last().y, 0.0, 0.5e-3);
  EXPECT_NE(drive.last().x, 0.0);
}

TEST(Odometry, TicksAreCountedDownwardsToo) {
  Drive drive("<ruedo:ticks_per_turn>500</ruedo:ticks_per_turn>");
  drive.to(1.0, -0.001, 100'000);  // 79.58 ticks, -0.08 ticks
  odometry_t m = drive.last();
  EXPECT_EQ(m.ticks, (std::vector<int64_t>{79, -1}));
  EXPECT_NEAR(m.angle[0], 79 * 2 * M_PI / 500, 1e-15);
  EXPECT_NEAR(m.rate[0], 79 * 2 * M_PI / 500 / 0.1, 1e-13);  // mean since the last sample
  EXPECT_NEAR(m.v, 0.5 * kRadius * (79 - 1) * 2 * M_PI / 500 / 0.1, 1e-13);
  drive.to(0.0, 0.0, 100'000);
  EXPECT_EQ(drive.last().ticks, (std::vector<int64_t>{0, 0}));
  EXPECT_NEAR(drive.last().theta, 0.0, 1e-15);
}

TEST(Odometry, CountersWrapAndTheRobotUnwrapsThem) {
  Drive narrow(
      "<ruedo:ticks_per_turn>500</ruedo:ticks_per_turn><ruedo:counter_bits>8</ruedo:counter_bits>");
  Drive wide("<ruedo:ticks_per_turn>500</ruedo:ticks_per_turn>");
  for (int i = 1; i <= 100; ++i) {  // up to 127 ticks a step: 1.59 rad, both ways
    const double left = 1.59 * i, right = -1.58 * i;
    narrow.to(left, right, 5000);
    wide.to(left, right, 5000);
    EXPECT_EQ(narrow.last().ticks[0], wide.last().ticks[0] & 255);
    EXPECT_EQ(narrow.last().ticks[1], wide.last().ticks[1] & 255);
  }
  EXPECT_EQ(wide.last().ticks[0], 12652);  // floor(159 * 500 / 2 pi)
  EXPECT_EQ(narrow.last().x, wide.last().x);
  EXPECT_EQ(narrow.last().y, wide.last().y);
  EXPECT_EQ(narrow.last().theta, wide.last().theta);
  EXPECT_EQ(narrow.last().angle, wide.last().angle);
  // More than half the range in one step counts as the opposite direction, as on the real robot:
  // 200 is -56.
  Drive fast(
      "<ruedo:ticks_per_turn>500</ruedo:ticks_per_turn><ruedo:counter_bits>8</ruedo:counter_bits>");
  fast.to(2 * M_PI * 200.5 / 500, 0, 5000);
  EXPECT_EQ(fast.last().ticks[0], 200);
  EXPECT_NEAR(fast.last().angle[0], -56 * 2 * M_PI / 500, 1e-15);
}

TEST(Odometry, BelievesInAWrongRadiusAndTrack) {
  Drive drive(
      "<ruedo:radius_error>0.1 "
      "-0.05</ruedo:radius_error><ruedo:track_error>0.25</ruedo:track_error>");
  drive.to(1.0, 1.0, 5000, 2.0, 2.0);  // 0.11 m and 0.095 m on a track of 0.5 m
  const odometry_t m = drive.last();
  EXPECT_NEAR(m.theta, -0.015 / 0.5, 1e-16);
  EXPECT_NEAR(m.x, 0.1025 * std::sin(0.015) / 0.015 * std::cos(0.015), 1e-16);
  EXPECT_NEAR(m.y, -0.1025 * std::sin(0.015) / 0.015 * std::sin(0.015), 1e-16);
  EXPECT_NEAR(m.v, 0.205, 1e-16);
  EXPECT_NEAR(m.omega, -0.03 / 0.5, 1e-16);
}

TEST(Odometry, ResetZeroesThePoseAndNotTheEncoders) {
  Drive drive("");
  drive.to(1.0, 2.0, 5000);
  drive.now.robots[0].odometry_resets = 1;
  drive.to(1.0, 2.0, 5000);
  odometry_t m = drive.last();
  EXPECT_EQ(m.x, 0.0);
  EXPECT_EQ(m.theta, 0.0);
  EXPECT_EQ(m.resets, 1);
  EXPECT_EQ(m.angle, (std::vector<double>{1.0, 2.0}));
  drive.to(2.0, 3.0, 5000);
  EXPECT_NEAR(drive.last().x, kRadius, 1e-16);
  EXPECT_EQ(drive.last().y, 0.0);
}

// Slip of 0.02 sqrt(m): in steps of 4 mm each side's encoder is off by N(0, 0.02 sqrt(0.004)).
TEST(Odometry, SlipHasItsSigmaAndIsIndependent) {
  Drive drive("<ruedo:slip_noise>0.02</ruedo:slip_noise>");
  SensorBench::Options other;
  other.named_robot = "rover_2";
  Drive second("<ruedo:slip_noise>0.02</ruedo:slip_noise>", false, other);
  constexpr int kSteps = 10000;
  const double sigma = 0.02 * std::sqrt(0.004);
  double squares = 0, sum = 0, across = 0, along = 0, robots = 0, last_left = 0, last_slip = 0,
         last_right = 0, last_other = 0;
  for (int i = 1; i <= kSteps; ++i) {
    drive.to(0.04 * i, 0.04 * i, 5000);
    second.to(0.04 * i, 0.04 * i, 5000);
    const double left = drive.last().angle[0] - 0.04 * i, right = drive.last().angle[1] - 0.04 * i;
    const double theirs = second.last().angle[0] - 0.04 * i;
    drive.out.clear();
    second.out.clear();
    const double slip = (left - last_left) * kRadius / sigma;  // N(0, 1)
    sum += slip;
    squares += slip * slip;
    across += slip * (right - last_right) * kRadius / sigma;
    robots += slip * (theirs - last_other) * kRadius / sigma;
    along += slip * last_slip;
    last_left = left;
    last_right = right;
    last_other = theirs;
    last_slip = slip;
  }
  EXPECT_LT(std::abs(sum), 3.29 * std::sqrt(kSteps));
  EXPECT_NEAR(squares / kSteps, 1.0, 3.29 * std::sqrt(2.0 / kSteps));
  for (const double product : {across, along, robots})
    EXPECT_LT(std::abs(product), 3.29 * std::sqrt(kSteps));
}

TEST(Odometry, TwistIsOdometrysAndExactWithIdealEncoders) {
  Drive drive("");
  drive.to(0.02, 0.04, 5000, 4.0, 8.0);
  const odometry_twist_t twist = drive.twist();
  EXPECT_EQ(twist.utime, 5000);
  EXPECT_EQ(twist.vx, drive.last().v);
  EXPECT_EQ(twist.vy, 0.0);
  EXPECT_EQ(twist.omega, drive.last().omega);
  EXPECT_THAT(twist.covariance, testing::Each(0.0));
}

TEST(Odometry, CovarianceOfTheTwistIsThatOfTheSlip) {
  Drive drive("<ruedo:slip_noise>0.02</ruedo:slip_noise>");
  drive.to(0.0, 0.0, 5000, 0.0, 0.0);
  constexpr int kSamples = 4000;
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (int i = 1; i <= kSamples; ++i) {  // 50 Hz; 0.1 m/s left, 0.4 m/s right
    const double turned = 0.02 * (i - 1);
    for (int k = 1; k <= 4; ++k)
      drive.to(turned + 0.005 * k, 4.0 * (turned + 0.005 * k), 5000, 1.0, 4.0, k == 4);
    const odometry_twist_t twist = drive.twist();
    const Vec3 error(twist.vx - 0.25, twist.vy, twist.omega - 0.75);
    sum += error * error.transpose();
    drive.out.clear();
  }
  drive.to(0.02 * kSamples + 0.02, 4.0 * (0.02 * kSamples + 0.02), 20000, 1.0, 4.0);
  // sides: 0.02^2 (0.002 m, 0.008 m) / (0.02 s)^2
  const double left = 0.002, right = 0.008;
  const odometry_twist_t twist = drive.twist();
  const double expected[3][3] = {{(left + right) / 4, 0, (right - left) / (2 * kTrack)},
                                 {0, 0, 0},
                                 {(right - left) / (2 * kTrack), 0, (left + right) / 0.16}};
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(twist.covariance[3 * i + k], expected[i][k], 1e-12);
      EXPECT_NEAR(sum(i, k) / kSamples, expected[i][k],
                  3.29 * std::sqrt(2.0 * expected[i][i] * expected[k][k] / kSamples));
    }
  }
}

TEST(Odometry, CovarianceOfTheTwistIsThatOfTheTicks) {
  Drive drive("<ruedo:ticks_per_turn>500</ruedo:ticks_per_turn>");
  double turned = 0.0, squares = 0.0;
  constexpr int kSamples = 4000;
  for (int i = 0; i < kSamples; ++i) {
    turned += 0.03 + 0.01 * std::sin(1.7 * i);  // no multiple of a tick
    const double before = i == 0 ? 0.0 : turned - 0.03 - 0.01 * std::sin(1.7 * i);
    drive.to(turned, 1.3 * turned, 20000);
    const double v = kRadius * 1.15 * (turned - before) / 0.02;
    squares += std::pow(drive.twist().vx - v, 2);
    drive.out.clear();
  }
  drive.to(turned + 0.03, 1.3 * (turned + 0.03), 20000);
  const double tick = kRadius * 2.0 * M_PI / 500.0 / 0.02;  // m/s
  EXPECT_NEAR(drive.twist().covariance[0], tick * tick / 12.0, 1e-12);
  EXPECT_NEAR(squares / kSamples, tick * tick / 12.0, 0.1 * tick * tick / 12.0);
}

TEST(Odometry, SlipCanBeSwitchedOffAndAStandingRobotDoesNotSlip) {
  SensorBench::Options quiet;
  quiet.noise = false;
  Drive off("<ruedo:slip_noise>0.5</ruedo:slip_noise>", false, quiet), ideal(""),
      on("<ruedo:slip_noise>0.5</ruedo:slip_noise>");
  for (Drive* drive : {&off, &ideal, &on}) {
    for (int i = 0; i < 10; ++i) drive->to(0, 0, 5000);
    EXPECT_EQ(drive->last().x, 0.0);
  }
  off.to(0.3, 0.7, 5000);
  ideal.to(0.3, 0.7, 5000);
  on.to(0.3, 0.7, 5000);
  EXPECT_EQ(off.last().x, ideal.last().x);
  EXPECT_EQ(off.last().y, ideal.last().y);
  EXPECT_EQ(off.last().theta, ideal.last().theta);
  EXPECT_NE(on.last().x, ideal.last().x);
}

// The pose does not depend on how often it is published.
TEST(Odometry, SampledRarelyOrAtEveryStepItIsTheSame) {
  for (const char* odometry :
       {"", "<ruedo:integrator>trapezoid</ruedo:integrator>",
        "<ruedo:slip_noise>0.01</ruedo:slip_noise><ruedo:ticks_per_turn>1000</"
        "ruedo:ticks_per_turn>"}) {
    Drive often(odometry), rarely(odometry);
    for (int i = 1; i <= 200; ++i) {
      const double left = std::sin(0.01 * i), right = 0.02 * i, lr = 2.0 * std::cos(0.01 * i),
                   rr = 4.0;
      often.to(left, right, 5000, lr, rr, true);
      rarely.to(left, right, 5000, lr, rr, i == 200);
    }
    EXPECT_EQ(often.last().x, rarely.last().x);
    EXPECT_EQ(often.last().y, rarely.last().y);
    EXPECT_EQ(often.last().theta, rarely.last().theta);
    EXPECT_EQ(often.last().ticks, rarely.last().ticks);
    EXPECT_EQ(Device::decode<odometry_t>(often.out).size(), 201u);
    EXPECT_EQ(Device::decode<odometry_t>(rarely.out).size(), 2u);
  }
}

// Back along the same wheel angles the robot returns; mirrored wheels give the mirrored path.
TEST(Odometry, ReturnsAndMirrors) {
  Drive there_and_back(""), mirrored("");
  std::vector<std::pair<double, double>> angles{{0, 0}};
  for (int i = 1; i <= 100; ++i) angles.push_back({std::sin(0.02 * i) + 0.03 * i, 0.05 * i});
  for (const auto& [left, right] : angles) {
    there_and_back.to(left, right, 5000);
    mirrored.to(right, left, 5000);
  }
  EXPECT_NEAR(there_and_back.last().x, mirrored.last().x, 1e-15);
  EXPECT_NEAR(there_and_back.last().y, -mirrored.last().y, 1e-15);
  EXPECT_NEAR(there_and_back.last().theta, -mirrored.last().theta, 1e-15);
  EXPECT_GT(std::abs(there_and_back.last().y), 0.01);
  for (auto at = angles.rbegin(); at != angles.rend(); ++at)
    there_and_back.to(at->first, at->second, 5000);
  EXPECT_NEAR(there_and_back.last().x, 0.0, 1e-14);
  EXPECT_NEAR(there_and_back.last().y, 0.0, 1e-14);
  EXPECT_NEAR(there_and_back.last().theta, 0.0, 1e-14);
}

TEST(Odometry, RefusedConfigurations) {
  struct Case {
    const char* odometry;
    const char* error;
  };
  for (const Case& c : {
           Case{"<ruedo:integrator>simpson</ruedo:integrator>",
                "<ruedo:odometry/ruedo:integrator>: 'simpson' is not allowed; allowed: arc, "
                "trapezoid"},
           {"<ruedo:ticks_per_turn>-1</ruedo:ticks_per_turn>",
            "'-1' is not allowed; allowed is a whole number from 0 to 1000000000"},
           {"<ruedo:ticks_per_turn>1.5</ruedo:ticks_per_turn>", "'1.5' is not a whole number"},
           {"<ruedo:counter_bits>63</ruedo:counter_bits>",
            "'63' is not allowed; allowed is a whole number from 0 to 62"},
           {"<ruedo:counter_bits>16</ruedo:counter_bits>", "needs <ruedo:ticks_per_turn>"},
           {"<ruedo:radius_error>0.1</ruedo:radius_error>",
            "'0.1' is not allowed; allowed are two numbers above -1"},
           {"<ruedo:radius_error>0 -1</ruedo:radius_error>", "'0 -1' is not allowed"},
           {"<ruedo:track_error>-1</ruedo:track_error>",
            "'-1' is not allowed; allowed is a number above -1"},
           {"<ruedo:slip_noise>-0.1</ruedo:slip_noise>",
            "'-0.1' is not allowed; allowed is a number of at least 0"},
           {"<ruedo:slip_noise>much</ruedo:slip_noise>", "'much' is not a number"},
           {"<ruedo:intergator>arc</ruedo:intergator>", "did you mean <ruedo:integrator>?"},
       }) {
    try {
      Drive drive(c.odometry);
      ADD_FAILURE() << c.odometry;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr(c.error));
      EXPECT_THAT(error.what(), testing::HasSubstr("bench.sdf:1: "));
    }
  }
}

}  // namespace
}  // namespace ruedo
