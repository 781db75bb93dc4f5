// Counter-based random numbers: Philox4x32-10 (Salmon et al., SC 2011) and the inverse normal
// distribution by Wichura, "Algorithm AS 241: The Percentage Points of the Normal Distribution",
// Applied Statistics 37 (1988). Integer arithmetic, + - * / and square roots only: the same bits on
// every CPU.
#include "ruedo/random.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "base/math/wide.h"

namespace ruedo {
namespace {

// Scrambles all 64 bits (the finaliser of SplitMix64; Steele, Lea, Flood, OOPSLA 2014).
uint64_t mix(uint64_t z) {
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return z ^ (z >> 31);
}

// FNV-1a over the bytes, closed by the length, so that ("ab", "c") is not ("a", "bc").
uint64_t absorb(uint64_t hash, std::string_view text) {
  for (const char c : text) hash = (hash ^ static_cast<uint8_t>(c)) * 0x100000001b3u;
  return mix(hash ^ (text.size() * 0x9e3779b97f4a7c15u));
}

// Natural logarithm of a positive normal number, within 1e-16 of the larger of 1 and |log x|. With
// x = 2^e m, m in [sqrt 1/2, sqrt 2), log m = 2 artanh(s), s = (m - 1) / (m + 1), |s| < 0.172:
// eleven odd powers.
inline double natural_log(double x) {
  const uint64_t bits = std::bit_cast<uint64_t>(x);
  const uint64_t mantissa = bits & 0xfffffffffffff;
  constexpr uint64_t kRootOfTwo = 0x6a09e667f3bcd;  // its mantissa
  const uint64_t above = (kRootOfTwo - mantissa) >> 63;
  const double m = std::bit_cast<double>((mantissa | 0x3ff0000000000000) - (above << 52));
  const double s = (m - 1.0) / (m + 1.0);
  const double s2 = s * s;
  constexpr double kOdd[10] = {1.0 / 21, 1.0 / 19, 1.0 / 17, 1.0 / 15, 1.0 / 13,
                               1.0 / 11, 1.0 / 9,  1.0 / 7,  1.0 / 5,  1.0 / 3};
  double tail = 0.0;
  for (const double c : kOdd) tail = tail * s2 + c;
  // The exponent becomes a double by way of its bits, which takes no more than SSE2 has.
  const double e =
      std::bit_cast<double>(((bits >> 52) + above) | 0x4330000000000000) - (0x1p52 + 1023.0);
  // ln 2 in two parts, the first with few bits, so that e times it is exact.
  return e * 6.93147180369123816490e-01 +
         (2.0 * s + (2.0 * s * s2 * tail + e * 1.90821492927058770002e-10));
}

// Polynomials of degree 7, the coefficients from the lowest power up. By halves (Estrin): the
// products do not wait for each other as in Horner's scheme.
inline double polynomial(const double (&c)[8], double r) {
  const double r2 = r * r;
  return ((c[0] + c[1] * r) + (c[2] + c[3] * r) * r2) +
         ((c[4] + c[5] * r) + (c[6] + c[7] * r) * r2) * (r2 * r2);
}

// AS 241's PPND16: centre, near tails, far tails.
constexpr double kA[8] = {3.3871328727963666080e0, 1.3314166789178437745e2, 1.9715909503065514427e3,
                          1.3731693765509461125e4, 4.5921953931549871457e4, 6.7265770927008700853e4,
                          3.3430575583588128105e4, 2.5090809287301226727e3};
constexpr double kB[8] = {1.0,
                          4.2313330701600911252e1,
                          6.8718700749205790830e2,
                          5.3941960214247511077e3,
                          2.1213794301586595867e4,
                          3.9307895800092710610e4,
                          2.8729085735721942674e4,
                          5.2264952788528545610e3};
constexpr double kC[8] = {1.42343711074968357734e0,  4.63033784615654529590e0,
                          5.76949722146069140550e0,  3.64784832476320460504e0,
                          1.27045825245236838258e0,  2.41780725177450611770e-1,
                          2.27238449892691845833e-2, 7.74545014278341407640e-4};
constexpr double kD[8] = {1.0,
                          2.05319162663775882187e0,
                          1.67638483018380384940e0,
                          6.89767334985100004550e-1,
                          1.48103976427480074590e-1,
                          1.51986665636164571966e-2,
                          5.47593808499534494600e-4,
                          1.05075007164441684324e-9};
constexpr double kE[8] = {6.65790464350110377720e0,  5.46378491116411436990e0,
                          1.78482653991729133580e0,  2.96560571828504891230e-1,
                          2.65321895265761230930e-2, 1.24266094738807843860e-3,
                          2.71155556874348757815e-5, 2.01033439929228813265e-7};
constexpr double kF[8] = {1.0,
                          5.99832206555887937690e-1,
                          1.36929880922735805310e-1,
                          1.48753612908506148525e-2,
                          7.86869131145613259100e-4,
                          1.84631831751005468180e-5,
                          1.42151175831644588870e-7,
                          2.04426310338993978564e-15};

// PPND16 where |q| <= kCentre, q = p - 1/2.
constexpr double kCentre = 0.425;
inline double central_quantile(double q) {
  const double r = 0.180625 - q * q;
  return q * polynomial(kA, r) / polynomial(kB, r);
}

// PPND16 where |q| > kCentre, by r, the root of -log of the smaller one of p and 1 - p.
inline double tail_root(double p) {
  const double other = 1.0 - p;
  return std::sqrt(-natural_log(p < other ? p : other));
}
inline double near_tail_quantile(double r) {
  return polynomial(kC, r - 1.6) / polynomial(kD, r - 1.6);
}
constexpr double kNearTail = 5.0;  // the largest r of that formula

// The middle of one of 2^52 equal cells of (0, 1): never 0 or 1, and exactly symmetric about 1/2.
// The cell's number becomes a double by way of its bits, which takes no more than SSE2 has.
inline double cell_of(uint64_t high, uint64_t low) {
  const uint64_t cell = (high << 20) | (low >> 12);
  return (std::bit_cast<double>(cell | 0x4330000000000000u) - 0x1p52 + 0.5) * 0x1p-52;
}

constexpr size_t kBlocks = 16;
constexpr size_t kFewest = 8;  // draws that cost more singly

// The uniform draws of kBlocks blocks from `block` on, two a block, in `p`; and what the formula of
// the centre makes of them in `values`: right for those that lie there.
RUEDO_WIDE void draw_blocks(uint64_t key, uint64_t sample, uint64_t block, double* p,
                            double* values) {
  uint32_t word[4][kBlocks];
  for (size_t i = 0; i < kBlocks; ++i) {
    word[0][i] = static_cast<uint32_t>(block + i);
    word[1][i] = static_cast<uint32_t>((block + i) >> 32);
    word[2][i] = static_cast<uint32_t>(sample);
    word[3][i] = static_cast<uint32_t>(sample >> 32);
  }
  uint32_t key0 = static_cast<uint32_t>(key), key1 = static_cast<uint32_t>(key >> 32);
  for (int round = 0; round < 10; ++round) {
#pragma GCC unroll 1  // left as a loop it becomes one over wide registers
    for (size_t i = 0; i < kBlocks; ++i) {
      const uint32_t a = word[0][i], b = word[2][i];
      const auto high_a = static_cast<uint32_t>(uint64_t{0xD2511F53u} * a >> 32),
                 high_b = static_cast<uint32_t>(uint64_t{0xCD9E8D57u} * b >> 32);
      word[0][i] = high_b ^ word[1][i] ^ key0;
      word[1][i] = 0xCD9E8D57u * b;
      word[2][i] = high_a ^ word[3][i] ^ key1;
      word[3][i] = 0xD2511F53u * a;
    }
    key0 += 0x9E3779B9u;
    key1 += 0xBB67AE85u;
  }
  for (size_t i = 0; i < kBlocks; ++i) p[2 * i] = cell_of(word[0][i], word[1][i]);
  for (size_t i = 0; i < kBlocks; ++i) p[2 * i + 1] = cell_of(word[2][i], word[3][i]);
  for (size_t i = 0; i < 2 * kBlocks; ++i) values[i] = central_quantile(p[i] - 0.5);
}

// The quantiles of p in the tails; right for those that lie in the near ones.
RUEDO_WIDE void near_tail_quantiles(size_t count, const double* p, double* values) {
  for (size_t i = 0; i < count; ++i)
    values[i] = std::copysign(near_tail_quantile(tail_root(p[i])), p[i] - 0.5);
}

// Draws that lie in the tails, 15 %, with their places among the values.
struct Tails {
  static constexpr size_t kMost = 128;
  double p[kMost];
  double* at[kMost];
  size_t count = 0;

  void settle() {
    double drawn[kMost];
    near_tail_quantiles(count, p, drawn);
    constexpr double kFar = 2e-11;  // just above exp(-kNearTail^2)
    for (size_t i = 0; i < count; ++i)
      *at[i] = std::min(p[i], 1.0 - p[i]) < kFar ? normal_quantile(p[i]) : drawn[i];
    count = 0;
  }
};

}  // namespace

std::array<uint32_t, 4> philox4x32(std::array<uint32_t, 4> counter, std::array<uint32_t, 2> key) {
  for (int round = 0; round < 10; ++round) {
    const uint64_t product0 = uint64_t{0xD2511F53u} * counter[0];
    const uint64_t product1 = uint64_t{0xCD9E8D57u} * counter[2];
    counter = {static_cast<uint32_t>(product1 >> 32) ^ counter[1] ^ key[0],
               static_cast<uint32_t>(product1),
               static_cast<uint32_t>(product0 >> 32) ^ counter[3] ^ key[1],
               static_cast<uint32_t>(product0)};
    key[0] += 0x9E3779B9u;
    key[1] += 0xBB67AE85u;
  }
  return counter;
}

double normal_quantile(double p) {
  const double q = p - 0.5;
  if (std::abs(q) <= kCentre) return central_quantile(q);
  const double r = tail_root(p);
  const double x =
      r <= kNearTail ? near_tail_quantile(r) : polynomial(kE, r - 5.0) / polynomial(kF, r - 5.0);
  return q < 0.0 ? -x : x;
}

uint32_t RandomStream::bits() {
  if (next_ == 4) {
    output_ = philox4x32({static_cast<uint32_t>(block_), static_cast<uint32_t>(block_ >> 32),
                          static_cast<uint32_t>(sample_), static_cast<uint32_t>(sample_ >> 32)},
                         {static_cast<uint32_t>(key_), static_cast<uint32_t>(key_ >> 32)});
    ++block_;
    next_ = 0;
  }
  return output_[static_cast<size_t>(next_++)];
}

double RandomStream::uniform() {
  const uint64_t high = bits();
  const uint64_t low = bits();
  return static_cast<double>((high << 21) | (low >> 11)) * 0x1p-53;
}

double RandomStream::gaussian() {
  const uint32_t high = bits();
  return normal_quantile(cell_of(high, bits()));
}

void RandomStream::gaussians(std::span<double> values) {
  size_t done = 0;
  while (next_ != 4 && done < values.size()) values[done++] = gaussian();
  // Two values a block. The centre's formula runs for all, in a loop without branches, that of the
  // tails for those that lie there. A few that are left are worth the loop, too.
  Tails tails;
  while (values.size() - done >= kFewest) {
    const size_t count = std::min(values.size() - done, 2 * kBlocks) & ~size_t{1};
    double p[2 * kBlocks], drawn[2 * kBlocks];
    draw_blocks(key_, sample_, block_, p, drawn);
    block_ += count / 2;
    for (size_t i = 0; i < count; ++i) {
      values[done + i] = drawn[i];
      tails.p[tails.count] = p[i];
      tails.at[tails.count] = &values[done + i];
      tails.count += std::abs(p[i] - 0.5) > kCentre;
    }
    if (tails.count + 2 * kBlocks > Tails::kMost) tails.settle();
    done += count;
  }
  tails.settle();
  for (; done < values.size(); ++done) values[done] = gaussian();
}

RandomSource::RandomSource(uint64_t seed, std::string_view robot, std::string_view device)
    : state_(std::make_shared<State>(State{std::string(robot), std::string(device), 0, 0})) {
  reseed(seed);
}

RandomSource& RandomSource::operator=(const RandomSource& other) {
  *state_ = *other.state_;
  return *this;
}

void RandomSource::reseed(uint64_t seed) {
  state_->seed = seed;
  state_->key = absorb(absorb(mix(seed + 0x9e3779b97f4a7c15u), state_->robot), state_->device);
}

}  // namespace ruedo
