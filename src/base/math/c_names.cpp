// The C library's names for our functions, for what is compiled into our programs and calls those:
// Eigen, Bullet's headers. The program exports them, so that the shared libraries that it loads
// compute by them, too, but for those whose copies call ours by name (cmake/RuedoMath.cmake).
#define OURS(name)             \
  double ruedo_##name(double); \
  double name(double x) noexcept { return ruedo_##name(x); }
#define OURS_2(name)                   \
  double ruedo_##name(double, double); \
  double name(double x, double y) noexcept { return ruedo_##name(x, y); }
#define OURS_F(name)         \
  float ruedo_##name(float); \
  float name(float x) noexcept { return ruedo_##name(x); }
#define OURS_2F(name)               \
  float ruedo_##name(float, float); \
  float name(float x, float y) noexcept { return ruedo_##name(x, y); }

extern "C" {
// clang-format off
OURS(sin) OURS(cos) OURS(tan) OURS(asin) OURS(acos) OURS(atan) OURS(exp) OURS(exp2) OURS(expm1)
OURS(log) OURS(log10) OURS_2(atan2) OURS_2(pow) OURS_2(hypot)
OURS_F(sinf) OURS_F(cosf) OURS_F(tanf) OURS_F(asinf) OURS_F(acosf) OURS_F(atanf)
OURS_F(expf) OURS_F(logf) OURS_2F(atan2f) OURS_2F(powf)
    // clang-format on

    void ruedo_sincos(double, double*, double*);
[[gnu::visibility("hidden")]] void sincos(double x, double* s, double* c) noexcept {
  ruedo_sincos(x, s, c);
}
void ruedo_sincosf(float, float*, float*);
[[gnu::visibility("hidden")]] void sincosf(float x, float* s, float* c) noexcept {
  ruedo_sincosf(x, s, c);
}
}
