// Devices on a wheel that is part of a kinematic robot's body: they turn with it, and the IMU
// measures that.
#include <cmath>

#include <gtest/gtest.h>

#include "ruedo/imu_t.hpp"
#include "ruedo/planar_lidar_t.hpp"
#include "ruedo/sonar_t.hpp"
#include "sensors/ray_bench.h"

namespace ruedo {
namespace {

using test::RayBench;

// Between walls at x = 2 and x = -3, on the plane z = 0: the left wheel's hub at (0, 0.2, 0.1), a
// device 0.05 m ahead of it that looks ahead.
std::string rover(const std::string& sensor) {
  return "<sdf version='1.9'><world name='w'>" +
         test::solid("front", "2.5 0 0 0 0 0", test::box(1, 9, 9)) +
         test::solid("back", "-3.5 0 0 0 0 0", test::box(1, 9, 9)) +
         test::solid("ground", "0 0 -0.5 0 0 0", test::box(20, 20, 1)) +
         "<model name='r'><link name='base'/><link name='left'><pose>0 0.2 0.1 0 0 0</pose>" +
         sensor +
         "</link>"
         "<link name='right'><pose>0 -0.2 0.1 0 0 0</pose></link>"
         "<joint name='lj' type='revolute'><parent>base</parent><child>left</child><axis><xyz>0 1 "
         "0</xyz></axis></joint>"
         "<joint name='rj' type='revolute'><parent>base</parent><child>right</child><axis><xyz>0 1 "
         "0</xyz></axis></joint>"
         "<ruedo:drive><ruedo:left_joint>lj</ruedo:left_joint><ruedo:right_joint>rj</"
         "ruedo:right_joint><ruedo:wheel_radius>0.1</ruedo:wheel_radius>"
         "</ruedo:drive></model></world></sdf>";
}

struct Turned {
  double angle;  // rad, ahead
  double range;  // m, along the device's x
};
// Ahead to the front wall; a quarter turn on, 0.05 m above the ground and looking down; half a turn
// on, backwards.
constexpr Turned kTurned[] = {{0.0, 1.95}, {M_PI / 2, 0.05}, {M_PI, 2.95}};

TEST(OnAWheel, ALaserTurnsWithIt) {
  RayBench bench(rover("<sensor name='S' type='gpu_lidar'><pose>0.05 0 0 0 0 "
                       "0</pose><lidar><scan><horizontal><samples>1</samples></horizontal></scan>"
                       "<range><max>30</max></range></lidar></sensor>"),
                 "S");
  for (const Turned& turned : kTurned) {
    bench.now.wheel_angles[0] = turned.angle;
    EXPECT_NEAR(bench.sample<planar_lidar_t>().ranges.at(0), turned.range, 1e-6) << turned.angle;
  }
}

TEST(OnAWheel, ASonarTurnsWithIt) {
  RayBench bench(
      rover("<sensor name='S' type='sonar'><pose>0.05 0 0 0 0 0</pose><sonar><max>5</max></sonar>"
            "<ruedo:sonar><ruedo:rays>1</ruedo:rays></ruedo:sonar></sensor>"),
      "S");
  for (const Turned& turned : kTurned) {
    bench.now.wheel_angles[0] = turned.angle;
    EXPECT_NEAR(bench.sample<sonar_t>().range.at(0), turned.range, 1e-6) << turned.angle;
  }
}

void expect_vector(const double (&actual)[3], const Vec3& expected) {
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(actual[i], expected[i], 1e-12) << "axis " << i;
}

TEST(OnAWheel, AnImuFeelsTheWheel) {
  constexpr double g = 9.8;
  RayBench bench(rover("<sensor name='S' type='imu'><pose>0.05 0 0 0 0 0</pose></sensor>"), "S");
  bench.now.wheel_rates[0] = 10.0;  // towards the hub: 100 x 0.05 = 5 m/s^2
  imu_t m = bench.sample<imu_t>(0);
  expect_vector(m.angular_velocity, {0, 10, 0});
  expect_vector(m.linear_acceleration, {-5, 0, g});
  bench.now.wheel_angles[0] = M_PI / 2;  // x looks down, z ahead; the hub is above
  m = bench.sample<imu_t>(1);
  expect_vector(m.angular_velocity, {0, 10, 0});
  expect_vector(m.linear_acceleration, {-5 - g, 0, 0});
  EXPECT_NEAR(m.orientation[2], std::sqrt(0.5), 1e-12);

  // 0.05 rad/s more in 5 ms: 10 rad/s^2 on 0.05 m, downwards ahead of the hub.
  bench.now.wheel_angles[0] = 0.0;
  bench.advance(5000);
  bench.now.wheel_rates[0] = 10.05;
  m = bench.sample<imu_t>(2);
  expect_vector(m.linear_acceleration, {-10.05 * 10.05 * 0.05, 0, g - 0.5});
}

// The body turns at 2 rad/s about z, the wheel at 10 rad/s about y: the hub has 4 x 0.2 towards the
// middle, the device (100 + 4) x 0.05 towards the hub; what the turning of the wheel's axis adds is
// along the arm, and so nothing.
TEST(OnAWheel, AnImuFeelsTheBodyToo) {
  RayBench bench(rover("<sensor name='S' type='imu'><pose>0.05 0 0 0 0 0</pose></sensor>"), "S");
  bench.now.wheel_rates[0] = 10.0;
  bench.now.body_twists[0].angular = {0, 0, 2};
  imu_t m = bench.sample<imu_t>(0);
  expect_vector(m.angular_velocity, {0, 10, 2});
  expect_vector(m.linear_acceleration, {-5.2, -0.8, 9.8});
  // Then 0.01 rad/s more within 5 ms: 2 rad/s^2 about z move the hub, 0.2 m to the left, back by
  // 0.4, and the device, 0.05 m ahead of it, left by 0.1.
  bench.advance(5000);
  bench.now.body_twists[0].angular = {0, 0, 2.01};
  m = bench.sample<imu_t>(1);
  const double w2 = 2.01 * 2.01;
  expect_vector(m.linear_acceleration, {-0.4 - (100 + w2) * 0.05, 0.1 - w2 * 0.2, 9.8});
}

}  // namespace
}  // namespace ruedo
