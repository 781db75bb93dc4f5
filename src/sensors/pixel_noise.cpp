#include "sensors/pixel_noise.h"

#include <algorithm>
#include <cmath>

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

}  // namespace

PixelNoise::PixelNoise(double mean, double stddev)
    : mean_(static_cast<float>(255.0 * mean)), scale_(static_cast<float>(255.0 * stddev)) {
  if (scale_ > 0.0f) normal_table();  // built now, not in the first sample
}

void PixelNoise::apply(RandomStream stream, std::span<uint8_t> pixels) const {
  if (none()) return;
  const float* table = normal_table().data();
  const uint64_t key = (uint64_t{stream.bits()} << 32) | stream.bits();
  // Adding 256 makes the truncation to an integer round down below zero, too.
  const float base = mean_ + 256.5f;
  for (size_t i = 0, counter = 1; i < pixels.size(); i += 4, ++counter) {
    uint64_t bits = split_mix(key + counter * 0x9e3779b97f4a7c15u);
    const size_t end = std::min(i + 4, pixels.size());
    for (size_t k = i; k < end; ++k, bits >>= 16) {
      const float value = static_cast<float>(pixels[k]) + base + scale_ * table[bits & 0xffff];
      pixels[k] = static_cast<uint8_t>(static_cast<int>(std::clamp(value, 256.0f, 511.0f)) - 256);
    }
  }
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
