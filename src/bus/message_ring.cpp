// Records of a head and the bytes, each in one piece, at places that are multiples of eight.
#include "bus/message_ring.h"

#include <cstring>

namespace ruedo::bus {
namespace {

constexpr uint64_t rounded(uint64_t size) { return (size + 7) & ~uint64_t{7}; }

}  // namespace

MessageRing::MessageRing(size_t capacity)
    : capacity_(rounded(capacity)), block_(new uint8_t[capacity_]) {}

bool MessageRing::append(uint32_t channel, std::span<const uint8_t> bytes) {
  if (bytes.size() > largest()) return false;
  const uint64_t size = rounded(sizeof(Head) + bytes.size());
  const uint64_t left = capacity_ - end_ % capacity_;
  if (left < size) {
    make_room(end_ + left);
    const Head padding{kPadding, 0};
    std::memcpy(&block_[end_ % capacity_], &padding, sizeof padding);
    end_ += left;
  }
  make_room(end_ + size);
  const Head head{static_cast<uint32_t>(bytes.size()), channel};
  uint8_t* at = &block_[end_ % capacity_];
  std::memcpy(at, &head, sizeof head);
  if (!bytes.empty()) std::memcpy(at + sizeof head, bytes.data(), bytes.size());
  end_ += size;
  return true;
}

MessageRing::Message MessageRing::at(uint64_t place) const {
  place = after_padding(place);
  const uint8_t* at = &block_[place % capacity_];
  Head head;
  std::memcpy(&head, at, sizeof head);
  return {head.channel, {at + sizeof head, head.size}, place + rounded(sizeof head + head.size)};
}

uint64_t MessageRing::after_padding(uint64_t place) const {
  Head head;
  std::memcpy(&head, &block_[place % capacity_], sizeof head);
  return head.size == kPadding ? place + capacity_ - place % capacity_ : place;
}

// Gives up the oldest messages until the block holds everything up to `end`.
void MessageRing::make_room(uint64_t end) {
  while (begin_ < end_ && end - begin_ > capacity_) {
    const uint64_t message = after_padding(begin_);
    begin_ = message < end_ ? at(message).next : message;
  }
}

}  // namespace ruedo::bus
