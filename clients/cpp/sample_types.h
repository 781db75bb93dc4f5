// How each kind of sample comes off the wire.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "ruedo/client.h"
#include "wire_reader.h"

namespace ruedo::client {

// A message type: its name and fingerprint, and how it becomes a sample.
struct SampleDecoder {
  const char* type;
  int64_t fingerprint;
  std::shared_ptr<const Sample> (*decode)(WireReader&);  // throws WireError
};

// nullptr when this client does not know the type.
const SampleDecoder* find_decoder(const std::string& type);

// The message type that a sample is made from: message_type<Scan>() is "planar_lidar_t".
template <class SampleType>
const char* message_type();

}  // namespace ruedo::client
