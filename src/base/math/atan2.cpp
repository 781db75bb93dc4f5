// The angle of a point in the plane within 0.51 ulp; musl's is off by up to 1.5.
//
// Of the point's two lengths, the shorter n and the longer d: atan(n/d) = atan(c) + atan(t), c =
// k/16 next to n/d, t = (n - c d) / (d + c n). All sums and products that matter are carried in two
// doubles, a value and what it was rounded by.
#include <cmath>
#include <utility>

#include "base/whole.h"
#include "ruedo/math.h"

extern "C" double ruedo_musl_atan2(double, double);

namespace {

struct Two {  // high + low, |low| at most half an ulp of high
  double high, low;
};

// Knuth: exact.
Two sum(double a, double b) {
  const double s = a + b, part = s - a;
  return {s, (a - (s - part)) + (b - part)};
}

// Veltkamp's and Dekker's: exact below 2^996.
Two product(double a, double b) {
  constexpr double kSplitter = 0x1p27 + 1;
  const auto upper = [](double x) { return kSplitter * x - (kSplitter * x - x); };
  const double p = a * b, ah = upper(a), al = a - ah, bh = upper(b), bl = b - bh;
  return {p, ((ah * bh - p) + ah * bl + al * bh) + al * bl};
}

Two plus(Two a, Two b) {
  const Two s = sum(a.high, b.high);
  return sum(s.high, s.low + (a.low + b.low));
}

constexpr int kCells = 16;
constexpr Two kAtan[kCells + 1] = {  // of k/16
    {0x0.0p+0, 0x0.0p+0},
    {0x1.ff55bb72cfdeap-5, -0x1.c934d86d23f1dp-60},
    {0x1.fd5ba9aac2f6ep-4, -0x1.cd37686760c17p-59},
    {0x1.7b97b4bce5b02p-3, 0x1.347b0b4f881cap-58},
    {0x1.f5b75f92c80ddp-3, 0x1.8ab6e3cf7afbdp-57},
    {0x1.362773707ebccp-2, -0x1.963a544b672d8p-57},
    {0x1.6f61941e4def1p-2, -0x1.c63aae6f6e918p-56},
    {0x1.a64eec3cc23fdp-2, -0x1.24dec1b50b7ffp-56},
    {0x1.dac670561bb4fp-2, 0x1.a2b7f222f65e2p-56},
    {0x1.0657e94db30d0p-1, -0x1.d5b495f6349e6p-56},
    {0x1.1e00babdefeb4p-1, -0x1.928df287a668fp-58},
    {0x1.345f01cce37bbp-1, 0x1.1021137c71102p-55},
    {0x1.4978fa3269ee1p-1, 0x1.2419a87f2a458p-56},
    {0x1.5d58987169b18p-1, 0x1.0028e4bc5e7cap-57},
    {0x1.700a7c5784634p-1, -0x1.8c34d25aadef6p-56},
    {0x1.819d0b7158a4dp-1, -0x1.bf76229d3b917p-56},
    {0x1.921fb54442d18p-1, 0x1.1a62633145c07p-55}};
constexpr Two kHalfTurn = {0x1.921fb54442d18p+1, 0x1.1a62633145c07p-53};
constexpr Two kQuarterTurn = {0x1.921fb54442d18p+0, 0x1.1a62633145c07p-54};

// atan(n / d) for 0 < n <= d.
Two first_octant(double n, double d) {
  const int k = ruedo::whole<int>(kCells * (n / d) + 0.5);
  const double c = static_cast<double>(k) / kCells;
  const Two cd = product(c, d), over = plus({n, 0.0}, {-cd.high, -cd.low}),
            under = plus({d, 0.0}, product(c, n));
  const double t = over.high / under.high;
  const Two back = product(t, under.high);
  const double rest =
      (((over.high - back.high) - back.low) + over.low - t * under.low) / under.high;
  const double t2 = t * t;  // at most 2^-10: six terms of the series leave 2^-64 of t
  const double series =
      t2 * (-1.0 / 3 + t2 * (1.0 / 5 + t2 * (-1.0 / 7 + t2 * (1.0 / 9 + t2 * (-1.0 / 11)))));
  return plus(kAtan[k], sum(t, rest + t * series));
}

}  // namespace

extern "C" double ruedo_atan2(double y, double x) {
  constexpr int kFarApart = 400;  // binary digits: nothing above over- or underflows
  if (!std::isfinite(x) || !std::isfinite(y) || x == 0.0 || y == 0.0) return ruedo_musl_atan2(y, x);
  const int exponent_x = std::ilogb(x), exponent_y = std::ilogb(y);
  if (exponent_x > exponent_y + kFarApart || exponent_y > exponent_x + kFarApart)
    return ruedo_musl_atan2(y, x);
  double n = std::scalbn(std::abs(y), -exponent_x), d = std::scalbn(std::abs(x), -exponent_x);
  const bool steep = n > d;
  if (steep) std::swap(n, d);
  Two angle = first_octant(n, d);
  if (steep) angle = plus(kQuarterTurn, {-angle.high, -angle.low});
  if (x < 0.0) angle = plus(kHalfTurn, {-angle.high, -angle.low});
  return std::copysign(angle.high + angle.low, y);
}
