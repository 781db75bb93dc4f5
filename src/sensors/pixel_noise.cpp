#include "sensors/pixel_noise.h"

#include <algorithm>
#include <cmath>

#include "base/math/wide.h"
#include "base/whole.h"

namespace ruedo {
namespace {

constexpr size_t kQuantiles = 65536;

const std::vector<float>& normal_table() {
  static const std::vector<float> table = [] {
    std::vector<float> t(kQuantiles);
    for (size_t i = 0; i < kQuantiles; ++i)
      t[i] = static_cast<float>(normal_quantile((static_cast<double>(i) + 0.5) / kQuantiles));
    return t;
  }();
  return table;
}

uint64_t split_mix(uint64_t x) {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

constexpr size_t kPerDraw = 4;  // 16 bits each
constexpr size_t kTogether = 64 * kPerDraw;

// At most kTogether pixels. Adding 256 (in base) makes the truncation to an integer round down
// below zero, too.
RUEDO_WIDE void add_noise(uint64_t key, uint64_t counter, const float* table, float base,
                          float scale, size_t count, uint8_t* __restrict pixels) {
  const size_t draws = (count + kPerDraw - 1) / kPerDraw;
  uint64_t bits[kTogether / kPerDraw];
  for (size_t i = 0; i < draws; ++i) bits[i] = split_mix(key + (counter + i) * 0x9e3779b97f4a7c15u);
  int32_t quantiles[kTogether];
  for (size_t i = 0; i < draws; ++i) {
    for (size_t k = 0; k < kPerDraw; ++k)
      quantiles[kPerDraw * i + k] = static_cast<int32_t>(bits[i] >> (16 * k) & 0xffff);
  }
  for (size_t i = 0; i < count; ++i) {
    const float value = static_cast<float>(pixels[i]) + base + scale * table[quantiles[i]];
    const float not_low = value < 256.0f ? 256.0f : value;
    const float kept = not_low > 511.0f ? 511.0f : not_low;
    pixels[i] = static_cast<uint8_t>(static_cast<int>(kept) - 256);
  }
}

}  // namespace

PixelNoise::PixelNoise(double mean, double stddev)
    : mean_(static_cast<float>(255.0 * mean)), scale_(static_cast<float>(255.0 * stddev)) {
  if (scale_ > 0.0f) normal_table();  // built now, not in the first sample
}

void PixelNoise::apply(RandomStream stream, std::span<uint8_t> pixels) const {
  if (none()) return;
  const float* table = normal_table().data();
  const uint64_t key = (uint64_t{stream.bits()} << 32) | stream.bits();
  for (size_t i = 0; i < pixels.size(); i += kTogether)
    add_noise(key, 1 + i / kPerDraw, table, mean_ + 256.5f, scale_,
              std::min(kTogether, pixels.size() - i), &pixels[i]);
}

Vignette::Vignette(double lost, int width, int height) {
  if (lost <= 0.0) return;
  factor_.reserve(static_cast<size_t>(width) * static_cast<size_t>(height));
  const double cx = 0.5 * (width - 1), cy = 0.5 * (height - 1),
               corner2 = std::max(cx * cx + cy * cy, 1.0);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const double r2 = ((u - cx) * (u - cx) + (v - cy) * (v - cy)) / corner2;
      factor_.push_back(rounded<uint16_t>(32768.0 * std::sqrt(1.0 - lost * r2)));
    }
  }
}

void Vignette::apply(std::span<uint8_t> pixels, int channels) const {
  uint8_t* p = pixels.data();
  for (const uint16_t factor : factor_) {
    for (int c = 0; c < channels; ++c, ++p)
      *p = static_cast<uint8_t>((*p * uint32_t{factor} + 16384u) >> 15);
  }
}

}  // namespace ruedo
