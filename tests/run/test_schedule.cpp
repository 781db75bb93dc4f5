// The order of messages, sample counts over an hour, slow sinks, and allocations in the steady
// state.
#include <atomic>

#include <gtest/gtest.h>

#include "base/channel_names.h"
#include "base/crc32.h"
#include "counting_new.h"
#include "ruedo/decode.h"
#include "ruedo/odometry_t.hpp"
#include "ruedo/pose_t.hpp"
#include "ruedo/tick_t.hpp"
#include "ruedo/world_info_t.hpp"
#include "ruedo/world_state_t.hpp"
#include "running.h"

namespace ruedo::run {
namespace {

int64_t utime_of(const Message& message) {
  int64_t value = 0;
  for (size_t i = 8; i < 16; ++i) value = value << 8 | message.bytes[i];
  return value;
}

TEST(Schedule, StepThenModuleThenRobot) {
  MemoryBus bus;
  run::Run server(load_text(robot_sdf("b", 0, 0) + robot_sdf("a", 2, 0)), fast(0.1), bus);
  server.run();
  // At 0 and at every 20 ms: odometry and pose of b (first in the world), then of a; collisions at
  // 10 Hz; and the world at 30 Hz, last.
  std::map<int64_t, std::vector<std::string>> at;
  int64_t last = 0;
  for (const Message& message : bus.messages()) {
    if (message.channel == "ruedo/info" || message.channel == "ruedo/tick") continue;
    EXPECT_GE(utime_of(message), last);
    last = utime_of(message);
    at[last].push_back(message.channel);
  }
  using Names = std::vector<std::string>;
  const auto names_at = [&](int64_t us) {
    Names names;
    for (const std::string& name : at[us]) {
      // Nor the run's last message, which reports its end to clients.
      if (name.find("/motion") == std::string::npos && name.find("/joints") == std::string::npos &&
          name != kReplyChannel)
        names.push_back(name);
    }
    return names;
  };
  EXPECT_EQ(names_at(20'000), (Names{"b/odometry/twist", "b/odometry", "b/pose", "a/odometry/twist",
                                     "a/odometry", "a/pose"}));
  EXPECT_EQ(names_at(35'000), (Names{"ruedo/world"}));  // the first step at or after 33.3 ms
  EXPECT_EQ(names_at(100'000),
            (Names{"b/collisions", "b/odometry/twist", "b/odometry", "b/pose", "a/collisions",
                   "a/odometry/twist", "a/odometry", "a/pose", "ruedo/world"}));
}

// An hour of sim time: sample k is at the first step at or after k / rate, and none is missing.
TEST(Schedule, AnHourWithoutDrift) {
  MemoryBus bus;
  bus.keep = false;
  std::map<std::string, int64_t> counts;
  RunOptions options = fast(3600.0);
  bus.on_publish = [&](const std::string& channel) { ++counts[channel]; };
  run::Run server(load_text(robot_sdf("r", 0, 0)), options, bus);
  server.run();
  EXPECT_EQ(counts["r/odometry"], 50 * 3600 + 1);
  EXPECT_EQ(counts["r/pose"], 50 * 3600 + 1);
  EXPECT_EQ(counts["r/motion"], 10 * 3600 + 1);
  EXPECT_EQ(counts["ruedo/world"], 30 * 3600 + 1);
  EXPECT_EQ(counts["ruedo/tick"], 10 * 3600 + 1);
  EXPECT_EQ(counts["ruedo/info"], 3600 + 1);
}

TEST(Schedule, StampsOfAnOddRate) {
  const auto world = load_text(robot_sdf("r", 0, 0));
  MemoryBus bus;
  run::Run server(world, fast(60.0), bus);
  server.run();
  int64_t k = 0;
  for (const Message& message : bus.messages()) {
    if (message.channel != "ruedo/world") continue;
    // 30 Hz in steps of 5 ms: the least multiple of 5000 us that is >= k / 30 s, in integers.
    EXPECT_EQ(utime_of(message), (k * 1'000'000 + 30 * 5000 - 1) / (30 * 5000) * 5000) << k;
    ++k;
  }
  EXPECT_EQ(k, 30 * 60 + 1);
}

// A sink that blocks stops the simulation within the batches that may be in flight.
TEST(Schedule, SlowSinkBoundsTheRun) {
  MemoryBus bus;
  bus.keep = false;
  std::atomic<bool> open{false};
  std::atomic<int64_t> rounds{0};
  std::mutex mutex;
  std::condition_variable changed;
  bus.on_publish = [&](const std::string&) {
    std::unique_lock lock(mutex);
    changed.wait(lock, [&] { return open.load(); });
  };
  RunOptions options = fast(10.0);
  options.simulation.batch_steps = 8;
  options.simulation.before_batch = [&](const std::string& module) {
    if (module == "kinematics") {
      ++rounds;
      rounds.notify_one();
    }
  };
  run::Run server(load_text(robot_sdf("r", 0, 0)), options, bus);
  std::thread thread([&] { server.run(); });
  rounds.wait(0);
  // In the time of a whole unblocked run this one could have ended.
  MemoryBus other_bus;
  other_bus.keep = false;
  run::Run(load_text(robot_sdf("r", 0, 0)), fast(10.0), other_bus).run();
  const int64_t while_blocked = rounds;
  {
    std::lock_guard lock(mutex);
    open = true;
  }
  changed.notify_all();
  thread.join();
  EXPECT_GE(while_blocked, 1);
  EXPECT_LE(while_blocked, engine::Simulation::kBatches);
  EXPECT_GE(rounds, 2001 / 8);
}

TEST(Schedule, SteadyStateAllocatesNothing) {
  MemoryBus bus;
  bus.keep = false;
  uint64_t at_start = 0, at_end = 0;
  int64_t worlds = 0;
  bus.on_publish = [&](const std::string& channel) {
    if (channel != "ruedo/world") return;
    ++worlds;  // 30 a second
    if (worlds == 301) at_start = allocations();
    if (worlds == 451) at_end = allocations();  // 5 s, 1000 steps later
  };
  RunOptions options = fast(20.0);
  options.control = false;
  run::Run server(load_text(robot_sdf("r", 0, 0)), options, bus);
  server.run();
  ASSERT_GE(worlds, 451);
  EXPECT_EQ(at_end - at_start, 0u);
}

TEST(Schedule, TickListsTheMessagesOfItsStep) {
  MemoryBus bus;
  run::Run server(load_text(robot_sdf("r", 0, 0)), fast(0.1), bus);
  server.run();
  const auto messages = bus.messages();
  size_t checked = 0;
  for (size_t i = 0; i < messages.size(); ++i) {
    if (messages[i].channel != "ruedo/tick") continue;
    tick_t tick;
    ASSERT_EQ(decode_checked(messages[i].bytes.data(), messages[i].bytes.size(), tick),
              DecodeFault::none);
    ASSERT_LE(static_cast<size_t>(tick.nmanifest), i);
    for (int32_t k = 0; k < tick.nmanifest; ++k) {
      const Message& message = messages[i - static_cast<size_t>(tick.nmanifest - k)];
      EXPECT_EQ(server.channels().list()[tick.manifest[k].channel_index].bus_name, message.channel);
      EXPECT_EQ(static_cast<size_t>(tick.manifest[k].size), message.bytes.size());
      EXPECT_EQ(static_cast<uint32_t>(tick.manifest[k].crc),
                crc32(message.bytes.data(), message.bytes.size()));
      ++checked;
    }
  }
  EXPECT_GE(checked, 6u);
  const uint8_t nine[] = {'1', '2', '3', '4', '5', '6', '7', '8', '9'};
  EXPECT_EQ(crc32(nine, 9), 0xCBF43926u);  // the check value of CRC-32
}

}  // namespace
}  // namespace ruedo::run
