// The elementary functions against MPFR with 200 bits: within 1 ulp, over the usual ranges and far
// outside; the values that C's Annex F prescribes for zeros, infinities and NaN; and that Eigen
// uses the same functions.
#include "ruedo/math.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <gtest/gtest.h>
#include <mpfr.h>
#include <Eigen/Geometry>

#include "base/math/sincos.h"
#include "ruedo/random.h"

namespace ruedo {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr int kDraws = 20000;

struct Exact {
  mpfr_t value;
  Exact() { mpfr_init2(value, 200); }
  explicit Exact(double x) : Exact() { mpfr_set_d(value, x, MPFR_RNDN); }
  ~Exact() { mpfr_clear(value); }
  Exact(const Exact&) = delete;
  Exact& operator=(const Exact&) = delete;
};

// |got - exact| in units of the last place of a double of the exact value's size.
double error_ulp(double got, const Exact& exact) {
  const int exponent = std::max(std::ilogb(mpfr_get_d(exact.value, MPFR_RNDZ)), -1022);
  Exact difference;
  mpfr_sub_d(difference.value, exact.value, got, MPFR_RNDN);
  mpfr_mul_2si(difference.value, difference.value, 52 - exponent, MPFR_RNDN);
  return std::abs(mpfr_get_d(difference.value, MPFR_RNDN));
}

struct One {
  const char* name;
  double (*ours)(double);
  int (*exact)(mpfr_ptr, mpfr_srcptr, mpfr_rnd_t);
  double from, to;
  bool over_exponents = false;  // x = +-2^u
};

void PrintTo(const One& one, std::ostream* out) {
  *out << one.name << " from " << one.from << " to " << one.to;
}

class OneArgument : public testing::TestWithParam<One> {};

TEST_P(OneArgument, WithinOneUlp) {
  const One& f = GetParam();
  RandomStream random(1, 1);
  double worst = 0.0, at = 0.0;
  for (int i = 0; i < kDraws; ++i) {
    double x = f.from + (f.to - f.from) * random.uniform();
    if (f.over_exponents)
      x = std::ldexp(1.0 + random.uniform(), static_cast<int>(x)) *
          (f.ours == math::log || i % 2 == 0 ? 1.0 : -1.0);
    Exact exact;
    f.exact(exact.value, Exact(x).value, MPFR_RNDN);
    const double error = error_ulp(f.ours(x), exact);
    if (error > worst) worst = error, at = x;
  }
  EXPECT_LT(worst, 1.0) << f.name << "(" << at << ")";
}

INSTANTIATE_TEST_SUITE_P(
    Functions, OneArgument,
    testing::Values(
        One{"sin", math::sin, mpfr_sin, -7, 7}, One{"sin", math::sin, mpfr_sin, -40, 1000, true},
        One{"cos", math::cos, mpfr_cos, -7, 7}, One{"cos", math::cos, mpfr_cos, -40, 1000, true},
        One{"tan", math::tan, mpfr_tan, -7, 7}, One{"tan", math::tan, mpfr_tan, -40, 1000, true},
        One{"asin", math::asin, mpfr_asin, -1, 1}, One{"asin", math::asin, mpfr_asin, -40, 0, true},
        One{"acos", math::acos, mpfr_acos, -1, 1}, One{"acos", math::acos, mpfr_acos, -40, 0, true},
        One{"atan", math::atan, mpfr_atan, -3, 3},
        One{"atan", math::atan, mpfr_atan, -60, 60, true},
        One{"exp", math::exp, mpfr_exp, -745, 709}, One{"exp", math::exp, mpfr_exp, -1, 1},
        One{"exp2", math::exp2, mpfr_exp2, -1074, 1023}, One{"exp2", math::exp2, mpfr_exp2, -1, 1},
        One{"expm1", math::expm1, mpfr_expm1, -40, 700},
        One{"expm1", math::expm1, mpfr_expm1, -60, -1, true},
        One{"log", math::log, mpfr_log, 0.5, 2}, One{"log", math::log, mpfr_log, -1000, 1000, true},
        One{"log10", math::log10, mpfr_log10, 0.5, 2},
        One{"log10", math::log10, mpfr_log10, 1e-9, 1e9}));

using TwoExact = int (*)(mpfr_ptr, mpfr_srcptr, mpfr_srcptr, mpfr_rnd_t);

double worst_of_two(double (*ours)(double, double), TwoExact exact, double a, double b,
                    double worst) {
  Exact expected;
  exact(expected.value, Exact(a).value, Exact(b).value, MPFR_RNDN);
  return std::max(worst, error_ulp(ours(a, b), expected));
}

TEST(TwoArguments, WithinOneUlp) {
  RandomStream random(1, 2);
  double of_atan2 = 0.0, of_far_atan2 = 0.0, of_hypot = 0.0, of_pow = 0.0, of_damping = 0.0;
  for (int i = 0; i < kDraws; ++i) {
    const double x = 10 * random.uniform() - 5, y = 10 * random.uniform() - 5;
    of_atan2 = worst_of_two(math::atan2, mpfr_atan2, y, x, of_atan2);
    const double far =
        std::ldexp(y, static_cast<int>(140 * random.uniform()) - 70);  // from one axis to the other
    of_far_atan2 = worst_of_two(math::atan2, mpfr_atan2, far, x, of_far_atan2);
    of_hypot = worst_of_two(math::hypot, mpfr_hypot, x, far, of_hypot);
    of_pow = worst_of_two(math::pow, mpfr_pow, 0.5 + std::abs(x), 40 * y, of_pow);
    of_damping = worst_of_two(math::pow, mpfr_pow, 1.0 - 0.1 * random.uniform(),
                              random.uniform() / 100, of_damping);
  }
  EXPECT_LT(of_atan2, 0.52);
  EXPECT_LT(of_far_atan2, 0.52);
  EXPECT_LT(of_hypot, 1.0);
  EXPECT_LT(of_pow, 1.0);
  EXPECT_LT(of_damping, 1.0);
}

TEST(ArcTangentOfTwo, AtTheEdgesOfTheRange) {
  for (const double scale : {0x1p-1022, 0x1p-1060, 0x1p1020}) {
    for (const double y : {-3.0, 1.0, 2.0})
      EXPECT_EQ(math::atan2(y * scale, 2.0 * scale), math::atan2(y, 2.0)) << scale;
  }
  EXPECT_EQ(math::atan2(5e-324, 5e-324), M_PI / 4);
  EXPECT_EQ(math::atan2(1e308, -1e308), 3 * M_PI / 4);
}

bool same(double a, double b) { return std::bit_cast<uint64_t>(a) == std::bit_cast<uint64_t>(b); }

TEST(ArcTangentOfTwo, KnowsZerosAndInfinities) {  // C11, F.10.1.4
  EXPECT_TRUE(same(math::atan2(0.0, 1.0), 0.0));
  EXPECT_TRUE(same(math::atan2(-0.0, 1.0), -0.0));
  EXPECT_EQ(math::atan2(0.0, -1.0), M_PI);
  EXPECT_EQ(math::atan2(-0.0, -0.0), -M_PI);
  EXPECT_EQ(math::atan2(-1.0, 0.0), -M_PI / 2);
  EXPECT_TRUE(same(math::atan2(-1.0, kInf), -0.0));
  EXPECT_EQ(math::atan2(1.0, -kInf), M_PI);
  EXPECT_EQ(math::atan2(kInf, -kInf), 3 * M_PI / 4);
  EXPECT_TRUE(std::isnan(math::atan2(std::nan(""), 1.0)));
}

// Angles of every size, among them the limits between the branches of the implementation.
TEST(SineAndCosine, AtOnceAreTheSameBits) {
  RandomStream random(7, 1);
  std::vector<double> angles{0.0, -0.0, 0x1p-27, 0x1.6a09ep-27, 0x1p-26, M_PI / 4, M_PI / 2, M_PI};
  for (int i = 0; i < kDraws; ++i) {
    angles.push_back(8.0 * (random.uniform() - 0.5));
    angles.push_back(std::ldexp(random.uniform() - 0.5, static_cast<int>(random.bits() % 80) - 40));
    angles.push_back(std::nextafter(0x1p-27 * (1 + 3 * random.uniform()), 1.0));
  }
  for (const double angle : angles) {
    const auto [sine, cosine] = math::sincos(angle);
    ASSERT_EQ(std::bit_cast<uint64_t>(sine), std::bit_cast<uint64_t>(math::sin(angle))) << angle;
    ASSERT_EQ(std::bit_cast<uint64_t>(cosine), std::bit_cast<uint64_t>(math::cos(angle))) << angle;
  }
}

TEST(Math, RecognisesNan) {
  EXPECT_TRUE(std::isnan(math::sin(kInf)) && std::isnan(math::acos(1.0 + 0x1p-52)) &&
              std::isnan(math::log(-1.0)));
  EXPECT_EQ(math::log(0.0), -kInf);
  EXPECT_EQ(math::exp(-kInf), 0.0);
  EXPECT_EQ(math::pow(0.0, 0.0), 1.0);
  EXPECT_EQ(math::hypot(std::nan(""), -kInf), kInf);
  EXPECT_TRUE(same(math::sin(-0.0), -0.0));
}

TEST(Eigen, CallsTheSame) {
  RandomStream random(1, 3);
  for (int i = 0; i < 1000; ++i) {
    const double angle = 8 * random.uniform() - 4;
    const Eigen::Quaterniond q(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()));
    EXPECT_TRUE(same(q.w(), math::cos(0.5 * angle)) && same(q.z(), math::sin(0.5 * angle)))
        << angle;
  }
}

}  // namespace
}  // namespace ruedo
