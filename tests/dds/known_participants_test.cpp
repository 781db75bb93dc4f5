#include "dds/known_participants.h"

#include <chrono>
#include <random>
#include <set>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "dds/rtps_bytes.h"

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

Bytes endpoint(const Prefix& whose, uint32_t entity, size_t size = 100) {
  return data(kOfWriters, 1,
              list({parameter(kEndpointGuid, guid(whose, entity)), parameter(0x2c, Bytes(size))}));
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

TEST_F(KnownParticipantsTest, TheMostSilentGivesWayWhereThereIsNoRoom) {
  for (uint32_t i = 0; i < kMostParticipants; ++i) {
    EXPECT_TRUE(comes(i, static_cast<uint16_t>(i)));
    now_ += 1ms;
  }
  EXPECT_TRUE(passes(from(prefix(0), {data(0x0103, 1, Bytes(8))}), 0));  // speaks
  EXPECT_TRUE(comes(1000, 1000));
  EXPECT_EQ(left(), std::vector{prefix(1)});
  EXPECT_EQ(known_.size(), kMostParticipants);
}

TEST_F(KnownParticipantsTest, WhoLeavesMakesRoom) {
  for (uint32_t i = 0; i < kMostOfOneSocket; ++i) EXPECT_TRUE(comes(i, 1));
  EXPECT_TRUE(passes(from(prefix(5), {leaving(prefix(5))})));
  EXPECT_EQ(known_.size(), kMostOfOneSocket - 1);
  EXPECT_TRUE(comes(1000, 1));
  EXPECT_TRUE(left().empty());
}

TEST_F(KnownParticipantsTest, WhatIsRepeatedAtOnceIsPassedOver) {
  EXPECT_TRUE(comes(1, 1));
  EXPECT_FALSE(comes(1, 1));
  now_ += KnownParticipants::kRepeat;
  EXPECT_TRUE(comes(1, 1));
}

TEST_F(KnownParticipantsTest, NobodyTellsOfOthers) {
  const Prefix own = prefix(1), other = prefix(2);
  for (const bool little : {true, false}) {
    EXPECT_FALSE(passes(from(own, {announcement(other, little)})));
    EXPECT_TRUE(passes(from(own, {announcement(own, little)})));
    now_ += 1s;
  }
  EXPECT_FALSE(passes(from(own, {leaving(other)})));
  EXPECT_FALSE(passes(from(own, {endpoint(other, 0x0103)})));
  EXPECT_TRUE(passes(from(own, {endpoint(own, 0x0103)})));
  // A vendor of those who do, and a message that turns to another's name.
  EXPECT_FALSE(passes(from(own, {endpoint(own, 0x0103)}, 0x20)));
  Bytes turned = from(own, {submessage(0x0c, 0, Bytes(20)), endpoint(other, 0x0103)});
  known_.bound(turned, socket(1), now_);
  EXPECT_EQ(turned[20], 0xff);
  EXPECT_EQ(turned[20 + 24], 0xff);
}

TEST_F(KnownParticipantsTest, ToHaveLeftIsSaidBesideTheDataOnly) {
  // In the data, that parameter means nothing.
  const Prefix own = prefix(1);
  EXPECT_TRUE(passes(from(own, {data(kAnnouncer, 1,
                                     list({parameter(kParticipantGuid, guid(own, 0x1c1)),
                                           parameter(0x71, {0, 0, 0, 3})}))})));
  EXPECT_EQ(known_.size(), 1u);
}

TEST_F(KnownParticipantsTest, WhatCannotBeReadIsNotLetIn) {
  const Prefix own = prefix(1);
  const Bytes good = announcement(own);
  for (size_t size = 4; size < good.size(); ++size) {
    Bytes cut(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(size));
    cut[2] = static_cast<uint8_t>(size - 4);
    if (size - 4 < 20 || size == 4) continue;  // too short for a DATA
    EXPECT_FALSE(passes(from(own, {cut}))) << size;
  }
  EXPECT_FALSE(passes(from(own, {data(kAnnouncer, 1, list({}))})));
  EXPECT_FALSE(passes(from(own, {endpoint(own, 0x0103, kMostTold)})));
  EXPECT_EQ(known_.size(), 0u);
}

TEST_F(KnownParticipantsTest, WhoHasTheMostEndpointsGivesWay) {
  EXPECT_TRUE(comes(1, 1) && comes(2, 2));
  uint32_t entity = 0;
  const auto tell = [&](uint32_t who) {
    EXPECT_TRUE(passes(from(prefix(who), {endpoint(prefix(who), ++entity << 8 | 3, 12'000)})));
  };
  for (int i = 0; i < 1000; ++i) tell(2);
  // One endpoint, told of again, and one that comes and goes, take no room.
  for (int i = 0; i < 12'000; ++i) {
    EXPECT_TRUE(passes(from(prefix(2), {endpoint(prefix(2), 3, 12'000)})));
    Bytes rest = message({parameter(0x71, {0, 0, 0, 3}), parameter(1, {})});
    append(rest, list({parameter(kEndpointGuid, guid(prefix(2), 3))}));
    EXPECT_TRUE(passes(from(prefix(2), {data(kOfWriters, 1, rest, 2 | 8)})));
  }
  EXPECT_TRUE(left().empty());
  int told = 0;
  for (; known_.size() == 2; ++told) tell(1);
  EXPECT_EQ(left(), std::vector{prefix(1)});
  // Each is 24 bytes of head, 4 + 20 + 12'004 + 4 of the list, and 2 kB that Cyclone needs.
  EXPECT_EQ(1000 + told, 134'217'728 / 14'104 + 1);
}

TEST_F(KnownParticipantsTest, ToLeaveIsSaidAsParticipantsDo) {
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
