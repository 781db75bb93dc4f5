// The health of a run over times and counts that the test gives.
#include "bridges/ros2/messages/diagnostics.h"

#include <map>
#include <string>

#include <gtest/gtest.h>

#include "bridges/ros2/messages/cdr.h"

namespace ruedo::ros2 {
namespace {

using std::chrono::milliseconds;

struct Status {
  uint8_t level;
  std::string message;
  std::map<std::string, std::string> values;
};

std::map<std::string, Status> read(const std::vector<uint8_t>& cdr) {
  CdrReader in(cdr);
  in.skip<uint32_t>(2);
  in.get_text();
  std::map<std::string, Status> all;
  for (size_t count = in.get_length(1); count > 0; --count) {
    Status status;
    status.level = in.get<uint8_t>();
    const std::string name = in.get_text();
    status.message = in.get_text();
    EXPECT_EQ(in.get_text(), "ruedo");
    for (size_t values = in.get_length(1); values > 0; --values) {
      const std::string key = in.get_text();
      status.values[key] = in.get_text();
    }
    all[name] = status;
  }
  EXPECT_TRUE(in.good());
  return all;
}

TEST(Diagnostics, TellOfTheLastSecond) {
  const auto begin = Diagnostics::Clock::now();
  Diagnostics diagnostics(begin);
  for (int64_t step = 1; step <= 100; ++step) diagnostics.step(step * 5000);
  EXPECT_FALSE(diagnostics.look(begin + milliseconds(500), {}));
  const auto first = diagnostics.look(begin + milliseconds(2000), {.lost_on_bus = 3});
  ASSERT_TRUE(first);
  auto status = read(*first);
  const Status& run = status["ruedo: simulation"];
  EXPECT_EQ(run.level, 0);
  EXPECT_EQ(run.values.at("sim time (s)"), "0.500");
  EXPECT_EQ(run.values.at("real-time factor"), "0.250");
  EXPECT_EQ(run.values.at("steps per second"), "50.0");
  EXPECT_EQ(run.values.at("real time per step (ms)"), "20.000");
  EXPECT_EQ(status["ruedo: bus"].level, 1);
  EXPECT_EQ(status["ruedo: bus"].values.at("messages lost"), "3");
  EXPECT_EQ(status["ruedo: ROS 2"].level, 0);
}

TEST(Diagnostics, WarnInTheSecondOfALoss) {
  const auto begin = Diagnostics::Clock::now();
  Diagnostics diagnostics(begin);
  const auto level = [&](int second, const HealthCounts& counts) {
    return read(*diagnostics.look(begin + milliseconds(1100 * second), counts))["ruedo: ROS 2"]
        .level;
  };
  EXPECT_EQ(level(1, {}), 0);
  EXPECT_EQ(level(2, {.missed = 1}), 1);
  EXPECT_EQ(level(3, {.missed = 1}), 0);
  EXPECT_EQ(level(4, {.missed = 1, .dropped = 1}), 1);
  EXPECT_EQ(level(5, {.missed = 1, .dropped = 1, .faulty = 1}), 1);
  EXPECT_EQ(level(6, {.missed = 1, .dropped = 1, .faulty = 1}), 0);
}

TEST(Diagnostics, ReportAPausedRun) {
  Diagnostics diagnostics;
  const auto message = diagnostics.look(Diagnostics::Clock::now() + milliseconds(1100), {});
  ASSERT_TRUE(message);
  EXPECT_EQ(read(*message)["ruedo: simulation"].message, "stands still");
}

}  // namespace
}  // namespace ruedo::ros2
