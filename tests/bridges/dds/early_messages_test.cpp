#include "bridges/dds/early_messages.h"

#include <chrono>
#include <vector>

#include <gtest/gtest.h>

#include "rtps_bytes.h"

namespace ruedo::dds {
namespace {

using namespace std::chrono_literals;
using namespace testing_bytes;
using Clock = EarlyMessages::Clock;

constexpr EarlyMessages::Entity kWriter{0, 0, 0x14, 3}, kOther{0, 0, 0x15, 3};
const Clock::time_point kBegin{};

EarlyMessages::Message early(uint8_t byte, EarlyMessages::Entity writer = kWriter,
                             size_t size = 1) {
  return {Prefix{7}, writer, {}, std::vector<uint8_t>(size, byte)};
}

const auto kKnown = [](const EarlyMessages::Message& each) { return each.writer == kWriter; };

TEST(EarlyMessages, AreHeardInOrderOnceTheirWriterIsKnown) {
  EarlyMessages messages;
  messages.keep(early(1), kBegin);
  messages.keep(early(2, kOther), kBegin);
  messages.keep(early(3), kBegin);
  EXPECT_FALSE(messages.due(kBegin + 1s));
  messages.look(kKnown, kBegin + 1s);
  EXPECT_FALSE(messages.due(kBegin + 1s));
  for (const auto delay : EarlyMessages::kDelays) {
    const Clock::time_point then = kBegin + 1s + delay;
    for (const uint8_t byte : {1, 3}) {
      const auto next = messages.due(then);
      ASSERT_TRUE(next);
      EXPECT_EQ(next->bytes, std::vector<uint8_t>{byte});
    }
    EXPECT_FALSE(messages.due(then));
  }
}

TEST(EarlyMessages, AreNotHeldForEver) {
  EarlyMessages messages;
  messages.keep(early(1), kBegin);
  messages.keep(early(2), kBegin + EarlyMessages::kLongest + 1s);
  messages.look(kKnown, kBegin + 10s);
  size_t heard = 0;
  while (const auto next = messages.due(kBegin + 20s)) {
    EXPECT_EQ(next->bytes, std::vector<uint8_t>{2});
    ++heard;
  }
  EXPECT_EQ(heard, EarlyMessages::kDelays.size());
}

TEST(EarlyMessages, AreHeardBeforeTheirWritersHeartbeats) {
  Bytes beat{0, 0, 0, 0, 0, 0, 0x14, 3};
  beat.resize(28);
  const Bytes whole = message({header(7, 15), data(0x1403, 1, Bytes(4)), submessage(7, 2, beat)});
  const auto left = [&](const EarlyMessages& messages) {
    Bytes heard = whole;
    messages.keep_order(heard);
    std::vector<uint8_t> kinds;
    for_each_submessage(heard, [&](const Submessage& each) { kinds.push_back(each.kind()); });
    return kinds;
  };
  using Kinds = std::vector<uint8_t>;
  EarlyMessages messages;
  EXPECT_EQ(left(messages), (Kinds{Submessage::kData, Submessage::kHeartbeat}));
  messages.keep(early(1, kOther), kBegin);
  EXPECT_EQ(left(messages), (Kinds{Submessage::kData, Submessage::kHeartbeat}));
  EarlyMessages::Message own = early(1);
  own.participant.fill(7);
  messages.keep(own, kBegin);
  EXPECT_EQ(left(messages), (Kinds{Submessage::kData, Submessage::kHeartbeat}));  // nor to Cyclone
  messages.look(kKnown, kBegin);
  EXPECT_EQ(left(messages), (Kinds{Submessage::kData, Submessage::kNothing}));
  while (messages.due(kBegin + 20s)) continue;
  EXPECT_EQ(left(messages), (Kinds{Submessage::kData, Submessage::kHeartbeat}));
}

TEST(EarlyMessages, AreBoundedInNumberAndBytes) {
  EarlyMessages messages;
  for (size_t i = 0; i < 2 * EarlyMessages::kMost; ++i) messages.keep(early(1), kBegin);
  messages.look(kKnown, kBegin);
  size_t heard = 0;
  while (messages.due(kBegin + 10s)) ++heard;
  EXPECT_EQ(heard, EarlyMessages::kMost * EarlyMessages::kDelays.size());
  for (size_t i = 0; i < 3; ++i)
    messages.keep(early(1, kWriter, EarlyMessages::kMostBytes / 2), kBegin);
  messages.look(kKnown, kBegin);
  for (heard = 0; messages.due(kBegin + 10s);) ++heard;
  EXPECT_EQ(heard, 2 * EarlyMessages::kDelays.size());
}

TEST(EarlyMessages, WriterOfDataAndOfHeartbeats) {
  Bytes beat_of_discovery{0, 0, 0, 0, 0, 0, 3, 0xc2};
  beat_of_discovery.resize(28);
  Bytes beat{0, 0, 0, 0, 0, 0, 0x14, 3};
  beat.resize(28);
  for (const bool little : {true, false}) {
    for (const Bytes& part :
         {submessage(7, 2, beat, little), data(0x1403, 1, Bytes(4), 4, little)}) {
      Bytes whole = message({header(7, 15), submessage(7, 2, beat_of_discovery, little), part});
      const auto found = writer_in(whole);
      ASSERT_TRUE(found);
      EXPECT_EQ(found->second, kWriter);
      Prefix who;
      who.fill(7);
      EXPECT_EQ(found->first, who);
    }
  }
  Bytes none = message({header(), submessage(7, 2, beat_of_discovery)});
  EXPECT_FALSE(writer_in(none));
  for (size_t size = 0; size < none.size(); ++size) {
    Bytes cut(none.begin(), none.begin() + static_cast<std::ptrdiff_t>(size));
    EXPECT_FALSE(writer_in(cut));
  }
}

}  // namespace
}  // namespace ruedo::dds
