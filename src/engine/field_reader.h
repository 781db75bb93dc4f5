// Reads one field of a message type directly from messages' bytes: numbers in the host's byte
// order, without allocation.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "ruedo/schema.h"

namespace ruedo::engine {

class FieldReader {
 public:
  // field: a number, or an array of numbers ("ranges", "position"). Throws InputError, listing the
  // readable fields, if it does not exist, is text, or comes after a list of structures.
  FieldReader(const Schema& schema, const std::string& field);

  Primitive type() const { return type_; }
  size_t value_size() const;  // bytes per value

  // The field's dimensions in this message, which must be well-formed; empty: a single value.
  std::vector<int64_t> shape(std::span<const uint8_t> message) const;

  // Writes `count` values into `out`; false, without writing, if the message holds another number.
  bool read(std::span<const uint8_t> message, std::byte* out, size_t count) const;

 private:
  struct Place {
    size_t offset, count;
  };
  Place find(std::span<const uint8_t> message) const;
  static int64_t length(const Field& field, const std::vector<int64_t>& counts);

  const Schema* schema_;
  size_t target_ = 0;  // index into the schema's fields
  Primitive type_ = Primitive::none;
};

}  // namespace ruedo::engine
