// SDF's <noise>; the model is in the header.
#include "sensors/noise.h"

#include <cmath>

#include "ruedo/math.h"

namespace ruedo {
namespace {

const std::vector<std::string> kTypes{"none", "gaussian", "gaussian_quantized"};

}  // namespace

Noise::Noise(const Element* noise) {
  if (!noise) return;
  std::string type = noise->choice("type", "none", kTypes);
  if (const std::string* written = noise->attribute("type")) {
    type = *written;
    if (type != "none" && type != "gaussian" && type != "gaussian_quantized") {
      noise->fail("type '" + type +
                  "' is not allowed; allowed: none, gaussian, gaussian_quantized");
    }
  }
  if (type != "none") *this = from_parameters(*noise, type == "gaussian_quantized");
}

Noise Noise::from_parameters(const Element& parameters, bool quantized) {
  Noise noise;
  noise.mean_ = parameters.number("mean", 0.0, Allowed::any(quantity::kNoise));
  noise.stddev_ = parameters.number("stddev", 0.0, Allowed::not_negative(quantity::kNoise));
  noise.bias_mean_ = parameters.number("bias_mean", 0.0, Allowed::any(quantity::kNoise));
  noise.bias_stddev_ =
      parameters.number("bias_stddev", 0.0, Allowed::not_negative(quantity::kNoise));
  noise.walk_stddev_ =
      parameters.number("dynamic_bias_stddev", 0.0, Allowed::not_negative(quantity::kNoise));
  noise.walk_time_s_ = parameters.number("dynamic_bias_correlation_time", 0.0,
                                         Allowed::not_negative(quantity::kTime));
  noise.precision_ = parameters.number("precision", 0.0, Allowed::not_negative(quantity::kNoise));
  noise.quantized_ = quantized && noise.precision_ > 0.0;
  noise.bias_ = noise.bias_mean_;
  noise.none_ = noise.mean_ == 0.0 && noise.stddev_ == 0.0 && noise.bias_mean_ == 0.0 &&
                noise.bias_stddev_ == 0.0 && noise.walk_stddev_ == 0.0 && !noise.quantized_;
  return noise;
}

std::vector<std::string> noise_settings(const std::string& at) {
  return {at + ".type", at + ".mean", at + ".stddev"};
}

void Noise::draw_bias(RandomStream& constants) {
  if (bias_stddev_ > 0.0) bias_ = bias_mean_ + bias_stddev_ * constants.gaussian();
}

double Noise::apply(double ideal, double dt_s, RandomStream& stream) {
  if (none_) return ideal;
  double value = ideal + mean_ + stddev_ * stream.gaussian();
  if (walk_stddev_ > 0.0) {
    if (dt_s != known_dt_s_) {
      known_dt_s_ = dt_s;
      if (walk_time_s_ > 0.0) {
        decay_ = math::exp(-dt_s / walk_time_s_);
        drive_ =
            walk_stddev_ * std::sqrt(-0.5 * walk_time_s_ * math::expm1(-2.0 * dt_s / walk_time_s_));
      } else {
        decay_ = 1.0;
        drive_ = walk_stddev_ * std::sqrt(dt_s);
      }
    }
    walk_ = decay_ * walk_ + drive_ * stream.gaussian();
  }
  return rounded(value + (bias_ + walk_));
}

}  // namespace ruedo
