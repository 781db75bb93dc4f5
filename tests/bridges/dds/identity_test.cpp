// RTPS messages by hand, from the specification's tables (RTPS 2.5, 9.4.5.4; DDS-RPC 1.0, 7.8.2).
#include "bridges/dds/identity.h"

#include <algorithm>
#include <bit>
#include <numeric>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace ruedo::dds {
namespace {

using testing::ElementsAreArray;
using testing::IsEmpty;
using Bytes = std::vector<uint8_t>;

Bytes joined(std::initializer_list<Bytes> parts) {
  Bytes all;
  for (const Bytes& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

// RTPS 2.1, vendor 1.16, the prefix 100, 101, ...
const Bytes kHeader{'R', 'T', 'P', 'S', 2,   1,   1,   16,  100, 101,
                    102, 103, 104, 105, 106, 107, 108, 109, 110, 111};
const Bytes kTime{9, 1, 8, 0, 1, 2, 3, 4, 5, 6, 7, 8};  // INFO_TS
// To no particular reader, from the writer 0 0 21 3, number 5; behind it inline QoS and payload.
Bytes data(uint8_t flags, const Bytes& rest) {
  const auto size = static_cast<uint8_t>(20 + rest.size());
  return joined(
      {{0x15, flags, size, 0, 0, 0, 16, 0, 0, 0, 0, 0, 0, 0, 21, 3, 0, 0, 0, 0, 5, 0, 0, 0}, rest});
}
const Bytes kHeartbeat{7, 1, 4, 0, 9, 9, 9, 9};

ros2::SampleIdentity request() {
  ros2::SampleIdentity identity;
  std::iota(identity.writer.begin(), identity.writer.end(), uint8_t{1});
  identity.sequence = (int64_t{2} << 32) + 3;
  return identity;
}
const Bytes kIdentity{1,  2,  3,  4,  5, 6, 7, 8, 9, 10, 11, 12,
                      13, 14, 15, 16, 2, 0, 0, 0, 3, 0,  0,  0};
const Bytes kRelated = joined({{0x83, 0x00, 24, 0}, kIdentity});
const Bytes kRelatedFast = joined({{0x0f, 0x80, 24, 0}, kIdentity});
const Bytes kSentinel{1, 0, 0, 0};
const Bytes kPayload{0, 1, 0, 2, 42, 43, 0, 0};

TEST(Identity, GoesFromThePayloadToTheInlineQos) {
  const Bytes marked = with_identity(kPayload, request());
  const Bytes message = joined({kHeader, kTime, data(5, marked), kHeartbeat});
  const Bytes wanted = joined(
      {kHeader, kTime, data(7, joined({kRelated, kRelatedFast, kSentinel, kPayload})), kHeartbeat});
  EXPECT_THAT(with_inline_identities(message), ElementsAreArray(wanted));
}

TEST(Identity, IsAddedToExistingInlineQos) {
  const Bytes status{0x71, 0, 4, 0, 0, 0, 0, 0};
  const Bytes marked = with_identity(kPayload, request());
  const Bytes message = joined({kHeader, data(7, joined({status, kSentinel, marked}))});
  const Bytes wanted =
      joined({kHeader, data(7, joined({kRelated, kRelatedFast, status, kSentinel, kPayload}))});
  EXPECT_THAT(with_inline_identities(message), ElementsAreArray(wanted));
}

TEST(Identity, LeavesOtherMessagesUnchanged) {
  for (const Bytes& message :
       {joined({kHeader, kTime, data(5, kPayload), kHeartbeat}), joined({kHeader, kTime}), Bytes{},
        Bytes{'R', 'T'}, joined({kHeader, {0x15, 5, 200, 0, 1}}),
        joined({kHeader, data(7, {0x71, 0, 250, 0})})}) {
    EXPECT_THAT(with_inline_identities(message), ElementsAreArray(message));
  }
}

TEST(Identity, OfARequestIsItsWritersNumberOrTheReaderThatWaits) {
  // As Cyclone leaves it on such a machine: the words of GUIDs are byte-swapped.
  static_assert(std::endian::native == std::endian::little);
  Bytes plain = joined({kHeader, kTime, data(5, {})});
  for (const std::ptrdiff_t word : {8, 12, 16, 20 + 12 + 12})
    std::reverse(plain.begin() + word, plain.begin() + word + 4);
  const DataIdentity own = identity_in(plain, kHeader.size() + kTime.size());
  EXPECT_THAT(own.sample.writer, ElementsAreArray({100, 101, 102, 103, 104, 105, 106, 107, 108, 109,
                                                   110, 111, 0, 0, 21, 3}));
  EXPECT_EQ(own.sample.sequence, 5);
  EXPECT_THAT(own.vendor, ElementsAreArray({1, 16}));
  EXPECT_FALSE(own.related);
  for (const Bytes& parameter : {kRelated, kRelatedFast}) {
    const Bytes message = joined({kHeader, data(7, joined({parameter, kSentinel}))});
    const DataIdentity found = identity_in(message, kHeader.size());
    ASSERT_TRUE(found.related);
    EXPECT_THAT(*found.related, ElementsAreArray(request().writer));
    EXPECT_EQ(found.sample.sequence, 5);
  }
}

// Announcements of several participants of a process in one message, as Cyclone leaves it: sizes
// are swapped, the prefix in an INFO_SRC is not.
TEST(Identity, OfARequestInASharedMessageIsItsOwnParticipants) {
  const Bytes source{0x0c, 1,   20,  0,   0,   0,   0,   0,   2,   1,   1,   15,
                     200,  201, 202, 203, 204, 205, 206, 207, 208, 209, 210, 211};
  const Bytes empty_time{9, 3, 0, 0};
  Bytes message = joined({kHeader, kTime, data(5, {}), source, empty_time, data(5, {})});
  const size_t first = kHeader.size() + kTime.size(), second = message.size() - data(5, {}).size();
  for (const size_t word : {first + 12, second + 12}) {
    const auto at = message.begin() + static_cast<std::ptrdiff_t>(word);
    std::reverse(at, at + 4);
  }
  EXPECT_EQ(identity_in(message, first).vendor[1], 16);
  const DataIdentity found = identity_in(message, second);
  EXPECT_THAT(found.sample.writer, ElementsAreArray({200, 201, 202, 203, 204, 205, 206, 207, 208,
                                                     209, 210, 211, 0, 0, 21, 3}));
  EXPECT_THAT(found.vendor, ElementsAreArray({1, 15}));
}

// Every truncated message, and every message with one changed byte, is read without a fault.
TEST(Identity, DamagedMessagesHaveNoIdentity) {
  const Bytes message = joined({kHeader, data(7, joined({kRelated, kSentinel}))});
  for (size_t size = 0; size < message.size(); ++size)
    identity_in(std::span(message).first(size), kHeader.size());
  for (size_t at = 0; at < message.size(); ++at) {
    for (const uint8_t byte : {0x00, 0x7f, 0xff}) {
      Bytes damaged = message;
      damaged[at] = byte;
      identity_in(damaged, kHeader.size());
      with_inline_identities(damaged);
    }
  }
  EXPECT_FALSE(identity_in(std::span(message).first(60), kHeader.size()).related);
}

TEST(Identity, OfMoreThanADatagramIsRefused) {
  EXPECT_THAT(with_identity(Bytes(60'000), request()), IsEmpty());
}

}  // namespace
}  // namespace ruedo::dds
