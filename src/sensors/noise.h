// SDF's <noise>: Gaussian noise with a constant bias, a drifting bias, and quantisation, for one
// measured value. For every sensor that reads <noise>; docs/adding-a-sensor.md shows how.
//
// Model: measured = ideal + N(mean, stddev) + bias + walk, rounded to multiples of `precision` for
// gaussian_quantized. The bias is drawn once, N(bias_mean, bias_stddev). The walk is Gazebo's
// Gauss-Markov process: over dt it becomes exp(-dt/tau) walk + N(0, s), s^2 = sigma^2 tau/2 (1 -
// exp(-2 dt/tau)), with sigma dynamic_bias_stddev and tau dynamic_bias_correlation_time; tau 0
// means infinite tau, a random walk with s^2 = sigma^2 dt.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "ruedo/element.h"
#include "ruedo/random.h"
#include "ruedo/state_archive.h"

namespace ruedo {

// Stream number from which a device draws values for the whole run; samples use the streams from 0
// on.
inline constexpr uint64_t kConstantDraws = ~uint64_t{0};

// The settings of a <noise> at that path, for SensorKind::settings: "lidar.noise".
std::vector<std::string> noise_settings(const std::string& at);

class Noise {
 public:
  Noise() = default;  // no noise

  // Reads a <noise> element: its type is an attribute, or (in old files) a child: none, gaussian,
  // gaussian_quantized. null: no noise. Throws InputError.
  explicit Noise(const Element* noise);

  // Reads <mean>, <stddev>, ... from an element that is not a <noise> (<rate> and <accel> of old
  // IMUs).
  static Noise from_parameters(const Element& parameters, bool quantized);

  bool none() const { return none_; }
  double stddev() const { return stddev_; }
  bool wanders() const { return walk_stddev_ > 0.0; }

  // Draws the constant bias; once, from the device's stream kConstantDraws. Otherwise the bias is
  // its mean.
  void draw_bias(RandomStream& constants);

  // The measured value. dt_s: time since the last call, 0 in the first, for the drifting bias.
  // Draws one Gaussian, and a second one if the bias drifts; if none(), draws nothing and returns
  // `ideal` unchanged.
  double apply(double ideal, double dt_s, RandomStream& stream);

  // The walk; the rest is drawn from the seed.
  void exchange(StateArchive& archive) { archive(walk_, known_dt_s_, decay_, drive_); }

  // The same with a given draw, for noise without drift.
  double apply_draw(double ideal, double gaussian) const {
    return rounded(ideal + mean_ + stddev_ * gaussian + (bias_ + walk_));
  }

 private:
  double rounded(double value) const {
    return quantized_ ? std::round(value / precision_) * precision_ : value;
  }

  bool none_ = true;
  bool quantized_ = false;
  double mean_ = 0.0, stddev_ = 0.0;
  double bias_mean_ = 0.0, bias_stddev_ = 0.0;
  double walk_stddev_ = 0.0, walk_time_s_ = 0.0;
  double precision_ = 0.0;

  double bias_ = 0.0, walk_ = 0.0;
  double known_dt_s_ = -1.0, decay_ = 1.0, drive_ = 0.0;  // of the walk, cached for the last dt
};

}  // namespace ruedo
