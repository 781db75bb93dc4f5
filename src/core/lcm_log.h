// LCM's log: a file of events. Each has a head, the channel's name and the message. The head is
// kLogSync (32 bits), the event's number and time in us (64 bits each), and the sizes of the name
// and the message in bytes (32 bits each), big endian.
#pragma once

#include <cstddef>
#include <cstdint>

namespace ruedo {

inline constexpr uint32_t kLogSync = 0xEDA1DA01;
inline constexpr size_t kLogHeadSize = 28;

}  // namespace ruedo
