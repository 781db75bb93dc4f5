// Receiving while the user's code works: only callbacks wait for callbacks, skipped samples are
// counted, commands arrive, and the server gets the program's progress.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>
#include <limits>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "callbacks/callback_queue.h"
#include "fake_transport.h"
#include "progress.h"

using namespace ruedo::client;
using namespace std::chrono_literals;

namespace {

constexpr Duration kPatience = 300.0;
constexpr int64_t kNever = std::numeric_limits<int64_t>::max();

class Receiving : public testing::Test {
 protected:
  // A callback that waits for go_on.
  Subscription block(const Stream<Odometry>& odometry) {
    return odometry.on_sample([this, first = true](const Odometry&) mutable {
      if (std::exchange(first, false)) {
        here.set_value();
        going_on.wait();
      }
      ++calls;
    });
  }
  // The lines that the server is told of a simulation, after the first ones.
  std::vector<std::string> lines() {
    const std::lock_guard lock(mutex);
    return told;
  }
  void tell() {
    Progress& progress = server->client.lock()->progress();
    progress.begin(
        [this](const std::string& line) {
          const std::lock_guard lock(mutex);
          told.push_back(line);
        },
        0, 0);
    progress.listen();
    const std::lock_guard lock(mutex);
    told.clear();
  }

  std::shared_ptr<FakeServer> server = std::make_shared<FakeServer>();
  std::promise<void> here, go_on;
  const std::shared_future<void> going_on = go_on.get_future().share();
  std::atomic<int64_t> calls{0};
  std::mutex mutex;
  std::vector<std::string> told;
};

TEST_F(Receiving, ContinuesBesideACallbackThatDoesNotReturn) {
  const Simulation sim = simulation(server);
  const auto odometry = sim.robot("p3at").odometry();
  const Subscription blocked = block(odometry);
  server->send_odometry("p3at", 20'000, 1.0);
  here.get_future().wait();
  server->send_odometry("p3at", 40'000, 2.0);
  EXPECT_EQ(odometry.latest(kPatience).x, 2.0);
  sim.pause();  // it is answered
  EXPECT_EQ(calls, 0);
  go_on.set_value();
  server->await_delivery();
  EXPECT_EQ(calls, 2);
}

TEST_F(Receiving, CallbacksThatAreTooSlowGetTheNewest) {
  constexpr int kSent = 20'000;  // more than 3 MB, as they are counted
  const Simulation sim = simulation(server);
  const auto odometry = sim.robot("p3at").odometry();
  int events = 0;
  double last = 0.0;
  const Subscription event = sim.on_new_run([&] { ++events; });
  const Subscription blocked = block(odometry);
  const Subscription newest = odometry.on_sample([&](const Odometry& sample) { last = sample.x; });
  server->send_odometry("p3at", 20'000, 1.0);
  here.get_future().wait();
  testing::internal::CaptureStderr();
  for (int i = 2; i <= kSent; ++i) server->send_odometry("p3at", 20'000 * i, i);
  server->send_tick(20'000 * kSent);
  server->await([&] { return sim.time() >= 0.02 * kSent; });
  go_on.set_value();
  server->await_delivery();
  EXPECT_EQ(testing::internal::GetCapturedStderr(),
            "ruedo: callbacks are slower than their samples: they get only the newest sample of "
            "each channel, and dropped() of each stream counts the others (shown once)\n");
  EXPECT_EQ(last, kSent);
  EXPECT_LT(calls, kSent / 2);
  EXPECT_EQ(calls + odometry.dropped(), kSent);
}

TEST_F(Receiving, InLockstepCallbacksMissNothing) {
  server->features = -1;
  constexpr int kSent = 20'000;
  const Simulation sim = simulation(server);
  const auto odometry = sim.robot("p3at").odometry();
  const Subscription blocked = block(odometry);
  for (int i = 1; i <= kSent; ++i) server->send_odometry("p3at", 20'000 * i, i);
  here.get_future().wait();
  server->await([&] { return sim.time() >= 0.02 * kSent; });
  go_on.set_value();
  server->await_delivery();
  EXPECT_EQ(calls, kSent);
  EXPECT_EQ(odometry.dropped(), 0);
}

TEST_F(Receiving, AReaderCountsSkippedAndLostSamples) {
  const Simulation sim = simulation(server);
  const auto odometry = sim.robot("p3at").odometry();  // 50 Hz
  const Subscription listening = odometry.on_sample([](const Odometry&) {});
  server->send_odometry("p3at", 20'000, 1.0);
  (void)odometry.next(kPatience);
  EXPECT_EQ(odometry.dropped(), 0);  // none before the first
  for (int i = 2; i <= 4; ++i) server->send_odometry("p3at", 20'000 * i, i);
  EXPECT_EQ(odometry.next(kPatience).x, 4.0);
  EXPECT_EQ(odometry.dropped(), 2);
  server->send_odometry("p3at", 20'000 * 8, 8.0);  // three are missing
  EXPECT_EQ(odometry.next(kPatience).x, 8.0);
  EXPECT_EQ(odometry.dropped(), 5);
  EXPECT_EQ(sim.robot("p3at").odometry().dropped(), 5);  // it continues where it was read
}

TEST_F(Receiving, ADamagedMessageIsTheReadersErrorOnce) {
  const Simulation sim = simulation(server);
  const auto odometry = sim.robot("p3at").odometry();
  const Subscription blocked = odometry.on_sample([&](const Odometry&) { ++calls; });
  ruedo::odometry_t message{};
  std::vector<uint8_t> bytes = encoded(message);
  bytes.resize(bytes.size() / 2);
  server->send_bytes("p3at/odometry", bytes);
  EXPECT_THROW((void)odometry.latest(kPatience), TypeMismatch);
  server->send_odometry("p3at", 20'000, 1.0);
  EXPECT_EQ(odometry.latest(kPatience).x, 1.0);
  server->await_delivery();
  EXPECT_EQ(calls, 1);
}

TEST_F(Receiving, NextAfterAMotionReturnsANewerSample) {
  const Simulation sim = simulation(server);
  const Robot robot = sim.robot("p3at");
  const auto odometry = robot.odometry();
  const Subscription listening = odometry.on_sample([](const Odometry&) {});
  const Motion motion = robot.advance(1.0);
  server->send_odometry("p3at", 40'000, 1.0);
  (void)odometry.latest(kPatience);
  server->send_odometry("p3at", 60'000, 2.0);
  server->send_motion("p3at", 70'000, motion.id(), ruedo::motion_status_t::STATE_DONE);
  motion.wait(kPatience);
  EXPECT_EQ(odometry.latest(kPatience).x, 2.0);
  EXPECT_EQ(std::async(std::launch::async, [&] { return robot.odometry().latest(); }).get().x, 2.0);
  server->send_odometry("p3at", 65'000, 3.0);
  EXPECT_THROW(odometry.next(0.05), Timeout);
  server->send_odometry("p3at", 80'000, 4.0);
  EXPECT_EQ(odometry.next(kPatience).x, 4.0);
}

TEST_F(Receiving, RepeatsAPrimitiveUntilAStatusShowsIt) {
  const Simulation sim = simulation(server);
  const Robot robot = sim.robot("p3at");
  const Motion first = robot.advance(1.0), second = robot.advance(2.0);
  server->await([&] { return server->heard("p3at/move") >= 4; });  // of the second, twice
  EXPECT_EQ(server->id_of_last_move, second.id());
  server->send_motion("p3at", 1000, second.id(), ruedo::motion_status_t::STATE_RUNNING);
  server->await_delivery();
  const int64_t shown = server->heard("p3at/move");
  std::this_thread::sleep_for(500ms);  // another would have gone out meanwhile
  EXPECT_EQ(server->heard("p3at/move"), shown);

  robot.rotate(1.0);
  robot.set_velocity(0.1, 0.0);
  std::this_thread::sleep_for(300ms);
  EXPECT_EQ(server->heard("p3at/move"), shown + 1);
}

TEST_F(Receiving, TicksRepeatTheVelocityAtTheDriversPeriod) {
  const Simulation sim = simulation(server);
  sim.robot("p3at").set_velocity(0.1, 0.0);  // the watchdog has 40 ms: every 10 ms
  const int64_t before = server->heard("p3at/velocity");
  for (int i = 1; i <= 2000; ++i) server->send_tick(1000 * i);
  server->await_delivery();
  const int64_t repeated = server->heard("p3at/velocity") - before;  // by real time a few, too
  EXPECT_GE(repeated, 200);
  EXPECT_LT(repeated, 1000);
}

TEST_F(Receiving, ReportsProgressAfterItsCallbacks) {
  const Simulation sim = simulation(server);
  tell();
  const auto odometry = sim.robot("p3at").odometry();
  server->send_tick(20'000);
  server->await_delivery();
  const std::string first = "0 20000 " + std::to_string(kNever) + "\n";
  EXPECT_THAT(lines(), testing::ElementsAre(first));
  const Subscription blocked = block(odometry);
  server->send_odometry("p3at", 40'000, 1.0);
  here.get_future().wait();
  server->send_tick(40'000);
  server->await([&] { return sim.time() >= 0.04; });
  EXPECT_THAT(lines(), testing::ElementsAre(first));
  go_on.set_value();
  server->await_delivery();
  EXPECT_THAT(lines(), testing::ElementsAre(first, "0 40000 " + std::to_string(kNever) + "\n"));
}

TEST_F(Receiving, ReportsThreadsThatUseASample) {
  const Simulation sim = simulation(server);
  const auto odometry = sim.robot("p3at").odometry();
  const Subscription listening = odometry.on_sample([](const Odometry&) {});
  tell();
  server->send_odometry("p3at", 60'000, 1.0);
  (void)odometry.next(kPatience);
  const auto used = [&] {
    const std::string last = lines().back();
    return std::stoll(last.substr(last.rfind(' ')));
  };
  const int64_t begin = used();
  EXPECT_GE(begin, 60'000);
  EXPECT_LT(begin, kNever);
  server->await([&] { return used() >= begin + 50'000; });  // with real time
  EXPECT_THROW(odometry.next(0.001), Timeout);
  EXPECT_EQ(used(), kNever);  // it waits
  (void)odometry.latest();
  EXPECT_LT(used(), kNever);
  server->await([&] { return used() == kNever; });  // it does something else

  auto sleeping = std::async(std::launch::async, [&] { sim.sleep(0.1); });
  auto waiting = std::async(std::launch::async, [&] { return odometry.next(kPatience); });
  std::this_thread::sleep_for(50ms);
  EXPECT_EQ(used(), kNever);
  server->send_odometry("p3at", 80'000, 2.0);
  EXPECT_EQ(waiting.get().x, 2.0);
  EXPECT_LT(used(), kNever);
  server->await([&] { return used() == kNever; });
  server->send_tick(200'000);
  sleeping.get();
  EXPECT_GE(used(), 200'000);
  EXPECT_LT(used(), kNever);
}

TEST(Progress, ASecondEpochRestartsTheReports) {
  Progress progress;
  std::vector<std::string> lines;
  progress.use(1000);  // not reported yet
  EXPECT_FALSE(progress.in_use());
  progress.begin([&](const std::string& line) { lines.push_back(line); }, 0, 0);
  lines.clear();
  progress.use(1000);
  EXPECT_TRUE(progress.in_use());
  progress.received(1, 0);
  progress.received(1, 0);  // nothing new
  EXPECT_FALSE(progress.in_use());
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_EQ(lines[1], "1 0 " + std::to_string(kNever) + "\n");
}

// Each of the calls that end the beginning.
TEST(Progress, AProgramIsWaitedForUntilItsFirstCall) {
  std::vector<std::string> lines;
  const auto used = [&] { return std::stoll(lines.back().substr(lines.back().rfind(' '))); };
  using Call = std::function<void(Progress&)>;
  for (const Call& call : {Call([](Progress& progress) { progress.wait(); }),
                           Call([](Progress& progress) { progress.listen(); }),
                           Call([](Progress& progress) { progress.use(7'000'000); })}) {
    Progress progress;
    progress.begin([&](const std::string& line) { lines.push_back(line); }, 3, 5'000'000);
    EXPECT_EQ(lines.back().substr(0, 4), "3 0 ");
    std::this_thread::sleep_for(700ms);  // longer than one that has been given something
    progress.received(3, 5'010'000);
    EXPECT_TRUE(progress.in_use());
    EXPECT_GE(used(), 5'700'000);
    EXPECT_LT(used(), 7'000'000);
    call(progress);
    EXPECT_GE(used(), 7'000'000);
  }
}

TEST(CallbackQueues, ABorrowerRunsNewCallsAndWaitsForTheRunningOne) {
  CallbackQueue queue;
  queue.start();
  std::promise<void> here, go_on;
  std::vector<std::thread::id> ran;
  queue.put(
      [&] {
        here.set_value();
        go_on.get_future().wait();
        ran.push_back(std::this_thread::get_id());
      },
      "first");
  here.get_future().wait();
  {
    const CallbackQueue::Borrowed borrowed(queue);
    queue.put([&] { ran.push_back(std::this_thread::get_id()); }, "second");
    go_on.set_value();
    queue.run_waiting();
    queue.put([&] { ran.push_back(std::this_thread::get_id()); }, "third");
  }
  const auto me = std::this_thread::get_id();
  EXPECT_THAT(ran, testing::ElementsAre(testing::Ne(me), me, me));
}

}  // namespace
