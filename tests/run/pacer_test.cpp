#include "run/pacer.h"

#include <chrono>

#include <gtest/gtest.h>

namespace ruedo::run {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

// How long the pacer takes to let all steps go.
Seconds run_of(Pacer& pacer) {
  const auto begun = Clock::now();
  int64_t step = 0;
  while (pacer.wait(step, 32) > 0) {
  }
  return Clock::now() - begun;
}

TEST(Pacer, ARunTakesItsTimeOverItsRate) {
  constexpr int64_t kStep_us = 5000;
  Pacer slow(kStep_us, 0.5, 60);  // 0.3 s of sim time
  EXPECT_GE(run_of(slow), Seconds(0.6));
  Pacer fast(kStep_us, 100.0, 6000);  // 30 s
  const Seconds taken = run_of(fast);
  EXPECT_GE(taken, Seconds(0.3));
  EXPECT_LT(taken, Seconds(30.0)) << "as in real time";
}

TEST(Pacer, ANewRateCountsFromItsMoment) {
  Pacer pacer(5000, 0.001, 60);
  int64_t step = -1;
  EXPECT_EQ(pacer.wait(step, 32), 1);
  pacer.set_rate(2.0);
  const Seconds taken = run_of(pacer);  // steps 1 to 60: the first is due at once
  EXPECT_GE(taken, Seconds(59 * 0.005 / 2.0));
  EXPECT_LT(taken, Seconds(30.0));
}

}  // namespace
}  // namespace ruedo::run
