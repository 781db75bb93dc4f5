// Effects of a camera's optics and sensor: less light in the corners, and noise in each pixel.
//
// Noise is Gaussian, independent for every pixel and colour. Draws come from a 16-bit quantile
// table and a counter-based generator (SplitMix64, Steele et al., OOPSLA 2014) keyed by the
// sample's random stream: a picture of 640 x 480 takes about 1 ms. The table ends at 4.3 sigma.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "ruedo/random.h"

namespace ruedo {

class PixelNoise {
 public:
  // mean, stddev: relative to full scale, as in SDF's <noise> of a camera. 0, 0: none.
  PixelNoise(double mean, double stddev);

  bool none() const { return scale_ == 0.0f && mean_ == 0.0f; }
  // Adds noise to every byte; saturates at 0 and 255.
  void apply(RandomStream stream, std::span<uint8_t> pixels) const;

 private:
  float mean_, scale_;  // relative to 255
};

class Vignette {
 public:
  // lost: fraction of the light lost in the corners, 0 to 1; it grows with the squared distance
  // from the picture's centre.
  Vignette(double lost, int width, int height);

  // pixels: rows with `channels` bytes per pixel; displayed values, the square roots of light.
  void apply(std::span<uint8_t> pixels, int channels) const;

 private:
  std::vector<uint16_t> factor_;  // for each pixel, in 1/32768
};

}  // namespace ruedo
