// LCM's encoding: fields in sequence, big endian, arrays without a length of their own.
#include "engine/field_reader.h"

#include <algorithm>
#include <cstring>

#include "base/wire_size.h"
#include "ruedo/errors.h"

namespace ruedo::engine {
namespace {

bool is_integer(Primitive type) {
  return type == Primitive::int8 || type == Primitive::int16 || type == Primitive::int32 ||
         type == Primitive::int64;
}

template <class Word>
Word swapped(Word word) {
  if constexpr (sizeof(Word) == 8) return __builtin_bswap64(word);
  if constexpr (sizeof(Word) == 4) return __builtin_bswap32(word);
  return __builtin_bswap16(word);
}

template <class Word>
void copy_swapped(const uint8_t* from, std::byte* to, size_t count) {
  for (size_t i = 0; i < count; ++i) {
    Word word;
    std::memcpy(&word, from + i * sizeof word, sizeof word);
    word = swapped(word);
    std::memcpy(to + i * sizeof word, &word, sizeof word);
  }
}

// Values of the length fields of the message being read; on the stack, since messages are read in
// many threads at once.
std::vector<int64_t>& counts_of_thread() {
  thread_local std::vector<int64_t> counts;
  return counts;
}

int64_t read_integer(const uint8_t* at, Primitive type) {
  int64_t value = static_cast<int8_t>(at[0]);  // keeps the sign
  for (size_t i = 1; i < wire_size(type); ++i) value = value * 256 + at[i];
  return value;
}

}  // namespace

FieldReader::FieldReader(const Schema& schema, const std::string& field) : schema_(&schema) {
  std::string readable;
  for (size_t i = 0; i < schema.fields.size(); ++i) {
    const Field& one = schema.fields[i];
    if (one.primitive == Primitive::none) break;  // the offset of what follows cannot be computed
    if (one.primitive == Primitive::string) continue;
    readable += (readable.empty() ? "" : ", ") + one.name;
    if (one.name != field) continue;
    target_ = i;
    type_ = one.primitive;
  }
  if (type_ == Primitive::none)
    throw InputError({}, "'" + field + "' is not a field of numbers in " + schema.name +
                             "; there are " + readable);
}

size_t FieldReader::value_size() const { return wire_size(type_); }

int64_t FieldReader::length(const Field& field, const std::vector<int64_t>& counts) {
  int64_t length = 1;
  for (const Dimension& dimension : field.dimensions) {
    length *= dimension.counted_by.valid() ? counts[dimension.counted_by] : dimension.size;
  }
  return length;
}

FieldReader::Place FieldReader::find(std::span<const uint8_t> message) const {
  std::vector<int64_t>& counts = counts_of_thread();
  counts.assign(schema_->fields.size(), 0);
  size_t offset = sizeof(int64_t);  // after the fingerprint
  for (size_t i = 0; i < target_; ++i) {
    const Field& field = schema_->fields[i];
    if (field.primitive == Primitive::string) {
      for (int64_t text = length(field, counts); text > 0; --text)
        offset += sizeof(int32_t) +
                  static_cast<size_t>(read_integer(message.data() + offset, Primitive::int32));
      continue;
    }
    if (field.dimensions.empty() && is_integer(field.primitive))
      counts[i] = read_integer(message.data() + offset, field.primitive);
    offset += static_cast<size_t>(length(field, counts)) * wire_size(field.primitive);
  }
  return {offset, static_cast<size_t>(length(schema_->fields[target_], counts))};
}

std::vector<int64_t> FieldReader::shape(std::span<const uint8_t> message) const {
  find(message);
  const std::vector<int64_t>& counts = counts_of_thread();
  std::vector<int64_t> shape;
  for (const Dimension& dimension : schema_->fields[target_].dimensions) {
    shape.push_back(dimension.counted_by.valid() ? counts[dimension.counted_by] : dimension.size);
  }
  return shape;
}

bool FieldReader::read(std::span<const uint8_t> message, std::byte* out, size_t count) const {
  const Place place = find(message);
  if (place.count != count) return false;
  const uint8_t* from = message.data() + place.offset;
  switch (value_size()) {
    case 8: copy_swapped<uint64_t>(from, out, count); break;
    case 4: copy_swapped<uint32_t>(from, out, count); break;
    case 2: copy_swapped<uint16_t>(from, out, count); break;
    default: std::memcpy(out, from, count); break;
  }
  return true;
}

}  // namespace ruedo::engine
