// Values that pass under a rule of a comparison: the laws of docs/regressions.md, on random values
// and on special ones.
#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "log/diff.h"
#include "ruedo/pose.h"

namespace ruedo::log {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr int64_t kExact = int64_t{1} << 53;  // up to here a double holds every integer

DiffRule absolute(double value) { return {.absolute = value}; }
DiffRule relative(double value) { return {.relative = value}; }
DiffRule angle(double value) { return {.angle = value}; }

class DiffRuleLaws : public testing::Test {
 protected:
  // Odd ones, ordinary ones, and any 64 bits.
  double number() {
    constexpr std::array kOdd = {0.0,
                                 -0.0,
                                 1.0,
                                 -1.0,
                                 kInf,
                                 -kInf,
                                 kNan,
                                 -kNan,
                                 M_PI,
                                 -M_PI,
                                 std::numeric_limits<double>::max(),
                                 std::numeric_limits<double>::lowest(),
                                 std::numeric_limits<double>::denorm_min()};
    switch (dice_() % 3) {
      case 0: return kOdd[dice_() % kOdd.size()];
      case 1: return std::normal_distribution(0.0, 5.0)(dice_);
      default: {
        const uint64_t bits = dice_();
        double value = 0.0;
        std::memcpy(&value, &bits, sizeof value);
        return value;
      }
    }
  }
  double finite() {
    for (;;) {
      if (const double value = number(); std::isfinite(value)) return value;
    }
  }
  int64_t integer() {
    constexpr std::array kOdd = {int64_t{0},
                                 kExact,
                                 kExact + 1,
                                 -kExact - 1,
                                 std::numeric_limits<int64_t>::max(),
                                 std::numeric_limits<int64_t>::min()};
    return dice_() % 2 == 0 ? kOdd[dice_() % kOdd.size()] : static_cast<int64_t>(dice_());
  }
  FieldValue value() {
    if (dice_() % 3 == 0) return integer();
    return number();
  }
  double tolerance() { return std::abs(finite()); }
  DiffRule rule() {
    switch (dice_() % 4) {
      case 0: return absolute(tolerance());
      case 1: return relative(tolerance());
      case 2: return angle(tolerance());
      default: return {.absolute = tolerance(), .relative = tolerance(), .angle = tolerance()};
    }
  }

  std::mt19937_64 dice_{7};
};

constexpr int kDraws = 20'000;

TEST_F(DiffRuleLaws, EveryValueEqualsItself) {
  for (int i = 0; i < kDraws; ++i) {
    const FieldValue each = value();
    const DiffRule any = rule();
    EXPECT_TRUE(passes(each, each, nullptr)) << to_string(each);
    EXPECT_TRUE(passes(each, each, &any)) << to_string(each);
  }
}

TEST_F(DiffRuleLaws, AbsoluteTolerancesAndAnglesHaveNoDirection) {
  for (int i = 0; i < kDraws; ++i) {
    const bool whole = i % 2 == 0;
    const FieldValue a = whole ? FieldValue(integer()) : number();
    const FieldValue b = whole ? FieldValue(integer()) : number();
    for (const DiffRule& each : {absolute(tolerance()), angle(tolerance())})
      EXPECT_EQ(passes(a, b, &each), passes(b, a, &each)) << to_string(a) << " " << to_string(b);
  }
}

TEST_F(DiffRuleLaws, InfinityEqualsOnlyTheSameInfinity) {
  for (int i = 0; i < kDraws; ++i) {
    const DiffRule any = rule();
    const double other = number();
    for (const double infinity : {kInf, -kInf}) {
      EXPECT_EQ(passes(infinity, other, &any), other == infinity) << other;
      EXPECT_EQ(passes(other, infinity, &any), other == infinity) << other;
    }
  }
}

TEST_F(DiffRuleLaws, NanEqualsNanOfAnyBits) {
  EXPECT_TRUE(passes(kNan, -kNan, nullptr));
  for (int i = 0; i < kDraws; ++i) {
    const DiffRule any = rule();
    const double other = number();
    for (const double nan : {kNan, -kNan}) {
      EXPECT_EQ(passes(nan, other, &any), std::isnan(other)) << other;
      EXPECT_EQ(passes(other, nan, &any), std::isnan(other)) << other;
    }
  }
}

TEST_F(DiffRuleLaws, AWiderToleranceLetsMorePass) {
  for (int i = 0; i < kDraws; ++i) {
    const FieldValue a = i % 2 == 0 ? FieldValue(integer()) : number();
    const FieldValue b = i % 2 == 0 ? FieldValue(integer()) : number();
    const double one = tolerance(), two = tolerance();
    const double narrow = std::min(one, two), wide = std::max(one, two);
    for (const auto of : {absolute, relative, angle}) {
      const DiffRule narrower = of(narrow), wider = of(wide);
      EXPECT_LE(passes(a, b, &narrower), passes(a, b, &wider)) << to_string(a) << to_string(b);
    }
    EXPECT_LE(passes(a, b, nullptr), [&] {
      const DiffRule none = absolute(0);
      return passes(a, b, &none);
    }());
  }
}

// Whole numbers of a size whose differences a double holds.
TEST_F(DiffRuleLaws, TheDifferenceOfFiniteNumbersDecides) {
  std::uniform_int_distribution<int64_t> small(-100, 100);
  for (int i = 0; i < kDraws; ++i) {
    const int64_t golden = small(dice_), other = small(dice_), most = std::abs(small(dice_));
    const int64_t difference = std::abs(golden - other);
    const DiffRule by = absolute(static_cast<double>(most));
    const DiffRule times = relative(static_cast<double>(most));
    EXPECT_EQ(passes(golden, other, &by), difference <= most);
    EXPECT_EQ(passes(static_cast<double>(golden), static_cast<double>(other), &by),
              difference <= most);
    EXPECT_EQ(passes(golden, other, &times), difference <= most * std::abs(golden))
        << "of the golden value: of 0 nothing";
  }
}

TEST_F(DiffRuleLaws, IntegersAreComparedExactly) {
  for (int i = 0; i < kDraws; ++i) {
    const int64_t golden = integer();
    const int64_t other = i % 2 == 0 ? integer() : golden ^ static_cast<int64_t>(dice_() % 4);
    const __int128 apart = __int128{golden} - other;
    const __int128 size = apart < 0 ? -apart : apart;
    const double most = std::floor(std::ldexp(1.0, static_cast<int>(dice_() % 65)));
    const DiffRule by = absolute(most);
    EXPECT_EQ(passes(golden, other, &by), size <= static_cast<__int128>(most))
        << golden << " " << other << " by " << most;
    EXPECT_EQ(passes(golden, other, nullptr), golden == other);
  }
}

TEST_F(DiffRuleLaws, AnglesGoRound) {
  std::uniform_real_distribution<double> heading(-M_PI, M_PI), off(-0.1, 0.1);
  std::uniform_int_distribution<int> turns(-3, 3);
  const DiffRule by = angle(0.05), any = angle(3.2);
  for (int i = 0; i < kDraws; ++i) {
    const double golden = heading(dice_), apart = off(dice_);
    if (std::abs(std::abs(apart) - 0.05) < 1e-9) continue;
    EXPECT_EQ(passes(golden, golden + apart + 2 * M_PI * turns(dice_), &by),
              std::abs(apart) <= 0.05);
    EXPECT_TRUE(passes(golden, heading(dice_), &any)) << "more than half a turn is not far";
  }
}

TEST_F(DiffRuleLaws, ZerosHaveASignWithoutARule) {
  const DiffRule none = absolute(0);
  EXPECT_FALSE(passes(0.0, -0.0, nullptr));
  EXPECT_TRUE(passes(0.0, -0.0, &none));
}

TEST_F(DiffRuleLaws, TextsAndBooleansAreEqualOrNot) {
  const DiffRule wide{.absolute = 1e300, .relative = 1e300, .angle = 4}, ignore{.ignore = true};
  EXPECT_FALSE(passes(std::string_view("a"), std::string_view("b"), &wide));
  EXPECT_TRUE(passes(std::string_view("a"), std::string_view("a"), nullptr));
  EXPECT_FALSE(passes(true, false, &wide));
  EXPECT_TRUE(passes(true, false, &ignore));
  EXPECT_TRUE(passes(kNan, 1.0, &ignore));
}

}  // namespace
}  // namespace ruedo::log
