#include "bridges/dds/held_samples.h"

#include <algorithm>
#include <random>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "rtps_bytes.h"

namespace ruedo::dds {
namespace {

using namespace testing_bytes;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr uint32_t kWriter = 0x0203;

ros2::Gid gid(uint8_t who, uint32_t entity) {
  ros2::Gid gid{};
  std::fill_n(gid.begin(), 12, who);
  for (size_t i = 0; i < 4; ++i) gid[12 + i] = static_cast<uint8_t>(entity >> 8 * (3 - i));
  return gid;
}

// A DATA_FRAG of 600 bytes.
Bytes fragment(uint32_t writer, uint64_t sequence, bool little) {
  Bytes rest;
  put(rest, 1, 4, little);
  put(rest, 1, 2, little);
  put(rest, 600, 2, little);
  put(rest, 9000, 4, little);
  rest.resize(rest.size() + 600);
  Bytes bytes = data(writer, sequence, rest, 0, little);
  bytes[0] = 0x16;
  return bytes;
}

Bytes gap(uint32_t writer, uint64_t first) {
  Bytes body;
  put(body, 0, 4);
  put(body, writer, 4, false);
  for (const uint64_t sequence : {first, first + 4}) {
    put(body, sequence >> 32, 4);
    put(body, sequence & 0xffffffff, 4);
  }
  put(body, 0, 4);
  return submessage(0x08, 0, body);
}

std::vector<std::pair<ros2::Gid, int64_t>> found_in(Bytes bytes) {
  std::vector<std::pair<ros2::Gid, int64_t>> found;
  for (const Samples& each : samples_in(bytes)) found.emplace_back(each.writer, each.last);
  return found;
}

TEST(HeldSamples, CountDataFragmentsAndGaps) {
  for (const bool little : {true, false}) {
    EXPECT_THAT(
        found_in(message({header(), data(kWriter, 5, Bytes(8), 4, little),
                          fragment(kWriter, 7, little), data(kWriter, 6, Bytes(8)),
                          fragment(0x0303, uint64_t{3} << 32 | 2, little), gap(0x0403, 9)})),
        ElementsAre(std::pair(gid(7, kWriter), 7),
                    std::pair(gid(7, 0x0303), (int64_t{3} << 32) + 2),
                    std::pair(gid(7, 0x0403), 9)));
  }
  Bytes acknowledgement = gap(kWriter, 9);
  acknowledgement[0] = 0x06;
  EXPECT_THAT(found_in(message({header(), acknowledgement})), IsEmpty());
}

TEST(HeldSamples, CountEachParticipantOfASharedMessage) {
  Bytes body{0, 0, 0, 0, 2, 1, 1, 16};
  body.resize(20, 8);
  EXPECT_THAT(found_in(message({header(), data(kWriter, 5, Bytes(8)), submessage(0x0c, 0, body),
                                data(kWriter, 9, Bytes(8))})),
              ElementsAre(std::pair(gid(7, kWriter), 5), std::pair(gid(8, kWriter), 9)));
  EXPECT_THAT(found_in(Bytes(19)), IsEmpty());
}

TEST(HeldSamples, IgnoreImpossibleNumbersAndTooManyWriters) {
  Bytes bytes =
      message({header(), data(kWriter, 0, Bytes(8)), data(kWriter, ~uint64_t{0}, Bytes(8)),
               data(kWriter, uint64_t{1} << 62 | 1, Bytes(8))});
  EXPECT_THAT(samples_in(bytes), IsEmpty());
  for (size_t at = 20; at < bytes.size(); at += 32) EXPECT_EQ(bytes[at], 0xff);
  bytes = header();
  for (uint32_t i = 0; i <= kMostWritersInDatagram; ++i)
    append(bytes, data(i << 8 | 3, 1, Bytes(8)));
  append(bytes, data(3, 2, Bytes(8)));  // one of those that there were
  const auto found = samples_in(bytes);
  ASSERT_EQ(found.size(), kMostWritersInDatagram);
  EXPECT_EQ(found[0].last, 2);
  EXPECT_EQ(bytes[20 + 32 * (kMostWritersInDatagram - 1)], 0x15);
  EXPECT_EQ(bytes[20 + 32 * kMostWritersInDatagram], 0xff);
}

TEST(HeldSamples, AHeartbeatWithoutThemDropsThem) {
  Bytes out(100);
  ASSERT_EQ(write_dropped({gid(7, kWriter), (int64_t{5} << 32) - 1}, out), 52u);
  out.resize(52);
  Bytes body;
  put(body, 0, 4);  // to all readers
  put(body, kWriter, 4, false);
  put(body, 5, 4), put(body, 0, 4);           // the first that there is,
  put(body, 4, 4), put(body, 0xffffffff, 4);  // and the last: none
  put(body, 0, 4);
  EXPECT_EQ(out, message({header(), submessage(0x07, 2, body)}));
  EXPECT_EQ(write_dropped({gid(7, kWriter), 1}, std::span(out).first(51)), 0u);
}

TEST(HeldSamples, AreDroppedInTheirOrder) {
  HeldSamples held;
  constexpr size_t kTenth = kMostHeld / 10;
  for (int64_t i = 1; i <= 9; ++i) {
    held.add(kTenth, std::vector<Samples>{{gid(1, 0x0103), i}, {gid(2, 0x0103), 10 * i}});
    EXPECT_FALSE(held.overdue()) << i;
  }
  held.add(kTenth, std::vector<Samples>{{gid(3, 0x0103), 1}});
  const auto first = held.overdue(), second = held.overdue();
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->writer, gid(1, 0x0103));
  EXPECT_EQ(first->last, 1);
  EXPECT_EQ(second->writer, gid(2, 0x0103));
  EXPECT_EQ(second->last, 10);
  EXPECT_FALSE(held.overdue());
}

TEST(HeldSamples, ReportsAnOrderlyWriterSeldom) {
  HeldSamples held;
  size_t told = 0;
  for (int64_t i = 1; i <= 2'000'000; ++i) {  // 4 of kMostHeld
    held.add(256, std::vector<Samples>{{gid(1, 0x0103), i}});
    told += held.overdue() ? 1 : 0;
  }
  EXPECT_LT(told, 200u);
}

TEST(HeldSamples, IgnoresBytesWithoutAWriter) {
  HeldSamples held;
  held.add(2 * kMostHeld, {});
  EXPECT_FALSE(held.overdue());
}

}  // namespace
}  // namespace ruedo::dds
