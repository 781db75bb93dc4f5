// Philox against the known answers of its authors; the normal quantile against values computed with
// 60 digits; streams against what "independent" and "keyed" mean.
#include "ruedo/random.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include <gtest/gtest.h>

namespace ruedo {
namespace {

using Block = std::array<uint32_t, 4>;

// Random123's kat_vectors, philox4x32 with 10 rounds.
TEST(Philox, KnownAnswers) {
  EXPECT_EQ(philox4x32({0, 0, 0, 0}, {0, 0}),
            (Block{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}));
  const uint32_t f = 0xffffffff;
  EXPECT_EQ(philox4x32({f, f, f, f}, {f, f}),
            (Block{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}));
  EXPECT_EQ(philox4x32({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0}),
            (Block{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}));
}

TEST(RandomStream, WalksThroughTheBlocks) {
  RandomStream stream(0x299f31d0'a4093822u, 0x03707344'13198a2eu);
  for (uint32_t block = 0; block < 3; ++block) {
    const Block expected = philox4x32({block, 0, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0});
    for (const uint32_t word : expected) EXPECT_EQ(stream.bits(), word);
  }
}

TEST(RandomStream, UniformTakesThe53HighestBitsOfTwoWords) {
  // The first two words of the zero key and counter, by hand: floor(0x6627e8d5e169c58d / 2^11) /
  // 2^53.
  RandomStream stream(0, 0);
  EXPECT_EQ(stream.uniform(), static_cast<double>(0x6627e8d5e169c58dull >> 11) * 0x1p-53);
}

TEST(RandomStream, UniformIsUniform) {
  RandomStream stream(7, 3);
  constexpr int kDraws = 100000, kCells = 100;
  std::vector<int> count(kCells);
  for (int i = 0; i < kDraws; ++i) {
    const double u = stream.uniform();
    ASSERT_GE(u, 0.0);
    ASSERT_LT(u, 1.0);
    ++count[u * kCells];
  }
  double chi2 = 0.0;
  for (const int n : count) chi2 += std::pow(n - kDraws / kCells, 2) / (kDraws / kCells);
  // 99 degrees of freedom: 99.9 % below 148.2, 0.1 % below 61.1.
  EXPECT_LT(chi2, 148.2);
  EXPECT_GT(chi2, 61.1);
}

// Values by mpmath with 60 digits; p is exact in binary.
TEST(NormalQuantile, AgreesWithHighPrecision) {
  struct Case {
    double p, x;
  };
  const Case cases[] = {
      {0.5, 0.0},
      {0.5 + 0x1p-40, 2.279765135091111462694e-12},
      {0.5625, 0.1573106846101706955224},
      {0.75, 0.6744897501960817432022},
      {0.875, 1.150349380376008178297},
      {0x1p-4, -1.534120544352546311708},
      {0x1p-10, -3.097269078198784462365},
      {1 - 0x1p-10, 3.097269078198784462365},
      {0x1p-30, -6.009353565530743893181},
      {0x1p-36, -6.651035379893010546658},  // the two sides of r = 5
      {0x1p-37, -6.752300431407014964608},
      {0x1p-53, -8.209536151601386855631},
      {0x1p-100, -11.48454043497303780722},
      {0x1p-1000, -37.11101193716479141011},
  };
  for (const Case& c : cases) EXPECT_NEAR(normal_quantile(c.p), c.x, 1e-15 * std::abs(c.x)) << c.p;
}

TEST(NormalQuantile, IsOddAboutOneHalf) {
  for (double p = 0x1p-12; p < 0.5; p += 0x1p-12)
    EXPECT_EQ(normal_quantile(p), -normal_quantile(1.0 - p)) << p;
}

// Drawing many at once gives the same values, wherever in the stream they begin and end, and the
// stream continues normally.
TEST(RandomStream, ManyGaussiansAreTheSameOneByOne) {
  for (const int before : {0, 1, 2, 3, 4, 5}) {
    for (const size_t count : {0u, 1u, 2u, 3u, 7u, 8u, 9u, 24u, 31u, 32u, 33u, 64u, 181u, 1000u}) {
      RandomStream singly(0x1234567890abcdefu, ~uint64_t{6}),
          many(0x1234567890abcdefu, ~uint64_t{6});
      for (int i = 0; i < before; ++i) EXPECT_EQ(singly.bits(), many.bits());
      std::vector<double> draws(count);
      many.gaussians(draws);
      for (size_t i = 0; i < count; ++i)
        ASSERT_EQ(singly.gaussian(), draws[i])
            << before << " bits before, draw " << i << " of " << count;
      EXPECT_EQ(singly.bits(), many.bits());
    }
  }
}

// Kolmogorov-Smirnov against the normal distribution, and the first four moments.
TEST(RandomStream, GaussianIsNormal) {
  constexpr int kDraws = 100000;
  std::vector<double> draws(kDraws);
  RandomStream stream(0x1234567890abcdefu, 42);
  double sum = 0, sum2 = 0, sum3 = 0, sum4 = 0;
  for (double& g : draws) {
    g = stream.gaussian();
    sum += g;
    sum2 += g * g;
    sum3 += g * g * g;
    sum4 += g * g * g * g;
  }
  const double root = std::sqrt(kDraws);
  constexpr double k999 = 3.29;  // two-sided 99.9 %
  EXPECT_LT(std::abs(sum / kDraws), k999 * 1.0 / root);
  EXPECT_LT(std::abs(sum2 / kDraws - 1.0), k999 * std::sqrt(2.0) / root);
  EXPECT_LT(std::abs(sum3 / kDraws), k999 * std::sqrt(15.0) / root);
  EXPECT_LT(std::abs(sum4 / kDraws - 3.0), k999 * std::sqrt(96.0) / root);
  std::sort(draws.begin(), draws.end());
  double distance = 0.0;
  for (int i = 0; i < kDraws; ++i) {
    const double cdf = 0.5 * std::erfc(-draws[i] / std::sqrt(2.0));
    distance = std::max(
        {distance, std::abs(cdf - double(i) / kDraws), std::abs(cdf - double(i + 1) / kDraws)});
  }
  EXPECT_LT(distance * root, 1.95);  // 99.9 %
}

TEST(RandomSource, IsKeyedBySeedRobotDeviceAndSample) {
  const auto first = [](uint64_t seed, const char* robot, const char* device, uint64_t sample) {
    RandomStream stream = RandomSource(seed, robot, device).stream(sample);
    return (uint64_t{stream.bits()} << 32) | stream.bits();
  };
  const uint64_t one = first(1, "p3at", "LRF", 0);
  EXPECT_EQ(one, first(1, "p3at", "LRF", 0));
  std::set<uint64_t> others{one,
                            first(2, "p3at", "LRF", 0),
                            first(1, "p3at_2", "LRF", 0),
                            first(1, "p3at", "LRF2", 0),
                            first(1, "p3at", "LRF", 1),
                            first(1, "p3atL", "RF", 0),
                            first(1, "LRF", "p3at", 0),
                            first(1, "", "p3atLRF", 0)};
  EXPECT_EQ(others.size(), 8u);
  // Names and seeds that differ by one collide nowhere.
  std::set<uint64_t> keys;
  for (int robot = 0; robot < 1000; ++robot) {
    for (const char* device : {"LRF", "SONAR-ARRAY", "odometry", "IMU"}) {
      keys.insert(first(1, ("robot_" + std::to_string(robot)).c_str(), device, 0));
    }
  }
  EXPECT_EQ(keys.size(), 4000u);
}

// Correlation between neighbours of every kind: within the 99.9 % interval of independent normals.
TEST(RandomSource, ReseedingEqualsAFreshSource) {
  RandomSource source(1, "p3at", "lrf");
  const RandomSource copy = source;
  RandomStream begun = source.stream(5);
  const uint32_t first = begun.bits();
  source.reseed(7);
  EXPECT_EQ(source.seed(), 7u);
  EXPECT_EQ(copy.stream(5).bits(), RandomSource(7, "p3at", "lrf").stream(5).bits());
  EXPECT_NE(copy.stream(5).bits(), first);
  // A sequence that was begun continues.
  RandomStream same = RandomSource(1, "p3at", "lrf").stream(5);
  same.bits();
  EXPECT_EQ(begun.bits(), same.bits());
  source.reseed(1);
  EXPECT_EQ(copy.stream(5).bits(), first);
}

TEST(RandomSource, NeighboursAreIndependent) {
  constexpr int kSamples = 20000;
  const RandomSource a(1, "p3at_1", "IMU"), b(1, "p3at_2", "IMU"), c(1, "p3at_1", "IMU2"),
      d(2, "p3at_1", "IMU");
  double ab = 0, ac = 0, ad = 0, next_sample = 0, next_draw = 0;
  double last = 0;
  for (int i = 0; i < kSamples; ++i) {
    RandomStream stream = a.stream(static_cast<uint64_t>(i));
    const double x = stream.gaussian(), y = stream.gaussian();
    ab += x * b.stream(static_cast<uint64_t>(i)).gaussian();
    ac += x * c.stream(static_cast<uint64_t>(i)).gaussian();
    ad += x * d.stream(static_cast<uint64_t>(i)).gaussian();
    next_sample += x * last;
    next_draw += x * y;
    last = x;
  }
  const double bound = 3.29 * std::sqrt(kSamples);
  for (const double sum : {ab, ac, ad, next_sample, next_draw}) EXPECT_LT(std::abs(sum), bound);
}

}  // namespace
}  // namespace ruedo
