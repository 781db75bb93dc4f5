// Passes messages from the run to the console: a ring buffer in which writers never wait.
//
// Any number of writers, one reader. A writer reserves space, fills it, and marks it as filled
// last; the reader stops at the first space that is not filled yet. A message that does not fit is
// dropped and counted.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <utility>
#include <vector>

namespace ruedo::console {

class OfferRing {
 public:
  // size: in bytes, a power of two, at least 16.
  explicit OfferRing(size_t size) : words_(size / kWord), mask_(size / kWord - 1) {}

  // Any thread. False if there is no room now.
  bool offer(uint32_t channel, const uint8_t* data, size_t size) {
    const uint64_t needed = words_for(size);
    uint64_t begin = taken_.load(std::memory_order_relaxed);
    do {
      // Acquire: the reader has cleared the space that it released.
      if (begin + needed - read_.load(std::memory_order_acquire) > words_.size()) {
        dropped_.fetch_add(1, std::memory_order_relaxed);
        return false;
      }
    } while (!taken_.compare_exchange_weak(begin, begin + needed, std::memory_order_relaxed));
    copy(begin + 1, size,
         [&](void* place, size_t at, size_t count) { std::memcpy(place, data + at, count); });
    head(begin).store(uint64_t{channel} << 32 | (size + 1), std::memory_order_release);
    return true;
  }

  // For the reader: calls handler(channel, bytes) for each waiting message, in order.
  template <class Handler>
  void drain(const Handler& handler) {
    for (uint64_t begin = read_.load(std::memory_order_relaxed);;) {
      if (begin == taken_.load(std::memory_order_relaxed)) return;
      const uint64_t filled = head(begin).load(std::memory_order_acquire);
      if (filled == 0) return;
      std::vector<uint8_t> message((filled & 0xffffffff) - 1);
      copy(begin + 1, message.size(), [&](void* place, size_t at, size_t count) {
        std::memcpy(message.data() + at, place, count);
        std::memset(place, 0, count);  // any word may become the header of a later message
      });
      head(begin).store(0, std::memory_order_relaxed);
      begin += words_for(message.size());
      read_.store(begin, std::memory_order_release);
      handler(static_cast<uint32_t>(filled >> 32), std::move(message));
    }
  }

  uint64_t dropped() const { return dropped_.load(std::memory_order_relaxed); }

 private:
  static constexpr size_t kWord = sizeof(uint64_t);

  // A header, which is 0 until the message is complete, and the bytes.
  static uint64_t words_for(size_t size) { return 1 + (size + kWord - 1) / kWord; }

  std::atomic_ref<uint64_t> head(uint64_t at) { return std::atomic_ref(words_[at & mask_]); }

  // Calls part(place in the ring, offset in the message, count) for the one or two pieces of a
  // message.
  template <class Part>
  void copy(uint64_t at, size_t size, const Part& part) {
    if (size == 0) return;
    const size_t begin = at & mask_, first = std::min(size, (words_.size() - begin) * kWord);
    part(words_.data() + begin, 0, first);
    if (first < size) part(words_.data(), first, size - first);
  }

  std::vector<uint64_t> words_;
  const uint64_t mask_;
  alignas(64) std::atomic<uint64_t> taken_{0};  // words since the beginning, like read_
  alignas(64) std::atomic<uint64_t> read_{0};
  std::atomic<uint64_t> dropped_{0};
};

}  // namespace ruedo::console
