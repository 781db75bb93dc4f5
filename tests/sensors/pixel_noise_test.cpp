// Noise of pixels against its definition, one pixel after the other.
#include "sensors/pixel_noise.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

namespace ruedo {
namespace {

// Four draws of 16 bits from each number of SplitMix64 (Steele et al., OOPSLA 2014).
std::vector<uint8_t> defined(RandomStream stream, double mean, double stddev,
                             std::vector<uint8_t> pixels) {
  const uint64_t key = (uint64_t{stream.bits()} << 32) | stream.bits();
  for (size_t i = 0; i < pixels.size(); ++i) {
    uint64_t x = key + (1 + i / 4) * 0x9e3779b97f4a7c15u;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    x ^= x >> 31;
    const double part = (static_cast<double>(x >> (16 * (i % 4)) & 0xffff) + 0.5) / 65536.0;
    const double value =
        pixels[i] + 255.0 * (mean + stddev * normal_quantile(part));  // before it is rounded
    pixels[i] = static_cast<uint8_t>(std::clamp(std::floor(value + 0.5), 0.0, 255.0));
  }
  return pixels;
}

TEST(PixelNoise, IsAsDefinedForPicturesOfAnySize) {
  for (const auto& [mean, stddev] : {std::pair(0.0, 0.007), {0.01, 0.3}, {-0.5, 0.1}, {0.2, 0.0}}) {
    for (const size_t size : {1u, 3u, 4u, 5u, 255u, 256u, 257u, 1003u, 640u * 480u * 3u}) {
      std::vector<uint8_t> pixels(size);
      for (size_t i = 0; i < size; ++i) pixels[i] = static_cast<uint8_t>(i * 7);
      const std::vector<uint8_t> expected = defined(RandomStream(5, size), mean, stddev, pixels);
      PixelNoise(mean, stddev).apply(RandomStream(5, size), pixels);
      size_t other = 0;
      for (size_t i = 0; i < size; ++i) {
        ASSERT_LE(std::abs(pixels[i] - expected[i]), 1) << size << ", " << i;
        other += pixels[i] != expected[i];
      }
      EXPECT_LE(other, size / 10000) << size;  // at a half, single precision may round otherwise
    }
  }
}

}  // namespace
}  // namespace ruedo
