// The submessages of an untrusted RTPS message (RTPS 2.5, 9.4).
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "bridges/ros2/transport.h"

namespace ruedo::dds {

inline constexpr size_t kMessageHeader = 20, kSubmessageHeader = 4, kPrefix = 12;

using Prefix = std::array<uint8_t, kPrefix>;  // of the GUIDs of a participant and of all it has

// Who sends: by a message's head, and from an InfoSource on by that. Participants of one process
// may share a message.
struct Sender {
  std::array<uint8_t, 2> vendor{};
  Prefix prefix{};
};

inline Sender sender_at(std::span<const uint8_t> bytes, size_t place) {
  Sender sender;
  const auto from = bytes.begin() + static_cast<std::ptrdiff_t>(place);
  std::copy_n(from, sender.vendor.size(), sender.vendor.begin());
  std::copy_n(from + sender.vendor.size(), kPrefix, sender.prefix.begin());
  return sender;
}

inline constexpr size_t kSenderInHead = 6;

struct Submessage {
  enum Kind : uint8_t {
    kPad = 0x01,
    kHeartbeat = 0x07,
    kGap = 0x08,
    kInfoTimestamp = 0x09,
    kInfoSource = 0x0c,
    kInfoDestination = 0x0e,
    kData = 0x15,
    kDataFrag = 0x16,
    kNothing = 0xff,  // a vendor's own, which no reader knows
  };
  static constexpr uint8_t kLittleEndian = 1;
  // Of Data and DataFrag: where the writer and its sequence number are; of a DataFrag, these and
  // where its payload begins at the earliest.
  static constexpr size_t kWriter = 12, kSequence = 16, kDataHead = 24;
  static constexpr size_t kFirstFragment = 24, kFragmentSize = 30, kSampleSize = 32,
                          kFragmentHead = 36;

  static constexpr size_t kSender = 10, kSourceSize = 24;  // of an InfoSource

  std::span<uint8_t> bytes;

  uint8_t kind() const { return bytes[0]; }
  bool is_little_endian() const { return bytes[1] & kLittleEndian; }
  bool is_data() const { return kind() == kData && bytes.size() >= kDataHead; }
  bool is_fragment() const { return kind() == kDataFrag && bytes.size() >= kFragmentHead; }
  bool is_source() const { return kind() == kInfoSource && bytes.size() >= kSourceSize; }
  void erase() const { bytes[0] = kNothing; }
  // Of a fragment: sets the largest sample size of all, for which Cyclone skips the sample,
  // and continues with the next.
  void leave_out() const { std::fill_n(bytes.begin() + kSampleSize, 4, uint8_t{0xff}); }
  uint32_t number(size_t at, size_t size) const {
    uint32_t value = 0;
    for (size_t i = 0; i < size; ++i) {
      const size_t shift = is_little_endian() ? i : size - 1 - i;
      value |= uint32_t{bytes[at + i]} << 8 * shift;
    }
    return value;
  }
  int64_t sequence(size_t at) const {
    return static_cast<int64_t>(uint64_t{number(at, 4)} << 32 | number(at + 4, 4));
  }
};

// None: nothing whole begins there.
inline std::optional<Submessage> submessage_at(std::span<uint8_t> message, size_t begin) {
  if (begin + kSubmessageHeader > message.size()) return std::nullopt;
  const Submessage head{message.subspan(begin)};
  const size_t size = head.number(2, 2);
  if (size == 0) {  // the last may leave its size to the datagram's
    const bool is_empty =
        head.kind() == Submessage::kPad || head.kind() == Submessage::kInfoTimestamp;
    return is_empty ? Submessage{message.subspan(begin, kSubmessageHeader)} : head;
  }
  if (begin + kSubmessageHeader + size > message.size()) return std::nullopt;
  return Submessage{message.subspan(begin, kSubmessageHeader + size)};
}

template <class Do>
void for_each_submessage(std::span<uint8_t> message, Do what) {
  for (size_t at = kMessageHeader; const auto each = submessage_at(message, at);) {
    at += each->bytes.size();
    what(*each);
  }
}

}  // namespace ruedo::dds
