// ruedo diff: what is matched with what, the tolerances, and the reports.
#include "log/diff.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <limits>

#include "log/reader.h"
#include "log/writer.h"
#include "ruedo/errors.h"
#include "ruedo/odometry_t.hpp"
#include "ruedo/planar_lidar_t.hpp"
#include "ruedo/state_hash_t.hpp"

namespace ruedo::run {
namespace {

using testing::HasSubstr;

template <class Message>
void write(log::Writer& log, const std::string& channel, const Message& message) {
  std::vector<uint8_t> bytes(static_cast<size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  log.write(message.utime, channel, bytes.data(), bytes.size());
}

odometry_t odometry(int64_t utime, double x, double theta) {
  odometry_t message{};
  message.utime = utime;
  message.x = x;
  message.theta = theta;
  return message;
}

class LogDiffTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(testing::TempDir()) /
              testing::UnitTest::GetInstance()->current_test_info()->name();
    std::filesystem::create_directories(folder_);
    golden_ = folder_ / "golden.lcm";
    other_ = folder_ / "new.lcm";
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  // A log of 1 s of odometry at 10 Hz; theta turns through pi.
  void write_log(const std::string& path, double x_offset, double theta_offset = 0.0,
                 int without = -1) {
    log::Writer log(path);
    for (int i = 0; i < 10; ++i) {
      if (i != without)
        write(log, "p3at/odometry",
              odometry(i * 100'000, 0.1 * i + x_offset, 3.0 + 0.05 * i + theta_offset));
    }
  }

  log::Diff diff(const std::vector<std::string>& tolerances = {},
                 const std::vector<std::string>& ignored = {}) {
    return log::diff_logs(golden_, other_, log::DiffRule::all(tolerances, ignored));
  }

  std::filesystem::path folder_;
  std::string golden_, other_;
};

TEST_F(LogDiffTest, EqualLogsAreTheSame) {
  write_log(golden_, 0);
  write_log(other_, 0);
  const log::Diff result = diff();
  EXPECT_TRUE(result.same());
  EXPECT_THAT(log::diff_text(result), HasSubstr("same: 10 messages on 1 channels"));
}

TEST_F(LogDiffTest, NamesTheFirstFieldWithBothValues) {
  write_log(golden_, 0);
  write_log(other_, 0.5);
  const log::Diff result = diff();
  ASSERT_FALSE(result.same());
  const log::FieldDifference& x = result.channels.at("p3at/odometry").fields.at("x");
  EXPECT_EQ(x.count, 10);
  EXPECT_DOUBLE_EQ(x.worst, 0.5);
  EXPECT_EQ(x.first_golden, "0");
  EXPECT_EQ(x.first_other, "0.5");
  EXPECT_THAT(log::diff_text(result), HasSubstr("x of p3at/odometry at 0.000000 s: golden 0, new "
                                                "0.5 (10 values differ, by 0.5 at most)"));
}

TEST_F(LogDiffTest, Tolerances) {
  write_log(golden_, 0);
  write_log(other_, 0.01);
  EXPECT_TRUE(diff({"p3at/odometry:x=abs:0.0101"}).same());
  EXPECT_FALSE(diff({"p3at/odometry:x=abs:0.0099"}).same());
  EXPECT_FALSE(diff({"p3at/odometry:y=abs:1"}).same()) << "the tolerance of another field";
  EXPECT_TRUE(diff({"*/odometry:*=0.011"}).same()) << "patterns, and abs as the default";
  // At x = 0 a relative tolerance allows nothing; from 0.1 on, 0.01 is at most 10 %.
  EXPECT_EQ(diff({"*:x=rel:0.101"}).channels.at("p3at/odometry").fields.at("x").count, 1);
  EXPECT_TRUE(diff({}, {"p3at/odometry:x"}).same());
  EXPECT_FALSE(diff({"*:x=abs:1", "*:x=abs:0.001"}).same()) << "the last rule counts";
}

TEST_F(LogDiffTest, IgnoredChannels) {
  for (const std::string& path : {golden_, other_}) {
    log::Writer log(path);
    write(log, "p3at/odometry", odometry(0, path == golden_ ? 1 : 2, 0));
    write(log, "other/odometry", odometry(0, 1, 0));
  }
  const log::Diff result = diff({"p3tx/*:x=1"}, {"p3at/*", "ruedo/header"});
  EXPECT_TRUE(result.same());
  EXPECT_EQ(result.channels.size(), 1U);
  EXPECT_THAT(result.idle_rules,
              testing::ElementsAre("--tolerance p3tx/*: neither log has such a channel"));
  EXPECT_FALSE(diff({}, {"other/*"}).same());
  EXPECT_THROW(diff({}, {"*"}), InputError) << "nothing is left that could differ";
}

TEST_F(LogDiffTest, ARuleForAMissingField) {
  write_log(golden_, 0);
  write_log(other_, 0);
  const log::Diff result =
      diff({"*/odometry:thta=1", "*/odometry:th?ta=1"}, {"p3at/*:position.x", "p3at/*:x"});
  ASSERT_EQ(result.idle_rules.size(), 2U);
  EXPECT_THAT(result.idle_rules[0],
              HasSubstr("--tolerance */odometry:thta: there is no such field; there are utime, "));
  EXPECT_THAT(result.idle_rules[1],
              HasSubstr("--ignore p3at/*:position.x: there is no such field"));
}

TEST_F(LogDiffTest, AnglesAreComparedOnTheCircle) {
  write_log(golden_, 0);
  write_log(other_, 0, 2 * M_PI + 0.001);
  EXPECT_FALSE(diff({"*:theta=abs:0.002"}).same());
  EXPECT_TRUE(diff({"*:theta=angle:0.002"}).same());
  EXPECT_FALSE(diff({"*:theta=angle:0.0005"}).same());
}

TEST_F(LogDiffTest, MissingAndExtraMessages) {
  write_log(golden_, 0);
  write_log(other_, 0, 0, 4);
  EXPECT_EQ(diff().channels.at("p3at/odometry").missing, 1);
  EXPECT_EQ(diff().channels.at("p3at/odometry").first_missing, 400'000);
  EXPECT_EQ(diff().channels.at("p3at/odometry").compared, 9) << "what follows still matches";
  std::swap(golden_, other_);
  EXPECT_EQ(diff().channels.at("p3at/odometry").extra, 1);
}

TEST_F(LogDiffTest, ArraysOfDifferentLengths) {
  planar_lidar_t scan{};
  scan.nranges = 3;
  scan.ranges = {1, 2, 3};
  {
    log::Writer log(golden_);
    write(log, "p3at/lrf", scan);
  }
  scan.nranges = 2;
  scan.ranges = {1, 2.5};
  {
    log::Writer log(other_);
    write(log, "p3at/lrf", scan);
  }
  const auto result = diff();
  const auto& fields = result.channels.at("p3at/lrf").fields;
  ASSERT_TRUE(fields.contains("ranges"));
  EXPECT_EQ(fields.at("ranges").count, 2) << "the second value, and the third that is absent";
  EXPECT_EQ(fields.at("ranges").first_path, "ranges[1]");
  EXPECT_TRUE(fields.contains("nranges"));
}

// A range finder gives inf without an echo: a tolerance does not apply to that.
TEST_F(LogDiffTest, NoToleranceCoversAMissingEcho) {
  constexpr float kInf = std::numeric_limits<float>::infinity();
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const auto write_scan = [](const std::string& path, std::vector<float> ranges) {
    planar_lidar_t scan{};
    scan.nranges = static_cast<int32_t>(ranges.size());
    scan.ranges = std::move(ranges);
    log::Writer log(path);
    write(log, "p3at/lrf", scan);
  };
  write_scan(golden_, {kInf, kInf, -kInf, kNan, -kNan, kInf, 1});
  write_scan(other_, {1, -kInf, 0, 1, kNan, kInf, kNan});
  for (const char* tolerance : {"*:ranges=abs:1e300", "*:ranges=rel:0.5", "*:ranges=angle:4"}) {
    EXPECT_EQ(diff({tolerance}).channels.at("p3at/lrf").fields.at("ranges").count, 5) << tolerance;
  }
  EXPECT_EQ(diff().channels.at("p3at/lrf").fields.at("ranges").count, 5) << "without a rule, too";
}

// Beyond 2^53 a double holds no odd number.
TEST_F(LogDiffTest, LargeIntegersAreComparedExactly) {
  constexpr int64_t kLarge = (int64_t{1} << 53) + 1;
  for (const std::string& path : {golden_, other_}) {
    odometry_t message = odometry(path == golden_ ? kLarge : kLarge - 1, 0, 0);
    std::vector<uint8_t> bytes(static_cast<size_t>(message.getEncodedSize()));
    message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    log::Writer(path).write(0, "p3at/odometry", bytes.data(), bytes.size());
  }
  EXPECT_FALSE(diff({"*:utime=abs:0.5"}).same());
  EXPECT_TRUE(diff({"*:utime=abs:1"}).same());
  EXPECT_EQ(diff().channels.at("p3at/odometry").fields.at("utime").worst, 1.0);
}

TEST_F(LogDiffTest, ATruncatedLogDiffers) {
  write_log(golden_, 0);
  write_log(other_, 0);
  std::filesystem::resize_file(other_, std::filesystem::file_size(other_) - 5);
  const log::Diff result = diff();
  EXPECT_EQ(result.channels.at("p3at/odometry").compared, 9);
  EXPECT_EQ(result.channels.at("p3at/odometry").missing, 1);
  ASSERT_EQ(result.faults.size(), 1u);
  EXPECT_THAT(result.faults[0], HasSubstr("new.lcm: cut off in the event that begins at byte"));

  golden_ = other_;  // cut in one place: nothing that is there differs
  EXPECT_TRUE(diff().channels.at("p3at/odometry").same());
  EXPECT_FALSE(diff().same());
  EXPECT_THAT(log::diff_text(diff()), HasSubstr("not the same: "));
  EXPECT_THAT(log::diff_junit(diff()), HasSubstr("cut off in the event"));
}

TEST_F(LogDiffTest, ComparesTheMessagesOfALogKnownAsTruncated) {
  write_log(golden_, 0);
  write_log(other_, 0);
  std::filesystem::resize_file(other_, std::filesystem::file_size(other_) - 5);
  for (int i = 0; i < 2; ++i, std::swap(golden_, other_)) {  // either of them is cut
    const log::Diff result = log::diff_logs(golden_, other_, {}, true);
    EXPECT_TRUE(result.same());
    EXPECT_EQ(result.channels.at("p3at/odometry").compared, 9);
    ASSERT_EQ(result.notes.size(), 1u);
    EXPECT_THAT(result.notes[0], HasSubstr("new.lcm: cut off in the event that begins at byte"));
  }
  write_log(golden_, 0, 0, 4);
  EXPECT_FALSE(log::diff_logs(golden_, other_, {}, true).same()) << "before the cut";
}

// The end of a run is in its log.
TEST_F(LogDiffTest, ARunsLogThatEndsBetweenTwoEventsIsCut) {
  for (const bool whole : {true, false}) {
    log::Writer log(golden_);
    state_hash_t hash{};
    hash.last = whole;
    write(log, "p3at/odometry", odometry(0, 1, 0));
    write(log, "ruedo/state_hash", hash);
    log.flush();
    other_ = golden_;
    EXPECT_EQ(diff().same(), whole);
    EXPECT_TRUE(log::diff_logs(golden_, other_, {}, true).same());
  }
}

TEST_F(LogDiffTest, AnEmptyComparisonDiffers) {
  const auto expect_nothing = [&](bool partial) {
    const log::Diff result = log::diff_logs(golden_, other_, {}, partial);
    EXPECT_FALSE(result.same());
    EXPECT_THAT(log::diff_text(result), HasSubstr("not the same: nothing was compared"));
  };
  log::Writer{golden_}.flush();
  log::Writer{other_}.flush();
  expect_nothing(false);
  expect_nothing(true);
  for (const std::string& path : {golden_, other_}) {
    log::Writer log(path);
    write(log, "ruedo/header", odometry(0, 1, 0));
  }
  expect_nothing(false);
  write_log(golden_, 0);
  EXPECT_EQ(diff().channels.at("p3at/odometry").missing, 10) << "one log without a message";
  std::filesystem::resize_file(golden_, 20);  // in its first event
  expect_nothing(true);
}

TEST_F(LogDiffTest, IgnoringEveryFieldLeavesNothingToCompare) {
  write_log(golden_, 0);
  write_log(other_, 0.5);
  EXPECT_THROW(diff({}, {"p3at/*:?*"}), InputError);
  EXPECT_FALSE(diff({}, {"p3at/*:th*"}).same());
}

TEST_F(LogDiffTest, RefusesAFileThatIsNotALog) {
  write_log(golden_, 0);
  std::ofstream(other_) << "hello, I am text";
  EXPECT_THROW(diff(), InputError);
  other_ = folder_ / "absent.lcm";
  EXPECT_THROW(diff(), InputError);
  other_ = folder_;
  EXPECT_THROW(diff(), InputError);
}

TEST_F(LogDiffTest, AForgedLengthAllocatesNothing) {
  write_log(golden_, 0);
  write_log(other_, 0);
  {
    std::fstream file(other_, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(24);
    file.write("\x0f\xff\xff\xff", 4);
  }
  log::Reader reader(other_);
  log::Event event;
  EXPECT_FALSE(reader.next(event));
  EXPECT_THAT(reader.fault(), HasSubstr("cut off"));
}

TEST(DiffRule, RefusesMalformedRules) {
  for (const char* text : {"", "a", "a:b", "a:b=x", "a:b=abs:-1", "a:b=abs:nan", "a:b=abs:1e-3x",
                           "a:b=size:1", ":b=1", "a:=1"}) {
    EXPECT_THROW(log::DiffRule::tolerance(text), InputError) << text;
  }
  EXPECT_THROW(log::DiffRule::ignoring(""), InputError);
}

TEST_F(LogDiffTest, ReportsEscapeNamesFromFiles) {
  {
    log::Writer log(golden_);
    write(log, "<b>&\"", odometry(0, 1, 0));
    write(log, "<b>&\"", odometry(5, 1, 0));
  }
  {
    log::Writer log(other_);
    write(log, "<b>&\"", odometry(0, 2, 0));
    write(log, "<b>&\"", odometry(5, 3, 0));
  }
  const log::Diff result = diff();
  for (const std::string& report :
       {log::diff_junit(result), log::diff_html(result, golden_, other_)}) {
    EXPECT_THAT(report, HasSubstr("&lt;b&gt;&amp;&quot;"));
    EXPECT_THAT(report, testing::Not(HasSubstr("<b>&")));
  }
  EXPECT_THAT(log::diff_junit(result), HasSubstr("tests=\"1\" failures=\"1\""));
  EXPECT_THAT(log::diff_html(result, golden_, other_), HasSubstr("<polyline class=\"golden\""));
}

}  // namespace
}  // namespace ruedo::run
