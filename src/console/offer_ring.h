// Messages on their way from the publisher to the console: a ring of bytes that never makes its
// writer wait.
//
// One writer and one reader at a time. What has no room is dropped and counted.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

namespace ruedo::console {

class OfferRing {
 public:
  // size: a power of two, in bytes.
  explicit OfferRing(size_t size) : bytes_(size), mask_(size - 1) {}

  // The writer's. False when there is no room for it now.
  bool offer(uint32_t channel, const uint8_t* data, size_t size) {
    const uint64_t begin = written_.load(std::memory_order_relaxed);
    const uint64_t used = begin - read_.load(std::memory_order_acquire);
    const size_t needed = sizeof(Head) + size;
    if (needed > bytes_.size() - used) {
      dropped_.store(dropped_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
      return false;
    }
    const Head head{channel, static_cast<uint32_t>(size)};
    put(begin, &head, sizeof head);
    put(begin + sizeof head, data, size);
    written_.store(begin + needed, std::memory_order_release);
    return true;
  }

  // The reader's: handler(channel, bytes) for each message that waits, in their order.
  template <class Handler>
  void drain(const Handler& handler) {
    uint64_t at = read_.load(std::memory_order_relaxed);
    const uint64_t end = written_.load(std::memory_order_acquire);
    while (at != end) {
      Head head;
      get(at, &head, sizeof head);
      std::vector<uint8_t> message(head.size);
      get(at + sizeof head, message.data(), head.size);
      at += sizeof head + head.size;
      read_.store(at, std::memory_order_release);
      handler(head.channel, std::move(message));
    }
  }

  uint64_t dropped() const { return dropped_.load(std::memory_order_relaxed); }

 private:
  struct Head {
    uint32_t channel, size;
  };

  void put(uint64_t at, const void* from, size_t size) {
    const size_t begin = at & mask_, first = std::min(size, bytes_.size() - begin);
    std::memcpy(bytes_.data() + begin, from, first);
    std::memcpy(bytes_.data(), static_cast<const uint8_t*>(from) + first, size - first);
  }
  void get(uint64_t at, void* into, size_t size) const {
    const size_t begin = at & mask_, first = std::min(size, bytes_.size() - begin);
    std::memcpy(into, bytes_.data() + begin, first);
    std::memcpy(static_cast<uint8_t*>(into) + first, bytes_.data(), size - first);
  }

  std::vector<uint8_t> bytes_;
  const uint64_t mask_;
  alignas(64) std::atomic<uint64_t> written_{0};
  alignas(64) std::atomic<uint64_t> read_{0};
  std::atomic<uint64_t> dropped_{0};
};

}  // namespace ruedo::console
