// Forged and damaged logs.
#include "log/reader.h"

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <vector>

#include <unistd.h>

#include <gtest/gtest.h>

#include "base/big_endian.h"
#include "base/lcm_log.h"
#include "base/message_size.h"
#include "log/writer.h"

namespace ruedo::log {
namespace {

constexpr int64_t kMost = std::numeric_limits<int64_t>::max();
constexpr int64_t kYear2255_us = 9'000'000'000'000'000;

class LogReader : public testing::Test {
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

class LogReaderRefuses : public LogReader, public testing::WithParamInterface<int64_t> {};

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

class LogReaderTakes : public LogReader, public testing::WithParamInterface<int64_t> {};

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

// A log with no more on the disk than its heads.
class LogOfOneMessage : public LogReader {
 protected:
  void write_one(size_t size) const {
    std::vector<uint8_t> head;
    append_big_endian(head, kLogSync);
    append_big_endian(head, uint64_t{0});
    append_big_endian(head, uint64_t{0});
    append_big_endian(head, uint32_t{1});
    append_big_endian(head, static_cast<uint32_t>(size));
    head.push_back('a');
    std::ofstream(path_, std::ios::binary)
        .write(reinterpret_cast<const char*>(head.data()),
               static_cast<std::streamsize>(head.size()));
    std::filesystem::resize_file(path_, head.size() + size);
  }
  bool is_read() const {
    Reader log(path_);
    Event event;
    const bool found = log.next(event, [](const std::string&) { return false; });
    EXPECT_EQ(log.fault(), found ? "" : "damaged at byte 0");
    return found;
  }
};

TEST_F(LogOfOneMessage, IsReadUpToTheLargestPicture) {
  write_one(kLargestMessage);
  EXPECT_TRUE(is_read());
  write_one(kLargestMessage + 1);
  EXPECT_FALSE(is_read());
}

// An unreadable event is not written, and the events before it are complete.
TEST_F(LogOfOneMessage, IsWrittenUpToThere) {
  Writer log(path_);
  log.write(0, "a", nullptr, 0);
  const std::vector<uint8_t> message(kLargestMessage + 1);
  log.write(1, "a/picture", message.data(), message.size());
  EXPECT_EQ(log.error(),
            "a message of 268500993 bytes on a/picture; at most 268500992 are allowed");
  log.flush();
  Reader reader(path_);
  Event event;
  EXPECT_TRUE(reader.next(event));
  EXPECT_FALSE(reader.next(event));
  EXPECT_EQ(reader.fault(), "");
}

}  // namespace
}  // namespace ruedo::log
