// The elementary functions, with one result on every x86-64 processor.
//
// The C library's pick other code where a CPU has fused multiply-adds, and change with its
// versions. These are musl's, linked in, and an arc tangent of two arguments of our own; each is
// within 1 ulp (tests/base/test_math.cpp compares them with MPFR). Code that computes results calls
// these, never <cmath>'s; sqrt, fmod, remainder, floor and the like are exact in every library and
// stay.
#pragma once

extern "C" {
double ruedo_sin(double);
double ruedo_cos(double);
double ruedo_tan(double);
double ruedo_asin(double);
double ruedo_acos(double);
double ruedo_atan(double);
double ruedo_atan2(double, double);
double ruedo_exp(double);
double ruedo_exp2(double);
double ruedo_expm1(double);
double ruedo_log(double);
double ruedo_log10(double);
double ruedo_pow(double, double);
double ruedo_hypot(double, double);
}

namespace ruedo::math {

inline double sin(double x) { return ruedo_sin(x); }
inline double cos(double x) { return ruedo_cos(x); }
inline double tan(double x) { return ruedo_tan(x); }
inline double asin(double x) { return ruedo_asin(x); }
inline double acos(double x) { return ruedo_acos(x); }
inline double atan(double x) { return ruedo_atan(x); }
inline double atan2(double y, double x) { return ruedo_atan2(y, x); }
inline double exp(double x) { return ruedo_exp(x); }
inline double exp2(double x) { return ruedo_exp2(x); }
inline double expm1(double x) { return ruedo_expm1(x); }
inline double log(double x) { return ruedo_log(x); }
inline double log10(double x) { return ruedo_log10(x); }
inline double pow(double x, double y) { return ruedo_pow(x, y); }
inline double hypot(double x, double y) { return ruedo_hypot(x, y); }

}  // namespace ruedo::math
