// RTPS messages by hand, from the specification's tables (RTPS 2.5, 9.4 and 9.6).
#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <vector>

namespace ruedo::dds::testing_bytes {

using Bytes = std::vector<uint8_t>;

inline void put(Bytes& bytes, uint64_t value, size_t size, bool little = true) {
  for (size_t i = 0; i < size; ++i)
    bytes.push_back(static_cast<uint8_t>(value >> 8 * (little ? i : size - 1 - i)));
}

inline void append(Bytes& bytes, const Bytes& more) {
  bytes.insert(bytes.end(), more.begin(), more.end());
}

// Of the participant whose prefix is that byte, 12 times.
inline Bytes header(uint8_t who = 7, uint8_t vendor = 16) {
  Bytes bytes{'R', 'T', 'P', 'S', 2, 1, 1, vendor};
  bytes.resize(20, who);
  return bytes;
}

inline Bytes submessage(uint8_t kind, uint8_t flags, const Bytes& body, bool little = true) {
  Bytes bytes{kind, static_cast<uint8_t>(flags | (little ? 1 : 0))};
  put(bytes, body.size(), 2, little);
  append(bytes, body);
  return bytes;
}

// A DATA of that writer: after the sequence number, what follows.
inline Bytes data(uint32_t writer, uint64_t sequence, const Bytes& rest, uint8_t flags = 4,
                  bool little = true) {
  Bytes body;
  put(body, 0, 2, little);
  put(body, 16, 2, little);
  put(body, 0, 4, false);
  put(body, writer, 4, false);
  put(body, sequence >> 32, 4, little);
  put(body, sequence & 0xffffffff, 4, little);
  append(body, rest);
  return submessage(0x15, flags, body, little);
}

inline Bytes message(std::initializer_list<Bytes> parts) {
  Bytes bytes;
  for (const Bytes& part : parts) append(bytes, part);
  return bytes;
}

}  // namespace ruedo::dds::testing_bytes
