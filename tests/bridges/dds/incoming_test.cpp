// RTPS messages by hand, from the specification's tables (RTPS 2.5, 9.4.5.5).
#include "bridges/dds/incoming.h"

#include <random>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace ruedo::dds {
namespace {

using testing::ElementsAre;
using Bytes = std::vector<uint8_t>;

Bytes header() {
  Bytes bytes{'R', 'T', 'P', 'S', 2, 1, 1, 16};
  bytes.resize(20, 7);
  return bytes;
}

void put(Bytes& bytes, uint64_t value, size_t size, bool little) {
  for (size_t i = 0; i < size; ++i)
    bytes.push_back(static_cast<uint8_t>(value >> 8 * (little ? i : size - 1 - i)));
}

// DATA_FRAG with so much payload; its size stands there as `told`.
Bytes fragment(uint16_t fragment_size, uint32_t sample_size, size_t payload, bool little = true,
               int told = -1) {
  Bytes bytes{0x16, static_cast<uint8_t>(little ? 1 : 0)};
  put(bytes, told >= 0 ? static_cast<uint64_t>(told) : 32 + payload, 2, little);
  put(bytes, 0, 2, little);
  put(bytes, 28, 2, little);
  for (const uint32_t number : {0u, 0x203u, 0u, 5u, 1u}) put(bytes, number, 4, little);
  put(bytes, 1, 2, little);
  put(bytes, fragment_size, 2, little);
  put(bytes, sample_size, 4, little);
  bytes.resize(bytes.size() + payload, 42);
  return bytes;
}

// Of each fragment in the message: its kind, and the sample size as it stands there.
std::vector<std::pair<int, uint32_t>> bounded(std::vector<Bytes> parts) {
  Bytes message = header();
  std::vector<size_t> begins;
  for (const Bytes& part : parts) {
    if (part[0] == 0x16) begins.push_back(message.size());
    message.insert(message.end(), part.begin(), part.end());
  }
  bound_fragments(message);
  std::vector<std::pair<int, uint32_t>> found;
  for (const size_t at : begins) {
    uint32_t size = 0;
    for (size_t i = 0; i < 4; ++i) {
      const size_t shift = message[at + 1] & 1 ? i : 3 - i;
      size |= uint32_t{message[at + 32 + i]} << 8 * shift;
    }
    found.emplace_back(message[at], size);
  }
  return found;
}

constexpr uint32_t kAll = 0xffffffff;

TEST(Incoming, KeepsFragmentsOfAllowedSamples) {
  for (const bool little : {true, false}) {
    EXPECT_THAT(bounded({fragment(1344, 4u << 20, 1344, little), fragment(512, 1000, 488, little)}),
                ElementsAre(std::pair(0x16, 4u << 20), std::pair(0x16, 1000u)));
  }
}

TEST(Incoming, TooLargeASampleAndTooSmallFragmentsAreLeftOutAlone) {
  for (const bool little : {true, false}) {
    EXPECT_THAT(bounded({fragment(1344, (4u << 20) + 1, 1344, little), fragment(1344, 9000, 1344),
                         fragment(511, 9000, 511, little)}),
                ElementsAre(std::pair(0x16, kAll), std::pair(0x16, 9000u), std::pair(0x16, kAll)));
  }
}

TEST(Incoming, TheLastMayLeaveItsSizeToTheDatagram) {
  EXPECT_THAT(bounded({fragment(1344, 9000, 1344), fragment(1344, 1u << 31, 1344, true, 0)}),
              ElementsAre(std::pair(0x16, 9000u), std::pair(0x16, kAll)));
}

TEST(Incoming, LittlePayloadInALargeDatagramCounts) {
  Bytes other{0x80, 1, 0, 0x3f};
  other.resize(4 + 0x3f00);
  EXPECT_THAT(bounded({other, fragment(1344, 9000, 100)}), ElementsAre(std::pair(0x16, 9000u)));
  EXPECT_THAT(bounded({other, fragment(1344, 9000, 100), other}),
              ElementsAre(std::pair(0xff, 9000u)));
  EXPECT_THAT(bounded({other, fragment(60000, 1u << 20, 20000), other, other}),
              ElementsAre(std::pair(0xff, 1u << 20)));
}

TEST(Incoming, AnyBytesAreRead) {
  std::mt19937 random(1);
  for (int round = 0; round < 20'000; ++round) {
    Bytes message = header();
    while (message.size() < random() % 400) {
      Bytes part = fragment(static_cast<uint16_t>(random() % 2000), random() % (8u << 20),
                            random() % 50, random() % 2 == 0);
      part[random() % part.size()] = static_cast<uint8_t>(random());
      part.resize(part.size() - random() % (random() % 8 == 0 ? part.size() : 1));
      message.insert(message.end(), part.begin(), part.end());
    }
    const Bytes before(message.begin(), message.begin() + 20);
    message.resize(random() % 16 == 0 ? random() % (message.size() + 1) : message.size());
    bound_fragments(message);  // under the sanitizers: within the message
    EXPECT_TRUE(std::equal(message.begin(),
                           message.begin() + std::min<long>(20, std::ssize(message)),
                           before.begin()));
  }
}

}  // namespace
}  // namespace ruedo::dds
