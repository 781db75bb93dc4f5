// Sonar arrays against scenes worked out by hand: the cone's pattern, average and nearest, firing
// order, lost echoes, crosstalk, noise; and refused configurations.
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "ray_bench.h"
#include "ruedo/device_info_t.hpp"
#include "ruedo/sonar_t.hpp"

namespace ruedo {
namespace {

using test::box;
using test::RayBench;
using test::robot_world;
using test::SensorBench;
using test::solid;

std::string array(const std::string& ours,
                  const std::string& sonar = "<min>0.1</min><max>5</max><radius>1</radius>") {
  return "<sensor name='SONAR' type='sonar'><sonar>" + sonar + "</sonar><ruedo:sonar>" + ours +
         "</ruedo:sonar></sensor>";
}

std::string cone(double horizontal, double vertical, int rays, const std::string& reading) {
  return "<ruedo:horizontal_aperture>" + std::to_string(horizontal) +
         "</ruedo:horizontal_aperture><ruedo:vertical_aperture>" + std::to_string(vertical) +
         "</ruedo:vertical_aperture><ruedo:rays>" + std::to_string(rays) +
         "</ruedo:rays><ruedo:reading>" + reading + "</ruedo:reading>";
}

std::string wall_at(double x, const std::string& surface = "") {
  return solid("wall", std::to_string(x + 0.5) + " 0 0 0 0 0", box(1, 100, 100), surface);
}

// One ray is the transducer's axis.
TEST(Sonar, OneRayIsTheAxis) {
  for (const char* reading : {"average", "nearest"}) {
    RayBench bench(robot_world(wall_at(2), array(cone(0.5, 0.5, 1, reading))), "SONAR");
    const auto m = bench.sample<sonar_t>();
    EXPECT_EQ(m.n, 1);
    EXPECT_EQ(m.range[0], 2.0f);
    EXPECT_EQ(m.fired_utime[0], 0);
    EXPECT_EQ(m.fresh[0], 1);
  }
}

// Nine rays, 60 degrees: the ring of eight is halfway, by solid angle, between 1/9 and the edge: 1
// - cos = (5/9)(1 - cos 30).
TEST(Sonar, AverageAndNearestOfNineRays) {
  const double cosine = 1 - 5.0 / 9 * (1 - std::cos(M_PI / 6));
  const double expected = (2 + 8 * 2 / cosine) / 9;
  RayBench average(robot_world(wall_at(2), array(cone(M_PI / 3, M_PI / 3, 9, "average"))), "SONAR");
  EXPECT_NEAR(average.sample<sonar_t>().range[0], expected, 1e-6);
  RayBench nearest(robot_world(wall_at(2), array(cone(M_PI / 3, M_PI / 3, 9, "nearest"))), "SONAR");
  EXPECT_EQ(nearest.sample<sonar_t>().range[0], 2.0f);
}

// A plate that only the topmost ray of the ring meets: the others count as the maximum range.
TEST(Sonar, RaysWithoutEchoCountAsTheMaximum) {
  const double angle = std::acos(1 - 5.0 / 9 * (1 - std::cos(M_PI / 6)));
  const std::string plate = solid(
      "plate", "2.5 0 " + std::to_string(2 * std::tan(angle) + 0.05) + " 0 0 0", box(1, 0.2, 0.2));
  RayBench average(robot_world(plate, array(cone(M_PI / 3, M_PI / 3, 9, "average"))), "SONAR");
  EXPECT_NEAR(average.sample<sonar_t>().range[0], (8 * 5 + 2 / std::cos(angle)) / 9, 1e-6);
  RayBench nearest(robot_world(plate, array(cone(M_PI / 3, M_PI / 3, 9, "nearest"))), "SONAR");
  EXPECT_NEAR(nearest.sample<sonar_t>().range[0], std::hypot(2, 2 * std::tan(angle) - 0.05),
              1e-5);  // its lower edge
  RayBench nothing(robot_world("", array(cone(M_PI / 3, M_PI / 3, 9, "average"))), "SONAR");
  EXPECT_EQ(nothing.sample<sonar_t>().range[0], 5.0f);
}

// A wall turned by 23 degrees, 2 m away along its normal: nearest on the cone's edge, 15 degrees
// off, on the side of the normal.
TEST(Sonar, TheNearestEchoOfAWallAcross) {
  for (const double turned : {23.0, -23.0, 10.0, 40.0}) {
    const double a = turned * M_PI / 180, p = 2.0;
    const std::string pose = std::to_string((p + 0.5) * std::cos(a)) + " " +
                             std::to_string((p + 0.5) * std::sin(a)) + " 0 0 0 " +
                             std::to_string(a);
    RayBench bench(robot_world(solid("wall", pose, box(1, 100, 100)),
                               array(cone(M_PI / 6, M_PI / 6, 9, "nearest"))),
                   "SONAR");
    EXPECT_NEAR(bench.sample<sonar_t>().range[0],
                p / std::cos(std::max(0.0, std::abs(a) - M_PI / 12)), 1e-5)
        << turned;
  }
}

// A pole of 4 cm at 2 m, anywhere in the cone.
TEST(Sonar, TheNearestEchoMissesNoPole) {
  for (const double bearing : {-14.0, -9.3, -4.7, 0.0, 3.1, 8.8, 14.0}) {
    const double a = bearing * M_PI / 180;
    const std::string pose =
        std::to_string(2 * std::cos(a)) + " " + std::to_string(2 * std::sin(a)) + " 0 0 0 0";
    RayBench bench(
        robot_world(
            solid("pole", pose, "<cylinder><radius>0.02</radius><length>1</length></cylinder>"),
            array(cone(M_PI / 6, M_PI / 36, 9, "nearest"))),
        "SONAR");
    EXPECT_NEAR(bench.sample<sonar_t>().range[0], 1.98, 1e-4) << bearing;
  }
}

// Many rays approach the mean over the cone of d / cos: d log(1 / cos) / (1 - cos), and stay within
// the cone.
TEST(Sonar, PatternIsOfEqualSolidAngles) {
  const double c = std::cos(0.5);
  RayBench average(robot_world(wall_at(2), array(cone(1.0, 1.0, 2000, "average"))), "SONAR");
  EXPECT_NEAR(average.sample<sonar_t>().range[0], 2 * std::log(1 / c) / (1 - c), 2e-4);
  // A wall that the cone's edge would just touch: beside the axis at 2 tan(0.5) + 1 mm.
  RayBench beside(
      robot_world(solid("side", "2.5 " + std::to_string(2 * std::tan(0.5) + 5.001) + " 0 0 0 0",
                        box(1, 10, 0.01)),
                  array(cone(1.0, 1.0, 2000, "nearest"), "<max>2.05</max>")),
      "SONAR");
  EXPECT_EQ(beside.sample<sonar_t>().range[0], 2.05f);
}

TEST(Sonar, ApertureComesFromRadiusAndMaximum) {
  RayBench bench(robot_world("", array("")), "SONAR");
  device_info_t info{};
  bench.device.sensor->describe(info);
  EXPECT_DOUBLE_EQ(info.fov_horizontal, 2 * std::atan(0.2));
  EXPECT_DOUBLE_EQ(info.fov_vertical, 2 * std::atan(0.2));
  EXPECT_EQ(info.range_min, 0.1);
  EXPECT_EQ(info.range_max, 5.0);
}

TEST(Sonar, FlatConesMissTheFloor) {
  // 0.25 m over the floor with 5 m range: a round cone of 30 degrees meets it, one of 4 degrees
  // upright does not.
  const std::string floor = solid("floor", "0 0 -0.75 0 0 0", box(100, 100, 1));
  RayBench round(robot_world(floor, array(cone(0.52, 0.52, 9, "nearest"))), "SONAR");
  EXPECT_LT(round.sample<sonar_t>().range[0], 2.0f);
  RayBench flat(robot_world(floor, array(cone(0.52, 0.07, 9, "nearest"))), "SONAR");
  EXPECT_EQ(flat.sample<sonar_t>().range[0], 5.0f);
}

TEST(Sonar, MinimumAndOwnLink) {
  RayBench near(robot_world(wall_at(0.05), array(cone(0.1, 0.1, 1, "nearest"))), "SONAR");
  EXPECT_EQ(near.sample<sonar_t>().range[0], 0.1f);
  const std::string shell =
      "<collision name='c'><geometry>" + box(1, 1, 1) + "</geometry></collision>";
  RayBench own(robot_world(wall_at(2), array(cone(0.1, 0.1, 1, "nearest")), "0 0 0 0 0 0", shell),
               "SONAR");
  EXPECT_EQ(own.sample<sonar_t>().range[0], 2.0f);
}

// The last millimetre of the range counts, and the first one beyond it does not.
TEST(Sonar, EchoesUpToTheMaximum) {
  for (const char* reading : {"average", "nearest"}) {
    for (const double x : {4.95, 4.999, 5.001, 5.05}) {
      RayBench bench(robot_world(wall_at(x), array(cone(0.001, 0.001, 1, reading))), "SONAR");
      EXPECT_NEAR(bench.sample<sonar_t>().range[0], std::min(x, 5.0), 1e-6) << reading << " " << x;
    }
  }
}

// Three transducers: ahead, left at y 0.2 and behind; walls 2 m ahead, 3 m left of the middle, 4 m
// behind.
const std::string kRoom = wall_at(2) + solid("left", "0 3.5 0 0 0 0", box(100, 1, 100)) +
                          solid("back", "-4.5 0 0 0 0 0", box(1, 100, 100));
const std::string kThree =
    "<ruedo:transducer>0 0 0 0 0 0</ruedo:transducer><ruedo:transducer>0 0.2 0 0 0 "
    "1.5707963267948966</ruedo:transducer>"
    "<ruedo:transducer degrees='true'>-0.1 0 0 0 0 180</ruedo:transducer>" +
    cone(0.1, 0.1, 1, "nearest");

TEST(Sonar, FiresInSequence) {
  RayBench bench(robot_world(kRoom, array(kThree + "<ruedo:order>0 2 1</ruedo:order>")), "SONAR");
  auto m = bench.sample<sonar_t>(0);
  EXPECT_THAT(m.range, testing::ElementsAre(2.0f, 5.0f, 5.0f));
  EXPECT_THAT(m.fired_utime, testing::ElementsAre(0, -1, -1));
  EXPECT_THAT(m.fresh, testing::ElementsAre(1, 0, 0));
  bench.advance(40000);
  bench.now.bodies[0].translation.x() = 0.5;  // what was measured before stays as it was
  m = bench.sample<sonar_t>(1);
  EXPECT_THAT(m.range, testing::ElementsAre(2.0f, 5.0f, testing::FloatEq(4.4f)));
  EXPECT_THAT(m.fired_utime, testing::ElementsAre(0, -1, 40000));
  EXPECT_THAT(m.fresh, testing::ElementsAre(0, 0, 1));
  bench.advance(40000);
  m = bench.sample<sonar_t>(2);
  EXPECT_THAT(m.range, testing::ElementsAre(2.0f, testing::FloatEq(2.8f), testing::FloatEq(4.4f)));
  bench.advance(40000);
  m = bench.sample<sonar_t>(3);
  EXPECT_THAT(m.range, testing::ElementsAre(1.5f, testing::FloatEq(2.8f), testing::FloatEq(4.4f)));
  EXPECT_THAT(m.fired_utime, testing::ElementsAre(120000, 80000, 40000));
}

TEST(Sonar, FiresAllAtOnce) {
  RayBench bench(robot_world(kRoom, array(kThree + "<ruedo:firing>all</ruedo:firing>")), "SONAR");
  const auto m = bench.sample<sonar_t>();
  EXPECT_THAT(m.range, testing::ElementsAre(2.0f, testing::FloatEq(2.8f), testing::FloatEq(3.9f)));
  EXPECT_THAT(m.fresh, testing::ElementsAre(1, 1, 1));
  device_info_t info{};
  bench.device.sensor->describe(info);
  ASSERT_EQ(info.nelements, 3);
  EXPECT_NEAR(info.element_pose[1][1], 0.2, 1e-15);
  EXPECT_NEAR(info.element_pose[1][5], M_PI / 2, 1e-15);
}

TEST(Sonar, LostEchoes) {
  const auto look = [](const std::string& surface, const std::string& ours, double yaw) {
    RayBench bench(robot_world(wall_at(2, surface), array(cone(0.1, 0.1, 1, "nearest") + ours),
                               "0 0 0 0 0 " + std::to_string(yaw)),
                   "SONAR");
    return static_cast<double>(bench.sample<sonar_t>().range[0]);
  };
  EXPECT_EQ(look("<ruedo:acoustic_reflectance>0.05</ruedo:acoustic_reflectance>", "", 0), 2.0);
  EXPECT_EQ(look("<ruedo:acoustic_reflectance>0.049</ruedo:acoustic_reflectance>", "", 0), 5.0);
  const std::string specular = "<ruedo:specular_angle>0.4</ruedo:specular_angle>";
  EXPECT_NEAR(look("", specular, 0.39), 2 / std::cos(0.39 - 0.05), 1e-6);
  EXPECT_EQ(look("", specular, 0.46), 5.0);
  EXPECT_NEAR(look("", "", 1.1), 2 / std::cos(1.1 - 0.05), 1e-6);  // off by default
}

TEST(Sonar, CrossTalkGivesTheNearerEchoOfTheOneBefore) {
  RayBench bench(robot_world(kRoom, array(kThree + "<ruedo:cross_talk>0.3</ruedo:cross_talk>")),
                 "SONAR");
  int heard = 0;
  const int rounds = 3000;
  for (int k = 0; k < 3 * rounds; ++k) {
    const auto m = bench.sample<sonar_t>(k);
    EXPECT_EQ(m.range[0], 2.0f);  // nothing is nearer
    if (k % 3 == 1) {
      EXPECT_TRUE(m.range[1] == 2.8f || m.range[1] == 2.0f) << m.range[1];
      heard += m.range[1] == 2.0f;
    }
  }
  EXPECT_NEAR(heard, 0.3 * rounds, 3.29 * std::sqrt(0.3 * 0.7 * rounds));
}

TEST(Sonar, CrossTalkIsOffByDefault) {
  RayBench bench(robot_world(kRoom, array(kThree)), "SONAR");
  for (int k = 0; k < 900; ++k) {
    const auto m = bench.sample<sonar_t>(k);
    if (k % 3 != 1) continue;
    EXPECT_EQ(m.range[1], 2.8f);  // the one that fired before has its echo at 2 m
  }
}

TEST(Sonar, NoiseAgainstItsDistribution) {
  const std::string noise =
      "<noise><type>gaussian</type><mean>0.02</mean><stddev>0.05</stddev></noise>";
  RayBench bench(robot_world(wall_at(2), array(cone(0.1, 0.1, 1, "nearest") + noise)), "SONAR");
  double sum = 0, squares = 0;
  const int n = 10000;
  for (int k = 0; k < n; ++k) {
    const double e = static_cast<double>(bench.sample<sonar_t>(k).range[0]) - 2.0;
    sum += e;
    squares += e * e;
  }
  const double mean = sum / n, sigma = std::sqrt(squares / n - mean * mean);
  EXPECT_NEAR(mean, 0.02, 3.29 * 0.05 / std::sqrt(n));
  EXPECT_NEAR(sigma, 0.05, 3.29 * 0.05 / std::sqrt(2.0 * n));

  RayBench empty(robot_world("", array(cone(0.1, 0.1, 1, "nearest") + noise)), "SONAR");
  for (int k = 0; k < 20; ++k)
    EXPECT_EQ(empty.sample<sonar_t>(k).range[0], 5.0f);  // no echo, no noise

  SensorBench::Options off;
  off.noise = false;
  RayBench silent(
      robot_world(
          kRoom,
          array(kThree + "<ruedo:firing>all</ruedo:firing><ruedo:cross_talk>1</ruedo:cross_talk>" +
                noise)),
      "SONAR", off);
  RayBench ideal(robot_world(kRoom, array(kThree + "<ruedo:firing>all</ruedo:firing>")), "SONAR");
  EXPECT_EQ(silent.sample<sonar_t>().range, ideal.sample<sonar_t>().range);
}

TEST(Sonar, NoiseIsTheDevicesOwnAndOfItsSample) {
  const auto draw = [](uint64_t seed, const char* name, int64_t sample) {
    SensorBench::Options options;
    options.seed = seed;
    options.named_device = name;
    RayBench bench(
        robot_world(wall_at(2), array(cone(0.1, 0.1, 1, "nearest") +
                                      "<noise><type>gaussian</type><stddev>0.05</stddev></noise>")),
        "SONAR", options);
    return bench.sample<sonar_t>(sample).range[0];
  };
  EXPECT_EQ(draw(1, "SONAR", 0), draw(1, "SONAR", 0));
  EXPECT_NE(draw(1, "SONAR", 0), draw(2, "SONAR", 0));
  EXPECT_NE(draw(1, "SONAR", 0), draw(1, "SONAR2", 0));
  EXPECT_NE(draw(1, "SONAR", 0), draw(1, "SONAR", 1));
}

struct Refused {
  const char* what;
  std::string sensor;
  const char* message;
};

TEST(Sonar, RefusesInvalidElements) {
  const std::string good = "<min>0.1</min><max>5</max>";
  const Refused table[] = {
      {"no sonar", "<sensor name='SONAR' type='sonar'/>", "needs a <sonar>"},
      {"no maximum", array("", "<min>0.1</min>"), "needs <max>"},
      {"range swapped", array("", "<min>5</min><max>1</max>"), "<max> 1 must be above <min> 5"},
      {"tiny", array("", "<min>2e-8</min><max>1e-8</max>"),
       "<max> 1e-08 must be above <min> 2e-08"},
      {"negative minimum", array("", "<min>-1</min><max>1</max>"), "min"},
      {"other geometry", array("", good + "<geometry>cube</geometry>"), "sphere"},
      {"no rays", array("<ruedo:rays>0</ruedo:rays>"), "rays"},
      {"half a ray", array("<ruedo:rays>4.5</ruedo:rays>"), "rays"},
      {"aperture in degrees", array("<ruedo:horizontal_aperture>30</ruedo:horizontal_aperture>"),
       "horizontal_aperture"},
      {"other reading", array("<ruedo:reading>median</ruedo:reading>"), "average"},
      {"other firing", array("<ruedo:firing>random</ruedo:firing>"), "sequence"},
      {"pose of five numbers", array("<ruedo:transducer>0 0 0 0 0</ruedo:transducer>"),
       "transducer"},
      {"order of another", array(kThree + "<ruedo:order>0 1 3</ruedo:order>"), "0 to 2"},
      {"order without one", array(kThree + "<ruedo:order>0 1</ruedo:order>"),
       "transducer 2 never fires"},
      {"order of a half", array(kThree + "<ruedo:order>0 1 1.5</ruedo:order>"), "0 to 2"},
      {"angle beyond grazing", array("<ruedo:specular_angle>2</ruedo:specular_angle>"),
       "specular_angle"},
      {"probability", array("<ruedo:cross_talk>1.5</ruedo:cross_talk>"), "cross_talk"},
      {"negative sigma", array("<noise><type>gaussian</type><stddev>-1</stddev></noise>"),
       "stddev"},
      {"misspelt", array("<ruedo:ray>3</ruedo:ray>"), "ruedo:rays"},
  };
  for (const Refused& c : table) {
    try {
      RayBench bench(robot_world("", c.sensor), "SONAR");
      ADD_FAILURE() << c.what << ": not refused";
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr(c.message)) << c.what;
      EXPECT_GT(error.source().line, 0) << c.what;
    }
  }
}

}  // namespace
}  // namespace ruedo
