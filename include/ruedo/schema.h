// The message types as data: what proto/*.lcm says, embedded in the program. It lets any message be
// checked, compared and printed by its fields' names without a line of code for its type.
//
// Everything here is const after the first use and safe from many threads.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "ruedo/index.h"

namespace ruedo {

enum class Primitive : uint8_t {
  none,
  boolean,
  byte,
  int8,
  int16,
  int32,
  int64,
  float32,
  float64,
  string
};

struct Schema;
using FieldIndex = Index<struct FieldKind>;  // into Schema::fields

// A dimension of an array: a fixed size, or the integer field before it that counts the elements.
struct Dimension {
  int64_t size = 0;
  FieldIndex counted_by;  // none: fixed
};

struct Field {
  std::string name;
  Primitive primitive = Primitive::none;  // none: another type
  const Schema* type = nullptr;           // of a field that is a struct
  std::vector<Dimension> dimensions;      // empty: one value
};

struct Schema {
  std::string name;         // "planar_lidar_t"
  int64_t fingerprint = 0;  // LCM's hash of the type, the first eight bytes of a message
  IndexedVector<FieldIndex, Field> fields;
  size_t least_bytes = 0;  // that its values take on the wire
};

// The type of that name, or with that fingerprint; null when Ruedo has none.
const Schema* find_schema(std::string_view name);
const Schema* find_schema(int64_t fingerprint);
// All types, by name.
std::span<const Schema> schemas();

// The fingerprint that a message starts with; 0 for one of less than eight bytes.
int64_t fingerprint_of(std::span<const uint8_t> message);

// A value in a message. Text and bytes point into the message.
using FieldValue = std::variant<bool, int64_t, double, std::string_view>;

// Where a value is: the fields and indices that lead to it.
struct FieldPath {
  struct Part {
    const Field* field;
    std::vector<int64_t> indices;
  };
  std::vector<Part> parts;

  std::string str() const;      // "points[2].position[0]"
  std::string pattern() const;  // without the indices: "points.position"
};

// Visits every value of a message in its order; the visitor returns false to end early. Returns
// false when the message's bytes are not one whole message of that type: a wrong fingerprint, a
// length that is negative or reaches beyond the end, an unterminated string, bytes left over. Never
// reads outside of the bytes, whatever they are.
bool visit_message(const Schema& schema, std::span<const uint8_t> message,
                   const std::function<bool(const FieldPath&, const FieldValue&)>& visitor);

// Whether the bytes are one whole message of that type.
bool well_formed(const Schema& schema, std::span<const uint8_t> message);

// A value as text that reads back to the same value.
std::string to_string(const FieldValue& value);

}  // namespace ruedo
