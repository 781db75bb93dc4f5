// Finds a time in a log of LCM's (base/lcm_log.h) by halves, without reading what lies before it.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "base/big_endian.h"
#include "base/lcm_log.h"
#include "base/message_size.h"

namespace ruedo {

inline constexpr uint32_t kLongestLogChannel = 1000;  // bytes

// Whether an event may begin with these kLogHeadSize bytes.
inline bool is_log_head(const uint8_t* head) {
  const auto time_us = read_big_endian<int64_t>(head + 12);
  return read_big_endian<uint32_t>(head) == kLogSync &&
         read_big_endian<uint32_t>(head + 20) <= kLongestLogChannel &&
         read_big_endian<uint32_t>(head + 24) <= kLargestMessage && time_us >= -kLatestLogTime_us &&
         time_us <= kLatestLogTime_us;
}

// Bytes of the event that begins with this head.
inline int64_t log_event_size(const uint8_t* head) {
  return int64_t{kLogHeadSize} + read_big_endian<uint32_t>(head + 20) +
         read_big_endian<uint32_t>(head + 24);
}

// The first event that begins between the two bytes; what only looks like one in a message has no
// other behind it. read_at(offset, into, size): copies bytes of the log, and returns how many.
template <class ReadAt>
std::optional<int64_t> log_event_after(int64_t offset, int64_t end, int64_t size, ReadAt read_at) {
  constexpr size_t kLookedAt = 1 << 16;  // bytes at a time
  std::vector<uint8_t> bytes(kLookedAt + kLogHeadSize);
  for (; offset < end; offset += kLookedAt) {
    const size_t got = read_at(offset, bytes.data(), bytes.size());
    for (size_t i = 0; i + kLogHeadSize <= got && i < kLookedAt; ++i) {
      const int64_t at = offset + static_cast<int64_t>(i);
      if (at >= end) return {};
      if (!is_log_head(bytes.data() + i)) continue;
      const int64_t behind = at + log_event_size(bytes.data() + i);
      std::array<uint8_t, kLogHeadSize> head{};
      if (behind == size ||
          (read_at(behind, head.data(), head.size()) == head.size() && is_log_head(head.data())))
        return at;
    }
  }
  return {};
}

// The place of an event shortly before that time: all events before it are earlier, too. The log
// has `size` bytes, and its times never go back.
template <class ReadAt>
int64_t find_log_time(int64_t time_us, int64_t size, ReadAt read_at) {
  constexpr int64_t kNear = 1 << 20;  // bytes that are read faster than halved
  int64_t low = 0, high = size;  // an event begins at low, and is before the time, or the first
  while (high - low > kNear) {
    const int64_t middle = low + (high - low) / 2;
    const std::optional<int64_t> found = log_event_after(middle, high, size, read_at);
    std::array<uint8_t, kLogHeadSize> head{};
    if (found && read_at(*found, head.data(), head.size()) == head.size() &&
        read_big_endian<int64_t>(head.data() + 12) < time_us)
      low = *found;
    else
      high = middle;
  }
  return low;
}

}  // namespace ruedo
