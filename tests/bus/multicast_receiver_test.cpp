// The parser of LCM's multicast: datagrams written by hand in LCM's format, and malicious ones.
//
// LCM's own messages to and from a server are tested by the wire tests (tests/clients, tests/cli).
#include "bus/multicast_receiver.h"

#include <algorithm>
#include <cstring>
#include <random>

#include <gtest/gtest.h>
#include <sys/resource.h>

namespace ruedo::bus {
namespace {

using Bytes = std::vector<uint8_t>;

void put(Bytes& out, uint32_t value, int bytes) {
  for (int i = bytes - 1; i >= 0; --i) out.push_back(static_cast<uint8_t>(value >> 8 * i));
}

Bytes short_message(const std::string& channel, const Bytes& data) {
  Bytes out = {'L', 'C', '0', '2', 0, 0, 0, 7};
  out.insert(out.end(), channel.begin(), channel.end());
  out.push_back(0);
  out.insert(out.end(), data.begin(), data.end());
  return out;
}

// A message in fragments of `length` bytes of data.
std::vector<Bytes> fragments(const std::string& channel, const Bytes& data, uint32_t sequence,
                             size_t length) {
  std::vector<Bytes> all;
  const size_t count = (data.size() + length - 1) / length;
  for (size_t i = 0; i < count; ++i) {
    Bytes out = {'L', 'C', '0', '3'};
    put(out, sequence, 4);
    put(out, static_cast<uint32_t>(data.size()), 4);
    put(out, static_cast<uint32_t>(i * length), 4);
    put(out, static_cast<uint32_t>(i), 2);
    put(out, static_cast<uint32_t>(count), 2);
    if (i == 0) {
      out.insert(out.end(), channel.begin(), channel.end());
      out.push_back(0);
    }
    out.insert(out.end(), data.begin() + static_cast<std::ptrdiff_t>(i * length),
               data.begin() + static_cast<std::ptrdiff_t>(std::min(data.size(), (i + 1) * length)));
    all.push_back(std::move(out));
  }
  return all;
}

class Multicast : public testing::Test {
 protected:
  Multicast() {
    try {
      receiver_ = std::make_unique<MulticastReceiver>("239.255.76.67", 7868, 0);
    } catch (const std::system_error&) {
    }
  }
  void SetUp() override {
    if (!receiver_) GTEST_SKIP() << "no multicast route here";
  }
  void read(const Bytes& datagram, MulticastReceiver::Sender sender = {0x7f000001, 4000}) {
    receiver_->read(datagram.data(), datagram.size(), sender,
                    [&](std::string_view channel, const uint8_t* data, size_t size) {
                      heard_.emplace_back(channel, Bytes(data, data + size));
                    });
  }
  std::unique_ptr<MulticastReceiver> receiver_;
  std::vector<std::pair<std::string, Bytes>> heard_;
};

TEST_F(Multicast, ShortMessages) {
  read(short_message("p3at/LRF", {1, 2, 3}));
  read(short_message("x", {}));
  read(short_message(std::string(63, 'n'), {9}));
  ASSERT_EQ(heard_.size(), 3u);
  EXPECT_EQ(heard_[0], (std::pair<std::string, Bytes>("p3at/LRF", {1, 2, 3})));
  EXPECT_EQ(heard_[1], (std::pair<std::string, Bytes>("x", {})));
  EXPECT_EQ(heard_[2].first.size(), 63u);
}

TEST_F(Multicast, LongMessagesInAnyOrderAndTwice) {
  Bytes data(200'000);
  std::minstd_rand random(1);
  for (uint8_t& byte : data) byte = static_cast<uint8_t>(random() >> 8);
  std::vector<Bytes> parts = fragments("r/camera", data, 5, 65'000);
  ASSERT_EQ(parts.size(), 4u);
  for (const Bytes& part : parts) read(part);
  std::reverse(parts.begin(), parts.end());
  for (Bytes& part : parts) {
    part[7] = 6;  // the next message
    read(part);
    if (&part != &parts.back()) read(part);
  }
  ASSERT_EQ(heard_.size(), 2u);
  for (const auto& [channel, bytes] : heard_) {
    EXPECT_EQ(channel, "r/camera");
    EXPECT_TRUE(bytes == data);
  }
}

// LCM's fragments hold 65 487 bytes: of a message whose last one is full, or one byte short of it,
// or holds a single byte.
TEST_F(Multicast, TheLastFragmentMayBeFull) {
  constexpr size_t kFull = 65'487;
  for (const size_t size : {2 * kFull - 1, 2 * kFull, 2 * kFull + 1}) {
    const Bytes data(size, 7);
    for (const Bytes& part : fragments("r/camera", data, static_cast<uint32_t>(size), kFull))
      read(part);
    ASSERT_FALSE(heard_.empty()) << size;
    EXPECT_TRUE(heard_.back().second == data) << size;
    heard_.clear();
  }
}

TEST_F(Multicast, SendersApartAndMessagesThatAreSentAtOnce) {
  const Bytes data(100, 1), other(100, 2);
  const std::vector<Bytes> a = fragments("a", data, 1, 60), b = fragments("b", other, 1, 60),
                           beside = fragments("a", other, 2, 60);
  read(a[0], {1, 1});
  read(b[1], {1, 2});
  read(beside[0], {1, 1});
  read(a[1], {1, 1});
  read(beside[1], {1, 1});
  read(b[0], {1, 2});
  ASSERT_EQ(heard_.size(), 3u);
  EXPECT_EQ(heard_[0], (std::pair<std::string, Bytes>("a", data)));
  EXPECT_EQ(heard_[1], (std::pair<std::string, Bytes>("a", other)));
  EXPECT_EQ(heard_[2], (std::pair<std::string, Bytes>("b", other)));
}

TEST_F(Multicast, AFewMessagesOfEachSenderAreOnTheWay) {
  const Bytes data(100, 1);
  const auto begin = [&](uint32_t sequence, uint16_t port) {
    read(fragments("a", data, sequence, 60)[0], {1, port});
  };
  begin(100, 2);
  for (uint32_t sequence = 1; sequence <= 5; ++sequence) begin(sequence, 1);
  for (uint32_t sequence = 2; sequence <= 5; ++sequence)
    read(fragments("a", data, sequence, 60)[1], {1, 1});
  EXPECT_EQ(heard_.size(), 4u);
  read(fragments("a", data, 1, 60)[1], {1, 1});  // it was forgotten
  EXPECT_EQ(heard_.size(), 4u);
  read(fragments("a", data, 100, 60)[1], {1, 2});  // not for another sender's sake
  EXPECT_EQ(heard_.size(), 5u);
}

// Of which each sender says that 30 MB are to come: they cost what came, and none of the time and
// memory that was announced.
TEST_F(Multicast, AnnouncedSizesAllocateNothing) {
  const auto pages = [] {
    rusage used{};
    ::getrusage(RUSAGE_SELF, &used);
    return used.ru_minflt;
  };
  Bytes first = fragments("c", Bytes(100, 3), 1, 50)[0];
  const uint32_t size = 30u << 20;
  for (size_t i = 0; i < 4; ++i) first[8 + i] = static_cast<uint8_t>(size >> (24 - 8 * i));
  const auto before = pages();
  for (uint32_t i = 0; i < 1000; ++i) {
    first[6] = static_cast<uint8_t>(i >> 8);
    first[7] = static_cast<uint8_t>(i);
    read(first, {1, static_cast<uint16_t>(i % 64)});
  }
  EXPECT_LT(pages() - before, 2000);  // of 4 KiB; 30 MB have 7680
  EXPECT_TRUE(heard_.empty());
}

// Missing fragments are not filled: no memory of ours gets into a message.
TEST_F(Multicast, DropsMessagesWithGaps) {
  std::vector<Bytes> parts = fragments("c", Bytes(300, 3), 1, 100);
  parts[1][15] = 50;  // its offset: over the first, with a gap behind
  for (const Bytes& part : parts) read(part);
  parts = fragments("c", Bytes(300, 3), 2, 100);
  parts[1].resize(parts[1].size() - 1);
  for (const Bytes& part : parts) read(part);
  EXPECT_TRUE(heard_.empty());
  for (const Bytes& part : fragments("c", Bytes(300, 3), 3, 100)) read(part);
  EXPECT_EQ(heard_.size(), 1u);
}

// 80 MB of them at most, and the newest go on.
TEST_F(Multicast, ForgetsUnfinishedMessages) {
  const std::vector<Bytes> parts = fragments("c", Bytes(200'000, 3), 1, 65'000);
  for (uint16_t sender = 0; sender < 200; ++sender)
    for (size_t i = 0; i + 1 < parts.size(); ++i) read(parts[i], {1, sender});
  for (const Bytes& part : parts) read(part, {2, 1});
  EXPECT_EQ(heard_.size(), 1u);
}

TEST_F(Multicast, IgnoresDatagramsThatAreNotLcm) {
  for (const Bytes& bad : {Bytes{}, Bytes{'L', 'C', '0', '2'}, Bytes(8, 0), Bytes(100, 0xff),
                           short_message("", {1}), short_message(std::string(64, 'n'), {1})}) {
    read(bad);
  }
  const Bytes good = fragments("c", Bytes(100, 3), 1, 100)[0];  // one part, whole
  for (size_t at = 8; at < 20; ++at) {  // sizes, offsets and numbers that contradict one another
    for (const uint8_t value : {0x00, 0x01, 0x7f, 0x80, 0xff}) {
      Bytes bad = good;
      if (bad[at] == value) continue;
      bad[at] = value;
      heard_.clear();
      read(bad);
      for (const auto& [channel, bytes] : heard_) EXPECT_GE(bytes.size(), 100u) << at;
    }
  }
  std::minstd_rand random(2);
  for (int i = 0; i < 20'000; ++i) {
    Bytes bad = {'L', 'C', '0', static_cast<uint8_t>(random() % 2 ? '2' : '3')};
    for (size_t n = random() % 60; n > 0; --n)
      bad.push_back(static_cast<uint8_t>(random() % 4 ? 0 : random() >> 8));
    read(bad, {static_cast<uint32_t>(random()), 1});
  }
  heard_.clear();
  read(good);
  ASSERT_EQ(heard_.size(), 1u);
}

}  // namespace
}  // namespace ruedo::bus
