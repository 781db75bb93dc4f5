// A run that does not leave the program behind that launched it.
#include "run/backpressure.h"

#include <gtest/gtest.h>

#include "control_client.h"
#include "ruedo/tick_t.hpp"

namespace ruedo::run {
namespace {

constexpr int64_t kFarAhead = std::numeric_limits<int64_t>::max();

TEST(Backpressure, ReadsLinesOfThreeNumbers) {
  const auto read = read_launcher_progress("3 1250000 1300000");
  ASSERT_TRUE(read);
  EXPECT_EQ(read->epoch, 3);
  EXPECT_EQ(read->received_us, 1'250'000);
  EXPECT_EQ(read->used_us, 1'300'000);
  for (const char* line :
       {"", "1", "1 2", "1 2 x", "1 2 3 4", "1 2 99999999999999999999", "quit", "99999999999 2 3"})
    EXPECT_FALSE(read_launcher_progress(line)) << line;
}

TEST(Backpressure, LimitsNothingBeforeTheFirstReport) {
  const Backpressure pressure(5'000);
  EXPECT_FALSE(pressure.acts());
  EXPECT_EQ(pressure.limits().at_any_rate, kFarAhead);
  EXPECT_EQ(pressure.limits().at_highest_rate, kFarAhead);
}

TEST(Backpressure, GoesThirtyMillisecondsAhead) {
  Backpressure pressure(5'000);
  pressure.note_progress({0, 1'000'000});
  EXPECT_EQ(pressure.limits().at_any_rate, 206);  // 1.03 s
  EXPECT_EQ(pressure.limits().at_highest_rate, kFarAhead);
  pressure.note_progress({0, 1'000'000, 990'000});
  EXPECT_EQ(pressure.limits().at_any_rate, 206);
  EXPECT_EQ(pressure.limits().at_highest_rate, 201);  // 1.005 s
}

TEST(Backpressure, ALongStepIsAllowed) {
  Backpressure pressure(100'000);
  pressure.note_progress({0, 300'000, 300'000});
  EXPECT_EQ(pressure.limits().at_any_rate, 4);
  EXPECT_EQ(pressure.limits().at_highest_rate, 4);
}

TEST(Backpressure, IgnoresReportsOfAnotherEpoch) {
  Backpressure pressure(5'000);
  pressure.note_progress({0, 10'000'000});
  pressure.begin(1, 0);
  pressure.note_progress({0, 10'000'000});
  EXPECT_EQ(pressure.limits().at_any_rate, 6);
  pressure.note_progress({1, 5'000});
  EXPECT_EQ(pressure.limits().at_any_rate, 7);
}

TEST(Backpressure, AMegabyteIsOnTheWay) {
  Backpressure pressure(5'000);
  pressure.note_progress({0, 0});
  EXPECT_TRUE(pressure.has_room());
  pressure.published(10'000, 900'000);
  EXPECT_TRUE(pressure.has_room());
  pressure.published(20'000, 1'800'000);
  EXPECT_FALSE(pressure.has_room());
  pressure.note_progress({0, 10'000});
  EXPECT_TRUE(pressure.has_room());
}

class Launched : public testing::Test {
 protected:
  Launched() {
    RunOptions options = paused_server();
    options.rate = std::numeric_limits<double>::infinity();
    run_.begin(options, robot_sdf("r", 0, 0));
    note_progress({0, 0});
    run_.ask(request_t::RESUME);
  }
  void note_progress(const LauncherProgress& progress) { run_.server().note_progress(progress); }
  // The newest tick, once none that is newer has come for a while.
  SimTime stands_at() {
    SimTime last = -1;
    for (int quiet = 0; quiet < 3;) {
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
      SimTime newest = last;
      for (const tick_t& tick : run_.on<tick_t>("ruedo/tick"))
        newest = std::max(newest, tick.utime);
      quiet = newest == last ? quiet + 1 : 0;
      last = newest;
    }
    return last;
  }

  Controlled run_;
};

TEST_F(Launched, WaitsAndContinues) {
  EXPECT_EQ(stands_at(), 30'000);
  note_progress({0, 30'000});
  EXPECT_EQ(stands_at(), 60'000);
  note_progress({0, 1'000'000, 500'000});  // it works with what it knew at 0.5 s
  EXPECT_EQ(stands_at(), 515'000);
  note_progress({0, 1'000'000});
  EXPECT_EQ(stands_at(), 1'030'000);
}

TEST_F(Launched, TicksAreRepeatedWhileItWaits) {
  stands_at();
  const size_t before = run_.on<tick_t>("ruedo/tick").size();
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  EXPECT_GE(run_.on<tick_t>("ruedo/tick").size(), before + 3);
}

TEST_F(Launched, AnEpochBeginsAtItsBeginning) {
  note_progress({0, 1'000'000});
  stands_at();
  run_.reset(reset_request_t::ALL);
  run_.bus.forget();
  note_progress({0, 1'000'000});  // written before it knew
  EXPECT_EQ(stands_at(), 30'000);
}

TEST_F(Launched, APausedRunIsSteppedAsFarAsItMayGo) {
  stands_at();
  run_.ask(request_t::PAUSE);
  note_progress({0, 1'000'000});
  EXPECT_EQ(run_.step(100).step, 106);
}

}  // namespace
}  // namespace ruedo::run
