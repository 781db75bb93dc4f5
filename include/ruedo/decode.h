// Decoding of messages that nobody vouches for. lcm-gen's decoders read past the end of a buffer whose lengths lie, so
// the bytes are walked first: fingerprint, every length and every string against what is there, and nothing left over.
//
// A type that is decoded this way has a Layout: its fields after the fingerprint, in order.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include "ruedo/join_t.hpp"
#include "ruedo/joint_command_t.hpp"
#include "ruedo/move_command_t.hpp"
#include "ruedo/name_request_t.hpp"
#include "ruedo/rate_request_t.hpp"
#include "ruedo/request_t.hpp"
#include "ruedo/reset_request_t.hpp"
#include "ruedo/step_request_t.hpp"
#include "ruedo/velocity_command_t.hpp"
#include "ruedo/wheel_command_t.hpp"

namespace ruedo {

// One field of a message as it lies on the wire.
struct WireField {
  enum class Kind : uint8_t { bytes, length, string };
  Kind kind;
  int size;          // bytes of one element; unused for strings
  int counted_by;    // index of the length that counts the elements, among the lengths; -1: one element
};

// `size` bytes of numbers: 8 for a double, 24 for a double[3].
constexpr WireField wire_bytes(int size) { return {WireField::Kind::bytes, size, -1}; }
// An int32_t that counts the elements of later fields.
constexpr WireField wire_length() { return {WireField::Kind::length, 4, -1}; }
constexpr WireField wire_string() { return {WireField::Kind::string, 0, -1}; }
// As many elements as the length number `length` (from 0) says.
constexpr WireField wire_bytes_times(int size, int length) { return {WireField::Kind::bytes, size, length}; }
constexpr WireField wire_string_times(int length) { return {WireField::Kind::string, 0, length}; }

template <class Message>
struct Layout;    // static constexpr WireField fields[]

inline constexpr int kMaxWireLengths = 4;    // in one type

// Big-endian integers, as LCM writes them. The bytes must be there.
inline int32_t wire_int32(const uint8_t* bytes) {
  return static_cast<int32_t>(uint32_t{bytes[0]} << 24 | uint32_t{bytes[1]} << 16 | uint32_t{bytes[2]} << 8 | bytes[3]);
}
inline int64_t wire_int64(const uint8_t* bytes) {
  return static_cast<int64_t>(static_cast<uint64_t>(static_cast<uint32_t>(wire_int32(bytes))) << 32 |
                              static_cast<uint32_t>(wire_int32(bytes + 4)));
}

// True when the bytes after the fingerprint are exactly such fields.
inline bool fields_fit(std::span<const WireField> fields, const uint8_t* bytes, size_t size) {
  int64_t lengths[kMaxWireLengths] = {};
  int nlengths = 0;
  size_t at = 0;
  for (const WireField& field : fields) {
    const int64_t count = field.counted_by < 0 ? 1 : lengths[field.counted_by];
    const size_t left = size - at;
    if (field.kind == WireField::Kind::string) {
      for (int64_t i = 0; i < count; ++i) {    // ends early: each takes at least five bytes of what is there
        if (size - at < 5) return false;
        const int64_t length = wire_int32(bytes + at);    // with its closing zero
        if (length < 1 || static_cast<uint64_t>(length) > size - at - 4 || bytes[at + 4 + length - 1] != 0) return false;
        at += 4 + static_cast<size_t>(length);
      }
      continue;
    }
    if (static_cast<uint64_t>(count) > left / static_cast<size_t>(field.size)) return false;
    if (field.kind == WireField::Kind::length) {
      lengths[nlengths] = wire_int32(bytes + at);
      if (lengths[nlengths++] < 0) return false;
    }
    at += static_cast<size_t>(field.size) * static_cast<size_t>(count);
  }
  return at == size;
}

// Why a message was not decoded.
enum class DecodeFault { none, size, fingerprint, lengths };

inline const char* describe(DecodeFault fault) {
  switch (fault) {
    case DecodeFault::none: return "good";
    case DecodeFault::size: return "too short for a fingerprint";
    case DecodeFault::fingerprint: return "another type's or version's fingerprint";
    case DecodeFault::lengths: return "lengths that do not fit its size";
  }
  return "";
}

// Decodes an encoded message into `message`, or says why not and leaves it alone. Never reads outside of the bytes.
template <class Message>
DecodeFault decode_checked(const uint8_t* bytes, size_t size, Message& message) {
  static_assert(std::size(Layout<Message>::fields) > 0);
  if (size < 8 || size > static_cast<size_t>(INT32_MAX)) return DecodeFault::size;
  if (wire_int64(bytes) != Message::getHash()) return DecodeFault::fingerprint;
  if (!fields_fit(Layout<Message>::fields, bytes + 8, size - 8)) return DecodeFault::lengths;
  return message.decode(bytes, 0, static_cast<int>(size)) < 0 ? DecodeFault::lengths : DecodeFault::none;
}

template <> struct Layout<velocity_command_t> { static constexpr WireField fields[] = {wire_bytes(8 + 3 * 8)}; };
template <> struct Layout<wheel_command_t> {
  static constexpr WireField fields[] = {wire_bytes(8), wire_length(), wire_bytes_times(8, 0)};
};
template <> struct Layout<move_command_t> { static constexpr WireField fields[] = {wire_bytes(8 + 8 + 1 + 5 * 8)}; };
template <> struct Layout<joint_command_t> {
  static constexpr WireField fields[] = {wire_bytes(8), wire_length(), wire_string_times(0), wire_bytes_times(1, 0),
                                         wire_bytes_times(8, 0)};
};
template <> struct Layout<request_t> {
  static constexpr WireField fields[] = {wire_bytes(8 + 8 + 4 + 8 + 8 + 4), wire_length(), wire_bytes_times(1, 0)};
};
template <> struct Layout<join_t> { static constexpr WireField fields[] = {wire_string()}; };
template <> struct Layout<name_request_t> { static constexpr WireField fields[] = {wire_string()}; };
template <> struct Layout<step_request_t> { static constexpr WireField fields[] = {wire_bytes(8)}; };
template <> struct Layout<rate_request_t> { static constexpr WireField fields[] = {wire_bytes(8)}; };
template <> struct Layout<reset_request_t> { static constexpr WireField fields[] = {wire_bytes(1 + 8)}; };

}  // namespace ruedo
