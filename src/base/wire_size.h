// How many bytes a value of a primitive type takes in an encoded message.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "ruedo/schema.h"

namespace ruedo {

// 0: not always the same number (a string), or no primitive.
constexpr size_t wire_size(Primitive primitive) {
  switch (primitive) {
    case Primitive::boolean:
    case Primitive::byte:
    case Primitive::int8: return 1;
    case Primitive::int16: return 2;
    case Primitive::int32:
    case Primitive::float32: return 4;
    case Primitive::int64:
    case Primitive::float64: return 8;
    case Primitive::none:
    case Primitive::string: break;
  }
  return 0;
}

// The fewest bytes that one value of a field takes; bounds the count of elements of hostile arrays.
inline size_t least_size(const Field& field) {
  if (field.primitive == Primitive::string) return 5;  // its length, and the zero at its end
  if (field.primitive != Primitive::none) return wire_size(field.primitive);
  return field.type == nullptr ? 0 : field.type->least_bytes;
}

// counts: the values of the fields before it that are numbers.
inline int64_t count_of(const Dimension& dimension, const std::vector<int64_t>& counts) {
  return dimension.counted_by.valid() ? counts[dimension.counted_by] : dimension.size;
}

// Whether an array holds nothing, however many rows of nothing there are.
inline bool is_empty(const Field& field, const std::vector<int64_t>& counts) {
  return std::any_of(field.dimensions.begin(), field.dimensions.end(),
                     [&](const Dimension& dimension) { return count_of(dimension, counts) == 0; });
}

}  // namespace ruedo
