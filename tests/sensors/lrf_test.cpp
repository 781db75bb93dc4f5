// The laser range finder against scenes worked out by hand; its limits, noise, mirrors and sweep;
// refused configurations.
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "ray_bench.h"
#include "ruedo/device_info_t.hpp"
#include "ruedo/lidar_t.hpp"
#include "ruedo/planar_lidar_t.hpp"

namespace ruedo {
namespace {

using test::box;
using test::RayBench;
using test::robot_world;
using test::SensorBench;
using test::solid;

constexpr float kInfinity = std::numeric_limits<float>::infinity();

std::string lrf(const std::string& scan, const std::string& range = "<min>0.1</min><max>8</max>",
                const std::string& more = "", const std::string& noise = "",
                const std::string& name = "LRF") {
  return "<sensor name='" + name + "' type='gpu_lidar'><lidar><scan>" + scan + "</scan><range>" +
         range + "</range>" + noise + "</lidar>" + more + "</sensor>";
}

std::string horizontal(int samples, double min_angle, double max_angle,
                       const std::string& more = "") {
  return "<horizontal><samples>" + std::to_string(samples) + "</samples><min_angle>" +
         std::to_string(min_angle) + "</min_angle><max_angle>" + std::to_string(max_angle) +
         "</max_angle>" + more + "</horizontal>";
}

std::string gaussian(const std::string& parameters) {
  return "<noise><type>gaussian</type>" + parameters + "</noise>";
}

const std::string kAhead = horizontal(1, 0, 0);
const std::string kHalfTurn =
    "<horizontal><samples>181</samples><min_angle>-1.5707963267948966</"
    "min_angle><max_angle>1.5707963267948966</max_angle></horizontal>";

// A wall whose face is the plane x = 3, and a post of radius 0.5 at (0, 4): ray i looks along (i -
// 90) degrees.
TEST(Lrf, WallAndPostAsComputedByHand) {
  RayBench bench(
      robot_world(solid("wall", "3.5 0 0 0 0 0", box(1, 100, 2)) +
                      solid("post", "0 4 0 0 0 0",
                            "<cylinder><radius>0.5</radius><length>2</length></cylinder>"),
                  lrf(kHalfTurn)),
      "LRF");
  const auto scan = bench.sample<planar_lidar_t>();
  ASSERT_EQ(scan.nranges, 181);
  EXPECT_EQ(scan.rad0, static_cast<float>(-M_PI / 2));
  EXPECT_EQ(scan.radstep, static_cast<float>(M_PI / 180));
  for (int i = 0; i < 181; ++i) {
    const double angle = (i - 90) * M_PI / 180;
    const double to_wall = 3 / std::cos(angle),
                 off = 4 * std::cos(angle);  // distance of the post's axis from the ray
    double expected = to_wall <= 8 ? to_wall : static_cast<double>(kInfinity);
    double cosine = std::cos(angle);
    if (angle > 0 && std::abs(off) < 0.5) {
      expected = 4 * std::sin(angle) - std::sqrt(0.25 - off * off);
      cosine = std::sqrt(1 - 4 * off * off);
    }
    if (std::isinf(expected)) {
      EXPECT_EQ(scan.ranges[i], kInfinity) << i;
      EXPECT_EQ(scan.intensities[i], 0.0f);
    } else {
      EXPECT_NEAR(scan.ranges[i], expected, 4e-7 * expected) << i;
      EXPECT_NEAR(scan.intensities[i], cosine, 1e-6) << i;
    }
  }
}

TEST(Lrf, LooksFromItsOwnPlace) {
  // The robot at (1, 2), heading 90 degrees; the device 0.5 m ahead in it, at (1, 2.5), looking
  // along y to the wall at 6.
  RayBench bench(robot_world(solid("wall", "0 7 0 0 0 0", box(100, 2, 2)),
                             "<sensor name='LRF' type='ray'><pose>0.5 0 0 0 0 0</pose><ray><scan>" +
                                 kAhead + "</scan><range><max>8</max></range></ray></sensor>",
                             "1 2 0 0 0 1.5707963267948966"),
                 "LRF");
  EXPECT_EQ(bench.sample<planar_lidar_t>().ranges[0], 3.5f);
  bench.now.bodies[0].translation.y() = 3;
  EXPECT_EQ(bench.sample<planar_lidar_t>().ranges[0], 2.5f);
}

TEST(Lrf, Limits) {
  const auto range_at = [](double wall, const std::string& limits) {
    RayBench bench(
        robot_world(solid("wall", std::to_string(wall + 0.5) + " 0 0 0 0 0", box(1, 1, 1)),
                    lrf(kAhead, limits)),
        "LRF");
    return bench.sample<planar_lidar_t>().ranges[0];
  };
  const std::string limits = "<min>0.5</min><max>4</max>";
  EXPECT_EQ(range_at(0.5, limits), 0.5f);
  EXPECT_EQ(range_at(0.49, limits), -kInfinity);
  EXPECT_EQ(range_at(-0.2, limits), -kInfinity);  // within the box
  EXPECT_EQ(range_at(-0.2, "<min>0</min><max>4</max>"), 0.0f);
  EXPECT_EQ(range_at(4, limits), 4.0f);
  EXPECT_EQ(range_at(4.01, limits), kInfinity);
  EXPECT_EQ(range_at(1.234, limits + "<resolution>0.05</resolution>"), 1.25f);
}

TEST(Lrf, OwnLinkIsSeenOnlyWhenAsked) {
  const std::string shell = "<collision name='c'><pose>1 0 0 0 0 0</pose><geometry>" +
                            box(1, 1, 1) + "</geometry></collision>";
  RayBench blind(robot_world("", lrf(kAhead), "0 0 0 0 0 0", shell), "LRF");
  EXPECT_EQ(blind.sample<planar_lidar_t>().ranges[0], kInfinity);
  RayBench seeing(
      robot_world("", lrf(kAhead, "<max>8</max>", "<ruedo:own_link>true</ruedo:own_link>"),
                  "0 0 0 0 0 0", shell),
      "LRF");
  EXPECT_EQ(seeing.sample<planar_lidar_t>().ranges[0], 0.5f);
}

TEST(Lrf, VisualsWhenAsked) {
  const std::string thing =
      "<model name='m'><static>true</static><link name='l'><collision name='c'><pose>5 0 0 0 0 "
      "0</pose><geometry>" +
      box(2, 2, 2) + "</geometry></collision><visual name='v'><pose>3 0 0 0 0 0</pose><geometry>" +
      box(2, 2, 2) + "</geometry></visual></link></model>";
  RayBench collisions(robot_world(thing, lrf(kAhead)), "LRF");
  EXPECT_EQ(collisions.sample<planar_lidar_t>().ranges[0], 4.0f);
  RayBench visuals(
      robot_world(thing, lrf(kAhead, "<max>8</max>", "<ruedo:hits>visuals</ruedo:hits>")), "LRF");
  EXPECT_EQ(visuals.sample<planar_lidar_t>().ranges[0], 2.0f);
}

TEST(Lrf, ReflectanceGivesIntensityOrNoReturn) {
  const auto look = [](const std::string& reflectance) {
    RayBench bench(
        robot_world(solid("wall", "2.5 0 0 0 0 0", box(1, 9, 9),
                          "<ruedo:laser_reflectance>" + reflectance + "</ruedo:laser_reflectance>"),
                    lrf(horizontal(1, 0.5, 0.5))),
        "LRF");
    return bench.sample<planar_lidar_t>();
  };
  EXPECT_NEAR(look("0.4").intensities[0], 0.4 * std::cos(0.5), 1e-6);
  EXPECT_NEAR(look("0.02").ranges[0], 2 / std::cos(0.5), 1e-6);
  EXPECT_EQ(look("0.019").ranges[0], kInfinity);
  EXPECT_EQ(look("0.019").intensities[0], 0.0f);
}

// A mirror in the plane through (2, 0) at 45 degrees sends the ray along y, to a wall at y = 3: 2 +
// 3 m.
TEST(Lrf, MirrorsAreFollowed) {
  const auto look = [](const std::string& mirror) {
    RayBench bench(robot_world(solid("mirror", "2 0 0 0 0 0.7853981633974483", box(2, 1e-4, 2),
                                     "<ruedo:laser_mirror>" + mirror + "</ruedo:laser_mirror>") +
                                   solid("wall", "2 3.5 0 0 0 0", box(9, 1, 9),
                                         "<ruedo:laser_reflectance>0.5</ruedo:laser_reflectance>"),
                               lrf(kAhead)),
                   "LRF");
    return bench.sample<planar_lidar_t>();
  };
  // The mirror's face is half its thickness nearer: x = 2 - 0.5e-4 sqrt(2), the way up longer by as
  // much... and y the same.
  const auto bright = look("1");
  EXPECT_NEAR(bright.ranges[0], 5.0 - 0.5e-4 * std::sqrt(2.0), 1e-6);
  EXPECT_NEAR(bright.intensities[0], 0.5, 1e-6);
  EXPECT_NEAR(look("0.99").intensities[0], 0.5 * 0.99 * 0.99, 1e-6);
  EXPECT_NEAR(look("0.9").ranges[0], 2.0 - 0.5e-4 * std::sqrt(2.0),
              1e-6);  // a tenth comes back from the mirror itself
  EXPECT_NEAR(look("0.9").intensities[0], 0.1 * std::sqrt(0.5), 1e-6);
}

TEST(Lrf, FacingMirrorsEnd) {
  const std::string mirror = "<ruedo:laser_mirror>1</ruedo:laser_mirror>";
  RayBench bench(robot_world(solid("a", "1.5 0 0 0 0 0", box(1, 9, 9), mirror) +
                                 solid("b", "-1.5 0 0 0 0 0", box(1, 9, 9), mirror),
                             lrf(kAhead)),
                 "LRF");
  EXPECT_EQ(bench.sample<planar_lidar_t>().ranges[0], kInfinity);
}

TEST(Lrf, LayersAreALidar) {
  // Three layers at -45, 0, 45 degrees over a floor at z = -1 and a wall at x = 3; two columns at 0
  // and 0.1 rad.
  RayBench bench(
      robot_world(solid("wall", "3.5 0 0 0 0 0", box(1, 100, 1.5)) +
                      solid("floor", "0 0 -1.5 0 0 0", box(100, 100, 1)),
                  lrf(horizontal(2, 0, 0.1) +
                      "<vertical><samples>3</samples><min_angle>-0.7853981633974483</min_angle>"
                      "<max_angle>0.7853981633974483</max_angle></vertical>")),
      "LRF");
  const auto scan = bench.sample<lidar_t>();
  ASSERT_EQ(scan.nlayers, 3);
  ASSERT_EQ(scan.ncolumns, 2);
  EXPECT_NEAR(scan.ranges[0], std::sqrt(2.0), 1e-6);
  EXPECT_NEAR(scan.ranges[1], std::sqrt(2.0), 1e-6);
  EXPECT_NEAR(scan.ranges[2], 3.0, 1e-6);
  EXPECT_NEAR(scan.ranges[3], 3.0 / std::cos(0.1), 1e-6);
  EXPECT_EQ(scan.ranges[4], kInfinity);
  EXPECT_FLOAT_EQ(scan.elevation0, -M_PI / 4);
  EXPECT_FLOAT_EQ(scan.elevation_step, M_PI / 4);
  EXPECT_FLOAT_EQ(scan.azimuth_step, 0.1);
  device_info_t info{};
  bench.device.sensor->describe(info);
  EXPECT_EQ(info.width, 2);
  EXPECT_EQ(info.height, 3);
  EXPECT_EQ(info.range_max, 8.0);
  EXPECT_NEAR(info.fov_vertical, M_PI / 2, 1e-12);
}

TEST(Lrf, ResolutionMultipliesTheRays) {
  RayBench bench(
      robot_world("", lrf(horizontal(10, -1, 1, "<resolution>2.5</resolution>"), "<max>8</max>",
                          "<ruedo:intensities>false</ruedo:intensities>")),
      "LRF");
  const auto scan = bench.sample<planar_lidar_t>();
  EXPECT_EQ(scan.nranges, 25);
  EXPECT_EQ(scan.nintensities, 0);
  EXPECT_FLOAT_EQ(scan.radstep, 2.0 / 24);
}

// As in a file that is often copied: one layer of a hundredth of a ray, and a little more than a
// full turn.
TEST(Lrf, OneRayAtLeast) {
  RayBench bench(
      robot_world(
          "",
          lrf(horizontal(90, -3.15, 3.15) +
              "<vertical><samples>1</samples><resolution>0.01</resolution><min_angle>0</min_angle>"
              "<max_angle>0</max_angle></vertical>")),
      "LRF");
  EXPECT_EQ(bench.sample<planar_lidar_t>().nranges, 90);
}

// As Gazebo reads them: whole samples, and layers from whichever side.
TEST(Lrf, OddNumbersAreRepaired) {
  RayBench bench(
      robot_world("", lrf("<horizontal><samples>66.7</samples><min_angle>-1</min_angle><max_angle>1"
                          "</max_angle></horizontal><vertical><samples>3</samples><min_angle>0.2"
                          "</min_angle><max_angle>-0.3</max_angle></vertical>")),
      "LRF");
  const auto scan = bench.sample<lidar_t>();
  EXPECT_EQ(scan.ncolumns, 66);
  EXPECT_EQ(scan.nlayers, 3);
  EXPECT_FLOAT_EQ(scan.elevation0, -0.3);
  EXPECT_FLOAT_EQ(scan.elevation_step, 0.25);
}

TEST(Lrf, FullCircle) {
  RayBench bench(
      robot_world(solid("ring", "0 0 0 0 0 0", "<sphere><radius>0.2</radius></sphere>") +
                      solid("wall", "-2.5 0 0 0 0 0", box(1, 1, 1)),
                  "<sensor name='LRF' type='lidar'><pose>0 0 0 0 0 0</pose><lidar><scan>" +
                      horizontal(360, 0, 6.2657) +
                      "</scan><range><max>8</max></range></lidar></sensor>",
                  "0 0 0.4 0 0 0"),
      "LRF");
  const auto scan = bench.sample<planar_lidar_t>();
  EXPECT_EQ(scan.ranges[0], kInfinity);
  EXPECT_NEAR(scan.ranges[180], 2.0, 1e-6);
}

// Moving at 5 m/s towards a wall at x = 10: with a sweep of 0.1 s the first ray starts 0.5 m
// further back.
TEST(Lrf, SweepTakesTime) {
  RayBench bench(robot_world(solid("wall", "10.5 0 0 0 0 0", box(1, 9, 9)),
                             lrf(horizontal(3, 0, 0.0), "<max>20</max>",
                                 "<ruedo:sweep_time>0.1</ruedo:sweep_time>")),
                 "LRF");
  EXPECT_EQ(bench.sample<planar_lidar_t>(0).ranges[0],
            10.0f);  // nothing is known of before the start
  for (int i = 0; i < 40; ++i) {
    bench.advance(5000);
    bench.now.bodies[0].translation.x() = 5 * 1e-6 * static_cast<double>(bench.now.time);
    if (i < 39) bench.observe();
  }
  const auto scan = bench.sample<planar_lidar_t>(1);  // at 0.2 s the device is at x = 1
  EXPECT_NEAR(scan.ranges[0], 9.5, 1e-6);
  EXPECT_NEAR(scan.ranges[1], 9.25, 1e-6);
  EXPECT_NEAR(scan.ranges[2], 9.0, 1e-6);
}

// Mean and sigma of 18 100 draws, in their 99.9 % intervals; and none of it with --no-noise, to the
// last bit.
TEST(Lrf, NoiseAgainstItsDistribution) {
  const std::string room =
      solid("floor", "0 0 -5.5 0 0 0", box(100, 100, 1));  // straight down: 5 m
  const std::string pose = "0 0 0 0 1.5707963267948966 0";
  const std::string noisy = lrf(horizontal(181, 0, 0.0), "<max>8</max>", "",
                                gaussian("<mean>0.1</mean><stddev>0.05</stddev>"));
  RayBench bench(robot_world(room, noisy, pose), "LRF");
  double sum = 0, squares = 0;
  const int n = 181 * 100;
  for (int k = 0; k < 100; ++k)
    for (const float range : bench.sample<planar_lidar_t>(k).ranges) {
      const double e = static_cast<double>(range) - 5.0;
      sum += e;
      squares += e * e;
    }
  const double mean = sum / n, sigma = std::sqrt(squares / n - mean * mean);
  EXPECT_NEAR(mean, 0.1, 3.29 * 0.05 / std::sqrt(n));
  EXPECT_NEAR(sigma, 0.05, 3.29 * 0.05 / std::sqrt(2.0 * n));

  RayBench ideal(robot_world(room, lrf(horizontal(181, 0, 0.0), "<max>8</max>"), pose), "LRF");
  SensorBench::Options off;
  off.noise = false;
  RayBench silent(
      robot_world(room,
                  lrf(horizontal(181, 0, 0.0), "<max>8</max><resolution>0.3</resolution>",
                      "<ruedo:bearing_noise>0.1</ruedo:bearing_noise>",
                      gaussian("<mean>0.1</mean><stddev>0.05</stddev><bias_mean>1</bias_mean>")),
                  pose),
      "LRF", off);
  EXPECT_EQ(silent.sample<planar_lidar_t>().ranges, ideal.sample<planar_lidar_t>().ranges);
}

TEST(Lrf, BearingNoiseTurnsTheRay) {
  // At 60 degrees to a wall at x = 2: r = 2 / cos(a); dr/da = r tan(a) = 4 * 1.732.
  RayBench bench(robot_world(solid("wall", "2.5 0 0 0 0 0", box(1, 99, 9)),
                             lrf(horizontal(1, M_PI / 3, M_PI / 3), "<max>8</max>",
                                 "<ruedo:bearing_noise>0.001</ruedo:bearing_noise>")),
                 "LRF");
  double squares = 0;
  const int n = 4000;
  for (int k = 0; k < n; ++k)
    squares += std::pow(static_cast<double>(bench.sample<planar_lidar_t>(k).ranges[0]) - 4.0, 2);
  const double expected = 0.001 * 4 * std::sqrt(3.0);
  EXPECT_NEAR(std::sqrt(squares / n), expected, 3.29 * expected / std::sqrt(2.0 * n) + 2e-5);
}

TEST(Lrf, NoiseIsTheDevicesOwnAndOfItsSample) {
  const std::string room = solid("wall", "3.5 0 0 0 0 0", box(1, 100, 2));
  const std::string noise = gaussian("<stddev>0.05</stddev>");
  const auto scan = [&](const std::string& things, uint64_t seed, const char* name,
                        int64_t sample) {
    SensorBench::Options options;
    options.seed = seed;
    options.named_device = name;
    RayBench bench(robot_world(things, lrf(horizontal(20, -0.5, 0.5), "<max>8</max>", "", noise)),
                   "LRF", options);
    return bench.sample<planar_lidar_t>(sample).ranges;
  };
  const auto first = scan(room, 1, "LRF", 0);
  EXPECT_EQ(first, scan(room, 1, "LRF", 0));
  EXPECT_NE(first, scan(room, 2, "LRF", 0));
  EXPECT_NE(first, scan(room, 1, "LRF2", 0));
  EXPECT_NE(first, scan(room, 1, "LRF", 1));
  // A post in front of the first ray changes the first range and no other.
  auto with_post = scan(room + solid("post", "2 -1.0926 0 0 0 0", box(0.1, 0.1, 2)), 1, "LRF", 0);
  EXPECT_LT(with_post[0], 2.6f);
  with_post[0] = first[0];
  EXPECT_EQ(with_post, first);
  // Nor does a ray without a return.
  auto with_black = scan(room + solid("black", "2 -1.0926 0 0 0 0", box(0.1, 0.1, 2),
                                      "<ruedo:laser_reflectance>0</ruedo:laser_reflectance>"),
                         1, "LRF", 0);
  EXPECT_EQ(with_black[0], kInfinity);
  with_black[0] = first[0];
  EXPECT_EQ(with_black, first);
}

TEST(Lrf, ManyRaysEqualSingleRays) {
  const std::string things =
      solid("a", "3 1 0 0.2 0.3 0.4", box(1, 2, 2)) +
      solid("b", "2 -2 0 0 0 0", "<sphere><radius>0.7</radius></sphere>") +
      solid("c", "-2 0 0 0 0 0", "<cylinder><radius>0.7</radius><length>1</length></cylinder>");
  RayBench many(robot_world(things, lrf(horizontal(63, -3.1, 3.1))), "LRF");
  const auto all = many.sample<planar_lidar_t>();
  for (int i = 0; i < 63; ++i) {
    const Vec3 d(std::cos(-3.1 + i * (6.2 / 62)), std::sin(-3.1 + i * (6.2 / 62)), 0);
    const scene::Hit hit = many.scene->cast({Vec3::Zero(), d, 8.0});
    EXPECT_EQ(all.ranges[i], static_cast<float>(hit.range)) << i;
  }
}

struct Refused {
  const char* what;
  std::string sensor;
  const char* message;
};

TEST(Lrf, RefusesInvalidElements) {
  const std::string good_range = "<min>0.1</min><max>8</max>";
  const Refused table[] = {
      {"no lidar", "<sensor name='LRF' type='lidar'/>", "needs a <lidar>"},
      {"no scan", lrf(""), "needs <scan><horizontal>"},
      {"no range", lrf(kAhead, ""), "needs <range> with <max>"},
      {"fewer than no rays", lrf(horizontal(-1, -1, 1)), "samples"},
      {"too many", lrf(horizontal(1000001, -1, 1)), "samples"},
      {"too many in all",
       lrf(horizontal(5000, -1, 1) + "<vertical><samples>5000</samples><min_angle>0</"
                                     "min_angle><max_angle>1</max_angle></vertical>"),
       "1000000 rays"},
      {"resolution below 0", lrf(horizontal(1, -1, 1, "<resolution>-0.1</resolution>")),
       "resolution"},
      {"angles swapped", lrf(horizontal(5, 1, -1)), "<max_angle> -1 is below <min_angle> 1"},
      {"two turns", lrf(horizontal(5, -6, 6)), "more than a full turn"},
      {"angle in degrees", lrf(horizontal(5, -90, 90)), "min_angle"},
      {"steeper than up",
       lrf(kAhead + "<vertical><samples>2</samples><min_angle>0</min_angle><max_angle>2</"
                    "max_angle></vertical>"),
       "max_angle"},
      {"range swapped", lrf(kAhead, "<min>8</min><max>1</max>"), "<max> 1 must be above <min> 8"},
      {"tiny", lrf(kAhead, "<min>2e-8</min><max>1e-8</max>"),
       "<max> 1e-08 must be above <min> 2e-08"},
      {"negative range", lrf(kAhead, "<min>-1</min><max>1</max>"), "min"},
      {"range of no number", lrf(kAhead, "<min>0</min><max>nan</max>"), "max"},
      {"negative sigma", lrf(kAhead, good_range, "", gaussian("<stddev>-1</stddev>")), "stddev"},
      {"unknown noise", lrf(kAhead, good_range, "", "<noise><type>pink</type></noise>"), "pink"},
      {"unknown hits", lrf(kAhead, good_range, "<ruedo:hits>both</ruedo:hits>"), "visuals"},
      {"negative sweep", lrf(kAhead, good_range, "<ruedo:sweep_time>-1</ruedo:sweep_time>"),
       "sweep_time"},
      {"misspelt", lrf(kAhead, good_range, "<ruedo:swep_time>1</ruedo:swep_time>"),
       "ruedo:sweep_time"},
  };
  for (const Refused& c : table) {
    try {
      RayBench bench(robot_world("", c.sensor), "LRF");
      ADD_FAILURE() << c.what << ": not refused";
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr(c.message)) << c.what;
      EXPECT_GT(error.source().line, 0) << c.what;
    }
  }
}

}  // namespace
}  // namespace ruedo
