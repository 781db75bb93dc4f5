// Big-endian numbers, as LCM has them on the wire and in its logs.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace ruedo {

// Of the first `size` bytes, 8 at most.
inline uint64_t read_big_endian(const uint8_t* bytes, size_t size) {
  uint64_t value = 0;
  for (size_t i = 0; i < size; ++i) value = value << 8 | bytes[i];
  return value;
}

template <class Integer>
Integer read_big_endian(const uint8_t* bytes) {
  return static_cast<Integer>(read_big_endian(bytes, sizeof(Integer)));
}

template <class Integer>
void write_big_endian(uint8_t* bytes, Integer value) {
  auto rest = static_cast<uint64_t>(value);
  for (size_t i = sizeof value; i-- > 0; rest >>= 8) bytes[i] = static_cast<uint8_t>(rest);
}

template <class Integer>
void append_big_endian(std::vector<uint8_t>& out, Integer value) {
  uint8_t bytes[sizeof value];
  write_big_endian(bytes, value);
  out.insert(out.end(), bytes, bytes + sizeof value);
}

}  // namespace ruedo
