// Sine and cosine of one angle, for less than both: the reduction of the angle is the same. The
// bits are those of math::sin and math::cos (tests/base/test_math.cpp).
#pragma once

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
