// Arrays of any of LCM's types, for the readers that are made from proto/vocabulary.toml.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <type_traits>
#include <vector>

#include "samples/wire_reader.h"

namespace ruedo::client {

template <class Value>
Value read_value(WireReader& in) {
  if constexpr (std::is_same_v<Value, bool>) return in.boolean();
  if constexpr (std::is_same_v<Value, int8_t>) return in.int8();
  if constexpr (std::is_same_v<Value, uint8_t>) return static_cast<uint8_t>(in.int8());
  if constexpr (std::is_same_v<Value, int16_t>) return in.int16();
  if constexpr (std::is_same_v<Value, int32_t>) return in.int32();
  if constexpr (std::is_same_v<Value, int64_t>) return in.int64();
  if constexpr (std::is_same_v<Value, float>) return in.float32();
  if constexpr (std::is_same_v<Value, double>) return in.float64();
  if constexpr (std::is_same_v<Value, std::string>) return in.string();
}

// Of a number that was held against what is left.
template <class Value>
std::vector<Value> read_values(WireReader& in, size_t n) {
  if constexpr (std::is_same_v<Value, uint8_t>) return in.bytes(n);  // pictures are large
  std::vector<Value> values(n);
  for (size_t i = 0; i < n; ++i) values[i] = read_value<Value>(in);
  return values;
}

template <class Value, size_t n>
std::array<Value, n> read_array(WireReader& in) {
  std::array<Value, n> values;
  for (Value& value : values) value = read_value<Value>(in);
  return values;
}

}  // namespace ruedo::client
