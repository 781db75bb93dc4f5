// Rates as exact fractions and the steps at which samples fall, by hand and over long times.
#include "ruedo/sim_time.h"

#include <stdexcept>

#include <gtest/gtest.h>

namespace ruedo {
namespace {

TEST(Rate, ReadsDecimalsExactly) {
  EXPECT_EQ(Rate::parse("30"), (Rate{30, 1}));
  EXPECT_EQ(Rate::parse("29.97"), (Rate{2997, 100}));
  EXPECT_EQ(Rate::parse("1e1"), (Rate{10, 1}));
  EXPECT_EQ(Rate::parse("2.5e-1"), (Rate{1, 4}));
  EXPECT_EQ(Rate::parse("1E+3"), (Rate{1000, 1}));
  EXPECT_EQ(Rate::parse("+0.5"), (Rate{1, 2}));
  EXPECT_EQ(Rate::parse(".5"), (Rate{1, 2}));
  EXPECT_EQ(Rate::parse("5."), (Rate{5, 1}));
  EXPECT_EQ(Rate::parse("0"), (Rate{0, 1}));
  EXPECT_EQ(Rate::parse("0.000"), (Rate{0, 1}));
  EXPECT_EQ(Rate::parse("1000000"), (Rate{1'000'000, 1}));
  EXPECT_EQ(Rate::parse("0.000000001"), (Rate{1, 1'000'000'000}));
  EXPECT_EQ(Rate::parse("50.000000000000000000000000"), (Rate{50, 1}));
  EXPECT_EQ(Rate::parse("000000000000000000000000000050"), (Rate{50, 1}));
  EXPECT_EQ(Rate::parse("0e999999"), (Rate{0, 1}));
}

TEST(Rate, RefusesEverythingElse) {
  for (const char* text : {"",
                           " ",
                           "-1",
                           "-0.5",
                           "abc",
                           "10 Hz",
                           "1,5",
                           "1.2.3",
                           "nan",
                           "inf",
                           "1e",
                           "1e+",
                           "1e+-3",
                           "e5",
                           ".",
                           "+",
                           "++1",
                           "1000000.1",
                           "1e7",
                           "1e99",
                           "1e999999999999",
                           "0.0000000001",
                           "1e-10",
                           "0x10",
                           "1.0000000001",
                           "123456789012345678901"}) {
    EXPECT_THROW(Rate::parse(text), std::invalid_argument) << text;
  }
}

TEST(SampleClock, TakesASampleAtTheFirstStepNotBefore) {
  const SampleClock clock({30, 1}, 5000);  // 33.3 ms in steps of 5 ms
  const int64_t expected[] = {0, 7, 14, 20, 27, 34, 40};
  for (int k = 0; k < 7; ++k) EXPECT_EQ(clock.step_of(k), expected[k]) << k;
  EXPECT_EQ(clock.samples_before(0), 0);
  EXPECT_EQ(clock.samples_before(1), 1);
  EXPECT_EQ(clock.samples_before(7), 1);
  EXPECT_EQ(clock.samples_before(8), 2);
}

TEST(SampleClock, PhaseMovesTheFirstSample) {
  const SampleClock clock({10, 1}, 5000, 12'000);  // 12 ms: the third step, 15 ms
  EXPECT_EQ(clock.step_of(0), 3);
  EXPECT_EQ(clock.step_of(1), 23);  // 112 ms
  EXPECT_EQ(clock.samples_before(3), 0);
  EXPECT_EQ(clock.samples_before(4), 1);
  const SampleClock each({0, 1}, 5000, 12'000);
  EXPECT_EQ(each.step_of(0), 3);
  EXPECT_EQ(each.step_of(2), 5);
  EXPECT_EQ(each.samples_before(3), 0);
  EXPECT_EQ(each.samples_before(6), 3);
}

TEST(SampleClock, ZeroAndRatesFromTheStepRateOnMeanEveryStep) {
  EXPECT_TRUE(SampleClock({0, 1}, 5000).every_step());
  EXPECT_TRUE(SampleClock({200, 1}, 5000).every_step());
  EXPECT_TRUE(SampleClock({1000, 1}, 5000).every_step());
  EXPECT_FALSE(SampleClock({199, 1}, 5000).every_step());
  const SampleClock clock({1000, 1}, 5000);
  EXPECT_EQ(clock.step_of(17), 17);
  EXPECT_EQ(clock.samples_before(17), 17);
}

// An hour at 29.97 Hz in steps of 5 ms: floor(3600 * 29.97) + 1 samples up to its end, each at its
// place.
TEST(SampleClock, AnHourAt2997) {
  const SampleClock clock(Rate::parse("29.97"), 5000);
  const int64_t steps = 3600 * 200;
  EXPECT_EQ(clock.samples_before(steps + 1), 107892 + 1);
  int64_t seen = 0;
  for (int64_t step = 0; step <= steps; ++step) {
    if (clock.samples_before(step + 1) == clock.samples_before(step)) continue;
    // k / 29.97 s = k * 100 000 000 / 2997 us: reached at this step, not at the one before.
    ASSERT_GE(step * 5000 * 2997, seen * 100'000'000) << seen;
    ASSERT_LT((step - 1) * 5000 * 2997, seen * 100'000'000) << seen;
    ASSERT_EQ(clock.step_of(seen), step);
    ++seen;
  }
  EXPECT_EQ(seen, 107893);
}

TEST(SampleClock, AMillionHoursDoNotOverflow) {
  const int64_t seconds = 3'600'000'000;
  const SampleClock slow({999'999'999, 1'000'000'000}, 1);
  EXPECT_EQ(slow.samples_before(seconds * 1'000'000 + 1), 3'599'999'996 + 1);  // 3.6e9 - 3.6
  const SampleClock fast({999'999, 1}, 1);
  const int64_t k = seconds * 999'999;
  EXPECT_EQ(fast.step_of(k), seconds * 1'000'000);
  EXPECT_EQ(fast.samples_before(seconds * 1'000'000), k);
  EXPECT_EQ(fast.samples_before(seconds * 1'000'000 + 1), k + 1);
}

// The two directions are inverses of each other for many rates, steps and phases.
TEST(SampleClock, StepOfAndSamplesBeforeAgree) {
  for (const char* rate : {"0.1", "1", "7.3", "29.97", "33.333333333", "59.94", "100", "166.7"}) {
    for (const int64_t step_us : {100, 999, 5000, 50'000}) {
      for (const int64_t phase : {0, 1, 5000, 123'457}) {
        const SampleClock clock(Rate::parse(rate), step_us, phase);
        for (int64_t k = 0; k < 50; ++k) {
          const int64_t step = clock.step_of(k);
          EXPECT_LE(clock.samples_before(step), k);
          EXPECT_GE(clock.samples_before(step + 1), k + 1);
        }
      }
    }
  }
}

}  // namespace
}  // namespace ruedo
