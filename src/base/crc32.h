// CRC-32 (IEEE 802.3), by zlib.
#pragma once

#include <cstddef>
#include <cstdint>

#include <zlib.h>

namespace ruedo {

// before: the checksum of the bytes that come before these.
inline uint32_t crc32(const uint8_t* data, size_t size, uint32_t before = 0) {
  return static_cast<uint32_t>(::crc32_z(before, data, size));
}

}  // namespace ruedo
