#include "bridges/dds/known_participants.h"

#include <chrono>
#include <random>
#include <set>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "rtps_bytes.h"

namespace ruedo::dds {
namespace {

using namespace std::chrono_literals;
using namespace testing_bytes;

constexpr uint32_t kAnnouncer = 0x000100c2, kOfWriters = 0x000003c2, kOfReaders = 0x000004c2;
constexpr uint16_t kParticipantGuid = 0x50, kEndpointGuid = 0x5a;

Prefix prefix(uint32_t number) {
  Prefix prefix{1, 16};
  for (size_t i = 0; i < 4; ++i) prefix[8 + i] = static_cast<uint8_t>(number >> 8 * i);
  return prefix;
}

Address socket(uint16_t number) {
  Address address{};
  address[16] = static_cast<uint8_t>(number);
  address[17] = static_cast<uint8_t>(number >> 8);
  return address;
}

Bytes parameter(uint16_t id, const Bytes& value, bool little = true) {
  Bytes bytes;
  put(bytes, id, 2, little);
  put(bytes, value.size(), 2, little);
  append(bytes, value);
  return bytes;
}

Bytes guid(const Prefix& whose, uint32_t entity) {
  Bytes bytes(whose.begin(), whose.end());
  put(bytes, entity, 4, false);
  return bytes;
}

Bytes list(std::initializer_list<Bytes> parameters, bool little = true) {
  Bytes bytes{0, static_cast<uint8_t>(little ? 3 : 2), 0, 0};
  for (const Bytes& each : parameters) append(bytes, each);
  append(bytes, parameter(1, {}, little));
  return bytes;
}

Bytes announcement(const Prefix& whose, bool little = true) {
  return data(kAnnouncer, 1,
              list({parameter(kParticipantGuid, guid(whose, 0x1c1), little)}, little), 4, little);
}

// With an inline QoS that says that it has gone.
Bytes leaving(const Prefix& whose) {
  Bytes rest = message({parameter(0x71, {0, 0, 0, 3}), parameter(1, {})});
  append(rest, list({parameter(kParticipantGuid, guid(whose, 0x1c1))}));
  return data(kAnnouncer, 1, rest, 2 | 8);
}

Bytes endpoint(const Prefix& whose, uint32_t entity, size_t size = 100, uint8_t topic = 'a',
               uint64_t sequence = 1) {
  return data(kOfWriters, sequence,
              list({parameter(kEndpointGuid, guid(whose, entity)), parameter(0x2c, Bytes(size)),
                    parameter(5, {2, 0, 0, 0, topic, topic, topic, 0})}));
}

Bytes goes(const Prefix& whose, uint32_t entity, uint64_t sequence) {
  Bytes rest = message({parameter(0x71, {0, 0, 0, 3}), parameter(1, {})});
  append(rest, list({parameter(kEndpointGuid, guid(whose, entity))}));
  return data(kOfWriters, sequence, rest, 2 | 8);
}

// Who sends what follows.
Bytes source(const Prefix& who, uint8_t vendor = 16, bool little = true) {
  Bytes body{0, 0, 0, 0, 2, 1, 1, vendor};
  body.insert(body.end(), who.begin(), who.end());
  return submessage(0x0c, 0, body, little);
}

Bytes from(const Prefix& who, std::initializer_list<Bytes> parts, uint8_t vendor = 16) {
  Bytes bytes{'R', 'T', 'P', 'S', 2, 1, 1, vendor};
  bytes.insert(bytes.end(), who.begin(), who.end());
  append(bytes, message(parts));
  return bytes;
}

class KnownParticipantsTest : public testing::Test {
 protected:
  // Whether it is let in.
  bool comes(uint32_t number, uint16_t from_socket) {
    return passes(from(prefix(number), {announcement(prefix(number))}), from_socket);
  }
  bool passes(Bytes bytes, uint16_t from_socket = 1) {
    known_.bound(bytes, socket(from_socket), now_);
    return bytes[20] != 0xff;
  }
  // Whether the last submessage is.
  bool last_passes(Bytes bytes) {
    known_.bound(bytes, socket(1), now_);
    bool passed = false;
    for_each_submessage(bytes, [&](const Submessage& each) { passed = each.kind() != 0xff; });
    return passed;
  }
  std::vector<Prefix> left() {
    std::vector<Prefix> all;
    while (const auto next = known_.left()) all.push_back(*next);
    return all;
  }

  KnownParticipants known_;
  KnownParticipants::Clock::time_point now_{1h};
};

TEST_F(KnownParticipantsTest, OneSocketHasItsShare) {
  for (uint32_t i = 0; i < kMostOfOneSocket; ++i) {
    EXPECT_TRUE(comes(i, 1));
    now_ += 1ms;
  }
  EXPECT_TRUE(comes(1000, 2));
  EXPECT_TRUE(left().empty());
  EXPECT_TRUE(comes(2000, 1));  // in place of one of its own, in its turn
  EXPECT_EQ(left(), std::vector{prefix(0)});
  EXPECT_FALSE(comes(2001, 1));
  now_ += KnownParticipants::kTurn;
  EXPECT_TRUE(comes(2001, 1));
  EXPECT_EQ(left(), std::vector{prefix(1)});
  EXPECT_EQ(known_.size(), kMostOfOneSocket + 1);
}

TEST_F(KnownParticipantsTest, DropsTheMostSilentParticipantWhenFull) {
  for (uint32_t i = 0; i < kMostParticipants; ++i) {
    EXPECT_TRUE(comes(i, static_cast<uint16_t>(i)));
    now_ += 1ms;
  }
  EXPECT_TRUE(passes(from(prefix(0), {data(0x0103, 1, Bytes(8))}), 0));  // speaks
  EXPECT_TRUE(comes(1000, 1000));
  EXPECT_EQ(left(), std::vector{prefix(1)});
  EXPECT_EQ(known_.size(), kMostParticipants);
}

TEST_F(KnownParticipantsTest, DropsLeavingParticipantsFirst) {
  for (uint32_t i = 0; i < kMostOfOneSocket; ++i) EXPECT_TRUE(comes(i, 1));
  EXPECT_TRUE(passes(from(prefix(5), {leaving(prefix(5))})));
  EXPECT_TRUE(comes(1000, 1));
  EXPECT_EQ(left(), std::vector{prefix(5)});  // once more: the first may have been missed
  EXPECT_FALSE(comes(1001, 1));
  EXPECT_TRUE(comes(1002, 2));
  EXPECT_TRUE(passes(from(prefix(6), {leaving(prefix(6))})));
  EXPECT_TRUE(comes(6, 1));  // it may come again at once
}

TEST_F(KnownParticipantsTest, IgnoresRepetitionsWithinTheRepeatTime) {
  EXPECT_TRUE(comes(1, 1));
  EXPECT_FALSE(comes(1, 1));
  now_ += KnownParticipants::kRepeat;
  EXPECT_TRUE(comes(1, 1));
}

TEST_F(KnownParticipantsTest, RejectsAnnouncementsOfOtherParticipants) {
  const Prefix own = prefix(1), other = prefix(2);
  for (const bool little : {true, false}) {
    EXPECT_FALSE(passes(from(own, {announcement(other, little)})));
    EXPECT_TRUE(passes(from(own, {announcement(own, little)})));
    now_ += 1s;
  }
  EXPECT_FALSE(passes(from(own, {leaving(other)})));
  EXPECT_FALSE(passes(from(own, {endpoint(other, 0x0103)})));
  EXPECT_TRUE(passes(from(own, {endpoint(own, 0x0103)})));
  // A vendor that announces others, by the message's head and within it.
  EXPECT_FALSE(passes(from(own, {endpoint(own, 0x0103)}, 0x20)));
  EXPECT_FALSE(last_passes(from(own, {source(own, 0x20), endpoint(own, 0x0103)})));
}

// As Cyclone DDS sends announcements of several participants of a process at once.
TEST_F(KnownParticipantsTest, ParticipantsShareAMessage) {
  const Prefix first = prefix(1), second = prefix(2);
  for (const bool little : {true, false}) {
    EXPECT_TRUE(last_passes(
        from(first, {announcement(first), source(second, 16, little), announcement(second)})));
    EXPECT_EQ(known_.size(), 2u);
    now_ += KnownParticipants::kRepeat;
  }
  EXPECT_TRUE(last_passes(from(first, {source(second), endpoint(second, 0x0103)})));
  EXPECT_FALSE(last_passes(from(first, {source(second), endpoint(first, 0x0203)})));
  EXPECT_TRUE(last_passes(from(second, {source(first), endpoint(first, 0x0203)})));
  // A truncated one identifies no participant.
  EXPECT_TRUE(last_passes(from(first, {submessage(0x0c, 0, Bytes(19)), endpoint(first, 0x0303)})));
}

TEST_F(KnownParticipantsTest, IgnoresMessagesToOtherParticipants) {
  const Prefix own = prefix(1);
  known_.serve(prefix(9));
  const auto leaves_to = [&](const Prefix& whom) {
    Bytes bytes = from(own, {submessage(0x0e, 0, Bytes(whom.begin(), whom.end())), leaving(own)});
    known_.bound(bytes, socket(1), now_);
    return bytes[36] == 0x15;
  };
  EXPECT_TRUE(comes(1, 1));
  EXPECT_FALSE(leaves_to(prefix(8)));
  EXPECT_TRUE(leaves_to(prefix(9)));
  EXPECT_TRUE(comes(1, 1));
  EXPECT_TRUE(leaves_to(Prefix{}));
}

TEST_F(KnownParticipantsTest, IgnoresALeavingFlagInTheData) {
  // In the data, that parameter means nothing.
  const Prefix own = prefix(1);
  EXPECT_TRUE(passes(from(own, {data(kAnnouncer, 1,
                                     list({parameter(kParticipantGuid, guid(own, 0x1c1)),
                                           parameter(0x71, {0, 0, 0, 3})}))})));
  EXPECT_EQ(known_.size(), 1u);
}

TEST_F(KnownParticipantsTest, RejectsTruncatedAnnouncements) {
  const Prefix own = prefix(1);
  const Bytes good = announcement(own);
  for (size_t size = 4; size < good.size(); ++size) {
    Bytes cut(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(size));
    cut[2] = static_cast<uint8_t>(size - 4);
    if (size - 4 < 20 || size == 4) continue;  // too short for a DATA
    EXPECT_FALSE(passes(from(own, {cut}))) << size;
  }
  EXPECT_FALSE(passes(from(own, {data(kAnnouncer, 1, list({}))})));
  EXPECT_EQ(known_.size(), 0u);
  EXPECT_TRUE(passes(from(own, {good})));
  EXPECT_FALSE(passes(from(own, {endpoint(own, 0x0103, kMostTold)})));
}

TEST_F(KnownParticipantsTest, DropsTheParticipantWithTheMostEndpoints) {
  EXPECT_TRUE(comes(1, 1) && comes(2, 2));
  uint32_t entity = 0;
  uint64_t sequence = 0;
  const auto tell = [&](uint32_t who) {
    ++entity;
    const auto topic = static_cast<uint8_t>(entity % 200);
    EXPECT_TRUE(
        passes(from(prefix(who), {endpoint(prefix(who), entity, 12'000, topic, ++sequence)})));
  };
  for (int i = 0; i < 1000; ++i) tell(2);
  // One that is announced again, or that comes and leaves, needs no room.
  for (int i = 0; i < 12'000; ++i) {
    EXPECT_TRUE(passes(from(prefix(2), {endpoint(prefix(2), 0, 12'000, 'a', ++sequence)})));
    if (i % 2 == 1) {
      EXPECT_TRUE(passes(from(prefix(2), {goes(prefix(2), 0, ++sequence)})));
    }
  }
  EXPECT_TRUE(left().empty());
  uint32_t told = 1000;
  for (; known_.size() == 2; ++told) tell(1);
  EXPECT_EQ(left(), std::vector{prefix(1)});
  // Each is 24 bytes of head, 4 + 20 + 12'004 + 12 + 4 of the list, and 2 kB that Cyclone needs.
  EXPECT_EQ(told, 134'217'728 / 14'116 + 1);
}

TEST_F(KnownParticipantsTest, OneSocketHasItsShareOfATopic) {
  EXPECT_TRUE(comes(1, 1) && comes(2, 1) && comes(3, 3));
  const auto tells = [&](uint32_t who, uint32_t entity, uint8_t topic, uint64_t sequence = 1) {
    return passes(from(prefix(who), {endpoint(prefix(who), entity, 8, topic, sequence)}));
  };
  for (uint32_t i = 0; i < kMostOfOneTopic; ++i) EXPECT_TRUE(tells(1 + i % 2, i, 'a', i + 1));
  EXPECT_FALSE(tells(1, 1000, 'a'));
  EXPECT_FALSE(tells(2, 1000, 'a'));
  EXPECT_TRUE(tells(2, 1000, 'b'));
  EXPECT_TRUE(tells(3, 1000, 'a'));
  EXPECT_TRUE(tells(1, 0, 'a'));  // is known already
  EXPECT_TRUE(tells(1, 0, 'c'));  // stays where it was
  EXPECT_FALSE(tells(1, 1000, 'a'));
  EXPECT_TRUE(passes(from(prefix(1), {goes(prefix(1), 0, 1)})));  // an old sequence number: ignored
  EXPECT_FALSE(tells(1, 1000, 'a'));
  EXPECT_TRUE(passes(from(prefix(1), {goes(prefix(1), 0, 1000)})));
  EXPECT_TRUE(tells(1, 1000, 'a'));
  EXPECT_TRUE(passes(from(prefix(2), {leaving(prefix(2))})));
  for (uint32_t i = 0; i < kMostOfOneTopic / 2; ++i) EXPECT_TRUE(tells(1, 2000 + i, 'a')) << i;
  EXPECT_FALSE(tells(1, 3000, 'a'));
}

TEST_F(KnownParticipantsTest, OneSocketHasItsShareOfAddresses) {
  EXPECT_TRUE(comes(1, 1) && comes(2, 2));
  // Which of two is left.
  const auto left_of = [&](uint32_t who, uint8_t first, uint8_t second) {
    const auto locator = [](uint8_t number) { return parameter(0x2f, Bytes(24, number)); };
    Bytes bytes = from(prefix(who), {data(kOfReaders, 1,
                                          list({parameter(kEndpointGuid, guid(prefix(who), first)),
                                                locator(first), locator(second)}))});
    known_.bound(bytes, socket(9), now_);
    // Behind two headers, 20 bytes of DATA, the list's 4 and the GUID's 20.
    EXPECT_EQ(bytes[20], 0x15);
    return std::pair(bytes[68] == 0x2f, bytes[96] == 0x2f);
  };
  for (uint8_t i = 0; i < kMostLocators; i += 2)
    EXPECT_EQ(left_of(1, i, i + 1), std::pair(true, true));
  EXPECT_EQ(left_of(1, 100, 3), std::pair(false, true));
  EXPECT_EQ(left_of(2, 100, 3), std::pair(true, true));
}

TEST_F(KnownParticipantsTest, FragmentsThatTellAreBounded) {
  EXPECT_TRUE(comes(1, 1));
  const auto fragment_of = [&](uint64_t sequence, uint32_t size) {
    Bytes rest;
    put(rest, 1, 4), put(rest, 1, 2), put(rest, 1344, 2), put(rest, size, 4);
    rest.resize(rest.size() + 1344);
    Bytes part = data(kOfWriters, sequence, rest, 0);
    part[0] = 0x16;
    Bytes bytes = from(prefix(1), {part});
    known_.bound(bytes, socket(1), now_);
    EXPECT_EQ(bytes[20], 0x16);
    return bytes[20 + 32 + 3] != 0xff;  // of the sample's size, which is left out with the largest
  };
  EXPECT_FALSE(fragment_of(1, kMostTold + 1));
  for (uint64_t i = 1; i <= kMostOfOneTopic; ++i) EXPECT_TRUE(fragment_of(i, 4000));
  EXPECT_FALSE(fragment_of(1000, 4000));
  EXPECT_TRUE(fragment_of(1, 4000));  // is sent again
}

TEST_F(KnownParticipantsTest, WritesTheLeavingMessageOfAParticipant) {
  Bytes out(200);
  const size_t size = write_left(prefix(5), out);
  out.resize(size);
  EXPECT_EQ(out, from(prefix(5), {leaving(prefix(5))}));
  EXPECT_EQ(write_left(prefix(5), std::span(out).first(size - 1)), 0u);
}

TEST_F(KnownParticipantsTest, AnyBytesAreRead) {
  std::mt19937 random(1);
  const Prefix own = prefix(1);
  for (int round = 0; round < 5'000; ++round) {
    Bytes bytes = from(own, {leaving(own), announcement(own), endpoint(own, 0x0103, 50)});
    for (size_t changes = random() % 6; changes > 0; --changes)
      bytes[random() % bytes.size()] = static_cast<uint8_t>(random());
    bytes.resize(random() % 4 == 0 ? random() % bytes.size() : bytes.size());
    known_.bound(bytes, socket(1), now_);  // under the sanitizers: within the message
    now_ += 50ms;
  }
  EXPECT_LE(known_.size(), kMostOfOneSocket);
}

}  // namespace
}  // namespace ruedo::dds
