// LCM's own library receives the multicast messages of the C++ client.
#include "bus/multicast_sender.h"

#include <algorithm>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <lcm/lcm-cpp.hpp>

namespace ruedo::bus {
namespace {

constexpr const char* kGroup = "239.255.76.67";
constexpr uint16_t kPort = 7871;
constexpr int kPatience_ms = 20'000;

class MulticastSending : public testing::Test {
 protected:
  void SetUp() override {
    // A socket's default buffer of 208 KiB holds three fragments.
    in_ = std::make_unique<lcm::LCM>("udpm://239.255.76.67:7871?ttl=0&recv_buf_size=8388608");
    if (!in_->good()) GTEST_SKIP() << "no multicast route here";
    in_->subscribe(".*", &MulticastSending::take, this);
  }
  void take(const lcm::ReceiveBuffer* buffer, const std::string& channel) {
    const auto* data = static_cast<const uint8_t*>(buffer->data);
    channels_.push_back(channel);
    messages_.emplace_back(data, data + buffer->data_size);
  }
  void receive(size_t count) {
    while (messages_.size() < count) ASSERT_GT(in_->handleTimeout(kPatience_ms), 0);
  }

  std::unique_ptr<lcm::LCM> in_;
  std::vector<std::string> channels_;
  std::vector<std::vector<uint8_t>> messages_;
};

std::vector<uint8_t> message(size_t size) {
  std::vector<uint8_t> bytes(size);
  for (size_t i = 0; i < size; ++i) bytes[i] = static_cast<uint8_t>(i * 31 >> 3);
  return bytes;
}

TEST_F(MulticastSending, AnySizeReachesLcm) {
  MulticastSender sender(kGroup, kPort, 0);
  // Around the largest datagram, of which "A/1" and its 0 take four bytes.
  const std::vector<size_t> sizes{0, 1, 63'995, 63'996, 63'997, 127'996, 127'997, 640 * 480 * 3};
  for (size_t i = 0; i < sizes.size(); ++i) {
    sender.send("A/1", message(sizes[i]).data(), sizes[i]);
    receive(i + 1);  // one at a time: the buffer is as large as the system allows
    ASSERT_EQ(channels_.back(), "A/1");
    ASSERT_EQ(messages_.back(), message(sizes[i]));
  }
}

TEST_F(MulticastSending, ThreadsDoNotMixTheirFragments) {
  MulticastSender sender(kGroup, kPort, 0);
  constexpr size_t kThreads = 3, kSize = 70'000;
  std::vector<std::thread> threads;
  for (size_t i = 0; i < kThreads; ++i)
    threads.emplace_back(
        [&, i] { sender.send("B" + std::to_string(i), message(kSize + i).data(), kSize + i); });
  for (std::thread& thread : threads) thread.join();
  receive(kThreads);
  for (size_t i = 0; i < kThreads; ++i)
    EXPECT_EQ(messages_[i], message(kSize + static_cast<size_t>(channels_[i][1] - '0')));
}

TEST(MulticastSender, SaysWhyAGroupCannotBeUsed) {
  EXPECT_THROW(MulticastSender("nowhere", kPort, 0), std::system_error);
}

}  // namespace
}  // namespace ruedo::bus
