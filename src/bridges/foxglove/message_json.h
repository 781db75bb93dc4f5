// Any message as JSON, and its type as a JSON Schema, from the message types' description.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "ruedo/schema.h"

namespace ruedo::foxglove {

// A number as JSON that reads back to the same; of those that JSON has not, infinity as 1e999 (what
// reads beyond the largest number is infinite) and NaN as null.
std::string json_number(double value);
std::string json_number(float value);

// {"title": "planar_lidar_t", "type": "object", "properties": {...}}
std::string json_schema(const Schema& schema);

// An object with the fields' names. "" when the bytes are not one whole message of that type.
std::string json_message(const Schema& schema, std::span<const uint8_t> message);

}  // namespace ruedo::foxglove
