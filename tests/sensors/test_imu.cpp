// The IMU against hand-computed accelerations: at rest, on a ramp, on a lever arm; its noise;
// refused configurations.
#include <cmath>
#include <functional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "ruedo/imu_t.hpp"
#include "sensors/sensor_bench.h"

namespace ruedo {
namespace {

using test::Device;
using test::SensorBench;

constexpr double kG = 9.8;  // m/s^2, SDF's default

std::string world(const std::string& imu, const std::string& pose = "0 0 0 0 0 0",
                  const std::string& model_pose = "0 0 0.5 0 0 0") {
  return "<sdf version='1.9'><world name='w'><model name='box'><pose>" + model_pose +
         "</pose><link name='base'>"
         "<sensor name='IMU' type='imu'><pose>" +
         pose + "</pose><update_rate>100</update_rate>" + imu +
         "</sensor>"
         "<sensor name='IMU2' type='imu'><pose>" +
         pose + "</pose>" + imu + "</sensor></link></model></world></sdf>";
}

// One axis of SDF's gyroscope or accelerometer.
std::string axis_noise(const std::string& what, const std::string& axis,
                       const std::string& parameters) {
  return "<" + what + "><" + axis + "><noise type='gaussian'>" + parameters + "</noise></" + axis +
         "></" + what + ">";
}

struct Bench {
  explicit Bench(const std::string& sdf, SensorBench::Options options = {},
                 const char* name = "IMU")
      : bench(sdf), device(bench.make("box", name, options)), now(bench.snapshot()) {}

  imu_t sample(int64_t index = 0) {
    Outbox out;
    test::step(device, now, out, index);
    return Device::decode<imu_t>(out).at(0);
  }
  void advance(int64_t dt_us) {
    ++now.step;
    now.time += dt_us;
  }

  SensorBench bench;
  Device device;
  Snapshot now;
};

void expect_vector(const double (&actual)[3], const Vec3& expected, double tolerance) {
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(actual[i], expected[i], tolerance) << "axis " << i;
}

TEST(Imu, AtRestItShowsGravityUpwards) {
  Bench bench(world(""));
  const imu_t m = bench.sample();
  expect_vector(m.linear_acceleration, {0, 0, kG}, 0.0);
  expect_vector(m.angular_velocity, {0, 0, 0}, 0.0);
  EXPECT_EQ(m.orientation[0], 1.0);
  EXPECT_EQ(bench.device.channels, (std::vector<std::string>{"box/IMU"}));
}

// East is not along the world's x axis: an orientation by compass is that from east.
TEST(Imu, LocalizationFromEastTurnsByTheHeading) {
  for (const char* localization : {"ENU", "CUSTOM"}) {
    std::string sdf = world(std::string("<imu><orientation_reference_frame><localization>") +
                            localization + "</localization></orientation_reference_frame></imu>");
    const std::string at = "<world name='w'>";
    ASSERT_NE(sdf.find(at), std::string::npos);
    sdf.insert(sdf.find(at) + at.size(),
               "<spherical_coordinates><latitude_deg>10</latitude_deg><longitude_deg>20"
               "</longitude_deg><elevation>0</elevation><heading_deg>30</heading_deg>"
               "</spherical_coordinates>");
    Bench bench(sdf);
    const imu_t m = bench.sample();
    const double yaw = localization == std::string("ENU") ? M_PI / 6 : 0.0;
    EXPECT_NEAR(m.orientation[0], std::cos(yaw / 2), 1e-12) << localization;
    EXPECT_NEAR(m.orientation[3], std::sin(yaw / 2), 1e-12) << localization;
    expect_vector(m.linear_acceleration, {0, 0, kG}, 1e-12);
  }
}

// Nose up by 0.3 rad (pitch -0.3): gravity acts along x and z.
TEST(Imu, OnARampGravityIsAlongTheRampsAxes) {
  Bench bench(world("", "0 0 0 0 0 0", "0 0 0.5 0 -0.3 1.1"));
  const imu_t m = bench.sample();
  expect_vector(m.linear_acceleration, {kG * std::sin(0.3), 0, kG * std::cos(0.3)}, 1e-14);
  const Quat q(m.orientation[0], m.orientation[1], m.orientation[2], m.orientation[3]);
  EXPECT_NEAR(q.norm(), 1.0, 1e-15);
  EXPECT_NEAR(heading(q), 1.1, 1e-14);
}

TEST(Imu, InFreeFallItShowsNothing) {
  Bench bench(world(""));
  bench.now.body_accelerations[0] = {0, 0, -kG};
  expect_vector(bench.sample().linear_acceleration, {0, 0, 0}, 0.0);
}

// Half a metre ahead of the body's origin, turning at 2 rad/s: centripetal 2 m/s^2 towards the
// origin.
TEST(Imu, LeverArmTurningSteadily) {
  Bench bench(world("", "0.5 0 0 0 0 0"));
  bench.now.body_twists[0].angular = {0, 0, 2};
  imu_t m = bench.sample();
  expect_vector(m.linear_acceleration, {-2, 0, kG}, 1e-15);
  expect_vector(m.angular_velocity, {0, 0, 2}, 0.0);
  // Then 0.01 rad/s more within 5 ms: 2 rad/s^2 on the arm is 1 m/s^2 to the left.
  bench.advance(5000);
  bench.now.body_twists[0].angular = {0, 0, 2.01};
  m = bench.sample(1);
  expect_vector(m.linear_acceleration, {-2.01 * 2.01 * 0.5, 1.0, kG}, 1e-12);
}

// Mounted with a quarter turn to the left, looking along the body's y.
TEST(Imu, MeasuresInItsOwnFrame) {
  Bench bench(world("", "0 0 0.2 0 0 1.5707963267948966"));
  bench.now.body_twists[0].angular = {1, 2, 3};
  bench.now.body_accelerations[0] = {0.5, 0.25, 0};
  const Vec3 arm(0, 0, 0.2), omega(1, 2, 3);
  const Vec3 a = Vec3(0.5, 0.25, kG) + omega.cross(omega.cross(arm));
  const imu_t m = bench.sample();
  expect_vector(m.angular_velocity, {2, -1, 3}, 1e-15);
  expect_vector(m.linear_acceleration, {a.y(), -a.x(), a.z()}, 1e-14);
}

TEST(Imu, OnAStaticModelItOnlyFeelsGravity) {
  Bench bench(
      "<sdf version='1.9'><world name='w'><gravity>0 0 -1.6</gravity><model "
      "name='box'><static>true</static>"
      "<link name='base'><sensor name='IMU' type='imu'/></link></model></world></sdf>");
  EXPECT_FALSE(bench.device.sensor->observes());
  expect_vector(bench.sample().linear_acceleration, {0, 0, 1.6}, 0.0);
}

TEST(Imu, OrientationCanBeSwitchedOff) {
  const imu_t m =
      Bench(world("<imu><enable_orientation>false</enable_orientation></imu>")).sample();
  for (const double component : m.orientation) EXPECT_EQ(component, 0.0);
}

TEST(Imu, NoiseOnOneAxisLeavesTheOthersIdeal) {
  Bench bench(
      world("<imu>" + axis_noise("angular_velocity", "y", "<stddev>0.01</stddev>") + "</imu>"));
  const imu_t m = bench.sample();
  EXPECT_NE(m.angular_velocity[1], 0.0);
  EXPECT_EQ(m.angular_velocity[0], 0.0);
  EXPECT_EQ(m.angular_velocity[2], 0.0);
  expect_vector(m.linear_acceleration, {0, 0, kG}, 0.0);
}

const char* const kNoisy =
    "<imu><angular_velocity>"
    "<x><noise type='gaussian'><stddev>0.002</stddev></noise></x>"
    "<y><noise type='gaussian'><stddev>0.003</stddev></noise></y>"
    "<z><noise "
    "type='gaussian'><stddev>0.004</stddev><bias_mean>0.1</bias_mean></noise></z></"
    "angular_velocity>"
    "<linear_acceleration>"
    "<x><noise type='gaussian'><stddev>0.02</stddev></noise></x>"
    "<y><noise type='gaussian'><stddev>0.03</stddev></noise></y>"
    "<z><noise "
    "type='gaussian'><stddev>0.04</stddev><mean>0.5</mean></noise></z></linear_acceleration></imu>";

// Each axis against its own sigma (99.9 %); no two axes, samples, devices or robots together.
TEST(Imu, NoiseHasItsDistributionAndIsIndependent) {
  constexpr int kSamples = 10000;
  const double sigma[6] = {0.002, 0.003, 0.004, 0.02, 0.03, 0.04};
  const double mean[6] = {0, 0, 0.1, 0, 0, kG + 0.5};
  SensorBench::Options other_robot, other_seed;
  other_robot.named_robot = "box_2";
  other_seed.seed = 2;
  Bench bench(world(kNoisy)), device2(world(kNoisy), {}, "IMU2"),
      robot2(world(kNoisy), other_robot), seed2(world(kNoisy), other_seed);
  double sum[6] = {}, products[6][6] = {}, with_last = 0, with_device = 0, with_robot = 0,
         with_seed = 0, last = 0;
  for (int k = 0; k < kSamples; ++k) {
    for (Bench* each : {&bench, &device2, &robot2, &seed2}) each->advance(10'000);
    const imu_t m = bench.sample(k);
    double z[6];
    for (int i = 0; i < 3; ++i) {
      z[i] = (m.angular_velocity[i] - mean[i]) / sigma[i];
      z[i + 3] = (m.linear_acceleration[i] - mean[i + 3]) / sigma[i + 3];
    }
    for (int i = 0; i < 6; ++i) {
      sum[i] += z[i];
      for (int j = 0; j <= i; ++j) products[i][j] += z[i] * z[j];
    }
    with_last += z[0] * last;
    last = z[0];
    with_device += z[0] * device2.sample(k).angular_velocity[0] / sigma[0];
    with_robot += z[0] * robot2.sample(k).angular_velocity[0] / sigma[0];
    with_seed += z[0] * seed2.sample(k).angular_velocity[0] / sigma[0];
  }
  const double bound = 3.9 * std::sqrt(kSamples);  // 99.99 %: 31 comparisons
  for (int i = 0; i < 6; ++i) {
    EXPECT_LT(std::abs(sum[i]), bound) << i;
    EXPECT_NEAR(products[i][i] / kSamples, 1.0, 3.9 * std::sqrt(2.0 / kSamples)) << i;
    for (int j = 0; j < i; ++j) EXPECT_LT(std::abs(products[i][j]), bound) << i << j;
  }
  for (const double product : {with_last, with_device, with_robot, with_seed})
    EXPECT_LT(std::abs(product), bound);
}

TEST(Imu, WithoutNoiseItIsIdealBitByBit) {
  SensorBench::Options quiet;
  quiet.noise = false;
  Bench off(world(kNoisy), quiet), ideal(world(""));
  for (Bench* bench : {&off, &ideal}) {
    bench->now.body_twists[0].angular = {0.1, 0.2, 0.3};
    bench->now.body_accelerations[0] = {0.4, 0.5, 0.6};
  }
  const imu_t a = off.sample(), b = ideal.sample();
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(a.angular_velocity[i], b.angular_velocity[i]);
    EXPECT_EQ(a.linear_acceleration[i], b.linear_acceleration[i]);
  }
}

TEST(Imu, BiasIsTheDevicesOwnAndStays) {
  const std::string imu = "<imu>" +
                          axis_noise("angular_velocity", "z",
                                     "<bias_mean>0.5</bias_mean><bias_stddev>0.1</bias_stddev>") +
                          "</imu>";
  Bench bench(world(imu)), again(world(imu)), device2(world(imu), {}, "IMU2");
  const double bias = bench.sample(0).angular_velocity[2];
  EXPECT_NE(bias, 0.5);
  EXPECT_NEAR(bias, 0.5, 0.6);
  EXPECT_EQ(bench.sample(1).angular_velocity[2], bias);
  EXPECT_EQ(again.sample(0).angular_velocity[2], bias);
  EXPECT_NE(device2.sample(0).angular_velocity[2], bias);
}

TEST(Imu, OldFilesHaveOneNoiseForAllAxes) {
  Bench bench(
      world("<imu><noise><type>gaussian</type><rate><bias_mean>0.25</bias_mean></rate>"
            "<accel><bias_mean>-0.5</bias_mean></accel></noise></imu>"));
  const imu_t m = bench.sample();
  expect_vector(m.angular_velocity, {0.25, 0.25, 0.25}, 0.0);
  expect_vector(m.linear_acceleration, {-0.5, -0.5, kG - 0.5}, 0.0);
}

// Two devices served in turn give the bytes of each served alone.
TEST(Imu, ManyEqualSingle) {
  SensorBench both(world(kNoisy));
  Device first = both.make("box", "IMU"), second = both.make("box", "IMU2");
  Bench alone(world(kNoisy)), alone2(world(kNoisy), {}, "IMU2");
  Outbox out1, out2, out3, out4;
  for (int k = 0; k < 50; ++k) {
    alone.advance(5000);
    alone.now.body_twists[0].angular = {0.1 * k, 0, std::sin(k)};
    test::step(first, alone.now, out1, k % 2 == 0 ? k / 2 : -1);
    test::step(second, alone.now, out2, k);
    test::step(alone.device, alone.now, out3, k % 2 == 0 ? k / 2 : -1);
  }
  alone2.now = alone.bench.snapshot();
  for (int k = 0; k < 50; ++k) {
    alone2.advance(5000);
    alone2.now.body_twists[0].angular = {0.1 * k, 0, std::sin(k)};
    test::step(alone2.device, alone2.now, out4, k);
  }
  const auto bytes = [](const Outbox& out) {
    std::string all;
    for (const Outbox::Entry& e : out.entries())
      all.append(reinterpret_cast<const char*>(out.data(e)), e.size);
    return all;
  };
  EXPECT_EQ(bytes(out1), bytes(out3));
  EXPECT_EQ(bytes(out2), bytes(out4));
  EXPECT_NE(bytes(out1), bytes(out2));
}

TEST(Imu, RefusedConfigurations) {
  struct Case {
    std::string imu;
    const char* error;
  };
  for (const Case& c : {
           Case{"<imu>" + axis_noise("angular_velocity", "x", "<stddev>-0.1</stddev>") + "</imu>",
                "<noise/stddev>: '-0.1' is not allowed"},
           {"<imu>" + axis_noise("linear_acceleration", "z", "<bias_mean>nan</bias_mean>") +
                "</imu>",
            "<noise/bias_mean>: 'nan' is not finite"},
           {"<imu><angular_velocity><x><noise type='white'/></x></angular_velocity></imu>",
            "type 'white' is not allowed"},
           {"<imu><enable_orientation>maybe</enable_orientation></imu>",
            "'maybe' is neither true nor false"},
           {"<imu><noise><type>loud</type></noise></imu>",
            "'loud' is not allowed; allowed: none, gaussian"},
           {"<ruedo:bias>1</ruedo:bias>", "<ruedo:bias> is not known in <sensor>"},
       }) {
    try {
      Bench bench(world(c.imu));
      ADD_FAILURE() << c.imu;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr(c.error));
      EXPECT_THAT(error.what(), testing::HasSubstr("bench.sdf:1: "));
    }
  }
}

}  // namespace
}  // namespace ruedo
