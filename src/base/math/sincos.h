// Sine and cosine of one angle, for less than both: the reduction of the angle is the same. The
// bits are those of math::sin and math::cos (tests/base/test_math.cpp).
#pragma once

#include "ruedo/pose.h"

extern "C" void ruedo_sincos(double, double*, double*);

namespace ruedo::math {

struct SineCosine {
  double sine, cosine;
};

inline SineCosine sincos(double angle_rad) {
  SineCosine both;
  ruedo_sincos(angle_rad, &both.sine, &both.cosine);
  return both;
}

}  // namespace ruedo::math

namespace ruedo {

// The rotation by an angle about the world's z.
inline Quat about_z(double angle_rad) {
  const auto [sine, cosine] = math::sincos(0.5 * angle_rad);
  return {cosine, 0.0, 0.0, sine};
}

}  // namespace ruedo
