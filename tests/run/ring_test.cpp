// A log of bounded size: inputs are complete, and the published messages are there up to the end.
#include <filesystem>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/outcome.h"
#include "log/header.h"
#include "log/index.h"
#include "log/reader.h"
#include "log/ring.h"
#include "ruedo/request_t.hpp"
#include "run/repeat/verify.h"
#include "running.h"

namespace ruedo::log {
namespace {

namespace fs = std::filesystem;
using run::fast;
using run::load_text;
using run::MemoryBus;
using run::robot_sdf;

class RingTest : public testing::Test {
 protected:
  RingTest() { fs::create_directory(folder_); }
  ~RingTest() override { fs::remove_all(folder_); }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  int64_t bytes() const {
    int64_t sum = 0;
    for (const auto& entry : fs::directory_iterator(folder_))
      sum += static_cast<int64_t>(entry.file_size());
    return sum;
  }
  std::vector<std::string> numbered() const {
    std::set<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_))
      names.insert(entry.path().filename().string());
    names.erase("run.lcm");
    return {names.begin(), names.end()};
  }

  const fs::path folder_ = fs::temp_directory_path() / ("ring_" + std::to_string(::getpid()));
};

std::vector<Event> events_of(const std::string& path) {
  Reader reader(path);
  std::vector<Event> events;
  for (Event event; reader.next(event);) events.push_back(event);
  EXPECT_EQ(reader.fault(), "");
  return events;
}

std::vector<uint8_t> applied(int32_t kind) {
  applied_t message{};
  message.kind = kind;
  message.channel = "ruedo/request";
  return engine::encoded(message);
}

constexpr int64_t kLimit = 200'000;

// 1 000 steps of 2 000 bytes: ten times the limit.
void write_steps(Ring& ring, int first, int count) {
  const std::vector<uint8_t> half(1000);
  for (int step = first; step < first + count; ++step) {
    ring.begin_step(step);
    ring.write(step, "r/scan", half.data(), half.size(), false);
    ring.write(step, "r/pose", half.data(), half.size(), false);
    if (step % 100 == 0) {
      const std::vector<uint8_t> command = applied(0);
      ring.write(step, kAppliedChannel, command.data(), command.size(), true);
    }
  }
  ring.flush();
}

TEST_F(RingTest, KeepsInputsAndTheLatestMessages) {
  const std::vector<uint8_t> header(100), spawn = applied(request_t::SPAWN);
  {
    Ring ring(path("run.lcm"), kLimit);
    ring.write(0, kHeaderChannel, header.data(), header.size(), true);
    write_steps(ring, 0, 5);
    ring.write(5, kAppliedChannel, spawn.data(), spawn.size(), true);
    for (int step = 5; step < 1000; step += 5) {
      write_steps(ring, step, 5);
      ASSERT_LE(bytes(), kLimit + 10'100) << "at step " << step;  // five steps beyond
    }
    EXPECT_EQ(ring.error(), "");
    EXPECT_TRUE(ring.repeats());
  }
  std::vector<std::string> acted;
  for (const Event& event : events_of(path("run.lcm"))) acted.push_back(event.channel);
  EXPECT_EQ(acted.size(), 1 + 1 + 10u);  // the header, the SPAWN, a command each 100 steps
  const std::vector<std::string> files = numbered();
  ASSERT_GE(files.size(), 4u);
  int64_t next = -1;
  for (const std::string& file : files) {
    std::vector<Event> events = events_of(path(file));
    ASSERT_GE(events.size(), 3u);
    EXPECT_EQ(events[0].channel, kHeaderChannel);
    EXPECT_EQ(events[1].data, spawn);
    std::erase_if(events, [](const Event& event) { return event.channel.starts_with("ruedo/"); });
    EXPECT_EQ(events.front().channel, "r/scan");  // whole steps
    EXPECT_EQ(events.back().channel, "r/pose");
    if (next >= 0) {
      EXPECT_EQ(events.front().timestamp_us, next);
    }
    next = events.back().timestamp_us + 1;
  }
  EXPECT_EQ(next, 1000);
}

TEST_F(RingTest, StopsKeepingInputsAtHalfOfTheLimit) {
  Ring ring(path("run.lcm"), kLimit);
  const std::vector<uint8_t> record(1000);
  for (int step = 0; step < 1000; ++step) {
    ring.begin_step(step);
    ring.write(step, kAppliedChannel, record.data(), record.size(), true);
  }
  ring.flush();
  EXPECT_FALSE(ring.repeats());
  EXPECT_NEAR(static_cast<double>(fs::file_size(path("run.lcm"))), kLimit / 2.0, 1100.0);
  EXPECT_LE(bytes(), kLimit + 1100);
}

TEST_F(RingTest, KeepsLargeWorldChanges) {
  Ring ring(path("run.lcm"), kLimit);
  const std::vector<uint8_t> header(20'000), half(1000);
  ring.write(0, kHeaderChannel, header.data(), header.size(), true);
  applied_t large{};
  large.kind = request_t::SPAWN;
  large.channel = "ruedo/request";
  large.data.resize(3000);
  large.size = 3000;
  const std::vector<uint8_t> spawn = engine::encoded(large);
  for (int step = 0; step < 300; ++step) {
    ring.begin_step(step);
    ring.write(step, kAppliedChannel, spawn.data(), spawn.size(), true);
    write_steps(ring, step, 1);
    ASSERT_LE(bytes(), 2 * kLimit) << "at step " << step;
  }
  EXPECT_FALSE(ring.follows());
  EXPECT_FALSE(ring.repeats());
  const std::vector<std::string> files = numbered();
  ASSERT_GE(files.size(), 3u);  // files do not consist of their beginnings alone
  const std::vector<Event> events = events_of(path(files.front()));
  EXPECT_EQ(events[0].data, header);
  EXPECT_EQ(events[1].data, spawn);
  EXPECT_THAT(events, testing::Contains(testing::Field(&Event::channel, "r/scan")));
}

TEST_F(RingTest, ReplacesTheFilesOfAnEarlierRunAndNoOthers) {
  for (const char* name :
       {"run.000007.lcm", "run.1.lcm", "run.000007.txt", "runs.000001.lcm", "run.20261127.lcm"})
    std::ofstream(path(name)) << "old";
  {
    Writer(path("run.091500.lcm")).write(0, "r/pose", nullptr, 0);
  }  // another run's
  {
    Ring earlier(path("run.lcm"), kLimit);
    write_steps(earlier, 0, 1000);
    EXPECT_GT(numbered().size(), 6 + 4u);
  }
  Ring ring(path("run.lcm"), kLimit);
  write_steps(ring, 0, 1);
  EXPECT_THAT(numbered(), testing::ElementsAre("run.000001.lcm", "run.000007.lcm", "run.000007.txt",
                                               "run.091500.lcm", "run.1.lcm", "run.20261127.lcm",
                                               "runs.000001.lcm"));
}

TEST_F(RingTest, RepeatsTheRunFromItsInputs) {
  const auto world = load_text(robot_sdf("r", 0, 0));
  {
    run::RunOptions options = fast(2);
    options.record = path("run.lcm");
    options.record_limit = 40'000;
    MemoryBus bus;
    run::Run run(world, options, bus);
    run.run();
  }
  EXPECT_GE(numbered().size(), 2u);
  EXPECT_NE(numbered().front(), "run.000001.lcm");  // the oldest went
  run::Verifier verifier(path("run.lcm"), world, {});
  const run::Verification verdict = verifier.run();
  EXPECT_EQ(verdict.fault, "");
  EXPECT_FALSE(verdict.difference);
  EXPECT_EQ(verdict.time_us, 2'000'000);
  EXPECT_GE(verdict.messages, 2);  // hashes of the state
  const Index last(path(numbered().back()));
  EXPECT_TRUE(last.header());
  EXPECT_EQ(last.end_us(), 2'000'000);
}

}  // namespace
}  // namespace ruedo::log
