// How each kind of sample comes off the wire.
#pragma once

#include <cstdint>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "ruedo/client.h"
#include "sample_list.h"
#include "samples/wire_reader.h"

namespace ruedo::client {

// A message type: its name and fingerprint, and how it becomes a sample.
struct SampleDecoder {
  const char* type;
  int64_t fingerprint;
  std::shared_ptr<const Sample> (*decode)(WireReader&);  // throws WireError
};

// A later server may send values that are unknown here.
template <class Enum>
Enum known(int32_t number) {
  const auto value = static_cast<Enum>(number);
  return std::strcmp(to_string(value), "unknown") == 0 ? Enum::unknown : value;
}

// Throws WireError where an array does not have so many elements.
inline void check_product(size_t size, int64_t rows, int64_t columns) {
  if (rows < 0 || columns < 0 || static_cast<uint64_t>(rows * columns) != size)
    throw WireError("sizes that do not fit each other");
}

// nullptr when this client does not know the type.
const SampleDecoder* find_decoder(const std::string& type);

// Of any type: fingerprint 0.
const SampleDecoder* raw_decoder();
RawSample raw_sample(WireReader in);

// The message type that a sample is made from: message_type<Scan>() is "planar_lidar_t".
template <class SampleType>
const char* message_type();

// Of a whole message. Throws TypeMismatch, with the channel.
template <class SampleType>
SampleType decoded(const std::string& channel, const std::vector<uint8_t>& bytes) {
  const SampleDecoder& decoder = *find_decoder(message_type<SampleType>());
  try {
    WireReader in(bytes.data(), bytes.size());
    if (in.int64() == decoder.fingerprint)
      return static_cast<const SampleType&>(*decoder.decode(in));
  } catch (const WireError& error) {
    throw TypeMismatch(channel + ": a message is not a valid " + decoder.type + ": " +
                       error.what());
  }
  throw TypeMismatch(channel + " carries another type than " + decoder.type +
                     ", or another version of it");
}

template <>
inline RawSample decoded<RawSample>(const std::string&, const std::vector<uint8_t>& bytes) {
  return raw_sample(WireReader(bytes.data(), bytes.size()));
}

}  // namespace ruedo::client
