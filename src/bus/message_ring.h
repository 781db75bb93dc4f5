// The newest messages, in one block of memory: each reader has a place of its own in it, and one
// that falls a whole ring behind loses the overwritten messages. So a slow reader costs no memory.
//
// Not thread safe.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

namespace ruedo::bus {

class MessageRing {
 public:
  struct Message {
    uint32_t channel;                // a number of the writer's own
    std::span<const uint8_t> bytes;  // valid until the next append
    uint64_t next;                   // the place of the message after it
  };

  // The memory is touched, and so taken, as it is first written.
  explicit MessageRing(size_t capacity);

  // Messages of up to largest() bytes; false for a larger one.
  bool append(uint32_t channel, std::span<const uint8_t> bytes);
  size_t largest() const { return capacity_ / 4; }

  // Places: those from begin() to before end() hold messages.
  uint64_t begin() const { return begin_; }
  uint64_t end() const { return end_; }
  // The message at a place in [begin(), end()).
  Message at(uint64_t place) const;

 private:
  struct Head {
    uint32_t size;  // of the message; kPadding: nothing up to the end of the block
    uint32_t channel;
  };
  static constexpr uint32_t kPadding = UINT32_MAX;

  uint64_t after_padding(uint64_t place) const;
  void make_room(uint64_t end);

  size_t capacity_;
  std::unique_ptr<uint8_t[]> block_;
  uint64_t begin_ = 0, end_ = 0;
};

}  // namespace ruedo::bus
