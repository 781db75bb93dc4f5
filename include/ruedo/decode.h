// Decoding of messages that are not trusted. lcm-gen's decoders read past the end of a buffer
// whose lengths lie, so the bytes are walked by the type's schema first: fingerprint, every length
// and string, and nothing left over.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "ruedo/schema.h"

namespace ruedo {

// Why a message was not decoded.
enum class DecodeFault { none, size, fingerprint, lengths };

inline const char* describe(DecodeFault fault) {
  switch (fault) {
    case DecodeFault::none: return "good";
    case DecodeFault::size: return "too short for a fingerprint";
    case DecodeFault::fingerprint: return "the fingerprint is another type's or version's";
    case DecodeFault::lengths: return "its lengths do not fit its size";
  }
  return "";
}

// Decodes an encoded message of a type in proto/ into `message`, or says why not and leaves it
// alone. Never reads outside of the bytes, and allocates no more than they hold.
template <class Message>
DecodeFault decode_checked(const uint8_t* bytes, size_t size, Message& message) {
  static const Schema* const schema = find_schema(Message::getTypeName());
  if (size < 8 || size > static_cast<size_t>(INT32_MAX)) return DecodeFault::size;
  if (fingerprint_of({bytes, size}) != Message::getHash()) return DecodeFault::fingerprint;
  if (!schema || !well_formed(*schema, {bytes, size})) return DecodeFault::lengths;
  return message.decode(bytes, 0, static_cast<int>(size)) < 0 ? DecodeFault::lengths
                                                              : DecodeFault::none;
}

}  // namespace ruedo
