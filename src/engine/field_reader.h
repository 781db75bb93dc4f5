// One field of a message type, read straight from the messages' bytes: numbers in the host's byte
// order, no allocation.
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
  // field: a number, or an array of them ("ranges", "position"). Throws InputError, which lists the
  // fields that can be read, for one that is not there, is text, or lies behind a list of
  // structures.
  FieldReader(const Schema& schema, const std::string& field);

  Primitive type() const { return type_; }
  size_t value_size() const;  // bytes of one value

  // The field's dimensions in this message, which must be well formed; empty: one value.
  std::vector<int64_t> shape(std::span<const uint8_t> message) const;

  // Writes its values into `out`, `count` of them; false, and nothing written, when the message
  // holds another number.
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
