// LCM's log: a file of events. Each has a head, the channel's name and the message. The head is
// kLogSync (32 bits), the event's number and time in us (64 bits each), and the sizes of the name
// and the message in bytes (32 bits each), big endian.
#pragma once

#include <cstddef>
#include <cstdint>

namespace ruedo {

inline constexpr uint32_t kLogSync = 0xEDA1DA01;
inline constexpr size_t kLogHeadSize = 28;

// Times are up to this, the year 2255, on either side of 0: their differences, and nanoseconds of
// them, fit 64 bits.
inline constexpr int64_t kLatestLogTime_us = 9'000'000'000'000'000;

}  // namespace ruedo
