// What a log may hold that nobody recorded.
#include "log/reader.h"

#include <cstdint>
#include <filesystem>
#include <limits>

#include <unistd.h>

#include <gtest/gtest.h>

#include "log/writer.h"

namespace ruedo::log {
namespace {

constexpr int64_t kMost = std::numeric_limits<int64_t>::max();
constexpr int64_t kYear2255_us = 9'000'000'000'000'000;

class LogReader : public testing::TestWithParam<int64_t> {
 protected:
  ~LogReader() override { std::filesystem::remove(path_); }

  // A log of two empty messages, the second of which has that time.
  void write(int64_t time_us) const {
    Writer log(path_);
    log.write(0, "a/pose", nullptr, 0);
    log.write(time_us, "a/pose", nullptr, 0);
    log.flush();
  }

  const std::string path_ =
      std::filesystem::temp_directory_path() / ("log_reader_" + std::to_string(::getpid()));
};

class LogReaderRefuses : public LogReader {};

// Differences of times, and times in nanoseconds, are made of what a reader hands out.
TEST_P(LogReaderRefuses, TimesThatCannotBeCountedWith) {
  write(GetParam());
  Reader log(path_);
  Event event;
  ASSERT_TRUE(log.next(event));
  const int64_t second = log.offset();
  EXPECT_FALSE(log.next(event));
  EXPECT_EQ(log.fault(), "damaged at byte " + std::to_string(second));
}

INSTANTIATE_TEST_SUITE_P(Times, LogReaderRefuses,
                         testing::Values(-kMost - 1, -kYear2255_us - 1, kYear2255_us + 1, kMost));

class LogReaderTakes : public LogReader {};

TEST_P(LogReaderTakes, TimesOfRunsAndOfTheYear) {
  write(GetParam());
  Reader log(path_);
  Event event;
  ASSERT_TRUE(log.next(event) && log.next(event));
  EXPECT_EQ(event.timestamp_us, GetParam());
  EXPECT_FALSE(log.next(event));
  EXPECT_EQ(log.fault(), "");
}

// lcm-logger's are those since 1970.
INSTANTIATE_TEST_SUITE_P(Times, LogReaderTakes,
                         testing::Values(-kYear2255_us, -5, 0, 1'795'000'000'000'000,
                                         kYear2255_us));

}  // namespace
}  // namespace ruedo::log
