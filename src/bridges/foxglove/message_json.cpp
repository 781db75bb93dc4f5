// A message is checked as a whole first; then it is walked by its type without a further look at
// lengths.
#include "bridges/foxglove/message_json.h"

#include <cmath>
#include <cstring>
#include <vector>

#include <fmt/format.h>

#include "base/base64.h"
#include "base/big_endian.h"
#include "base/json.h"
#include "base/utf8.h"
#include "base/wire_size.h"

namespace ruedo::foxglove {
namespace {

template <class Number>
std::string number_text(Number value) {
  if (std::isnan(value)) return "null";
  if (std::isinf(value)) return value > 0 ? "1e999" : "-1e999";
  return fmt::format("{}", value);
}

const char* type_of(Primitive primitive) {
  switch (primitive) {
    case Primitive::boolean: return "boolean";
    case Primitive::string: return "string";
    case Primitive::float32:
    case Primitive::float64: return "number";
    default: return "integer";
  }
}

void write_type(const Schema& schema, JsonWriter& json);

void write_type(const Field& field, size_t dimension, JsonWriter& json) {
  if (dimension < field.dimensions.size()) {
    json.open('{');
    if (field.primitive == Primitive::byte && dimension + 1 == field.dimensions.size()) {
      json.member("type", "string").member("contentEncoding", "base64");
    } else {
      json.member("type", "array").name("items");
      write_type(field, dimension + 1, json);
    }
    json.close('}');
  } else if (field.type) {
    write_type(*field.type, json);
  } else {
    json.open('{').member("type", type_of(field.primitive)).close('}');
  }
}

void write_type(const Schema& schema, JsonWriter& json) {
  json.open('{').member("title", schema.name).member("type", "object").name("properties").open('{');
  for (const Field& field : schema.fields) {
    json.name(field.name);
    write_type(field, 0, json);
  }
  json.close('}').close('}');
}

class Walk {
 public:
  explicit Walk(std::span<const uint8_t> bytes) : bytes_(bytes) {}

  void object(const Schema& schema, JsonWriter& json) {
    std::vector<int64_t> counts(
        schema.fields.size());  // of fields that are numbers: those of array lengths are
    json.open('{');
    for (size_t i = 0; i < schema.fields.size(); ++i) {
      const Field& field = schema.fields[i];
      json.name(field.name);
      array(field, 0, counts, json, counts[i]);
    }
    json.close('}');
  }

  void skip(size_t size) { at_ += size; }

 private:
  uint64_t take(size_t size) {
    at_ += size;
    return read_big_endian(&bytes_[at_ - size], size);
  }

  void array(const Field& field, size_t dimension, const std::vector<int64_t>& counts,
             JsonWriter& json, int64_t& integer) {
    if (dimension == field.dimensions.size()) return one(field, json, integer);
    if (dimension == 0 && field.dimensions.size() > 1 && is_empty(field, counts)) {
      json.open('[').close(']');
      return;
    }
    const auto count = static_cast<size_t>(count_of(field.dimensions[dimension], counts));
    if (field.primitive == Primitive::byte && dimension + 1 == field.dimensions.size()) {
      json.value(base64(bytes_.subspan(at_, count)));
      at_ += count;
      return;
    }
    json.open('[');
    for (size_t i = 0; i < count; ++i) array(field, dimension + 1, counts, json, integer);
    json.close(']');
  }

  void one(const Field& field, JsonWriter& json, int64_t& integer) {
    switch (field.primitive) {
      case Primitive::none: object(*field.type, json); return;
      case Primitive::boolean: json.value(take(1) != 0); return;
      case Primitive::byte: json.value(integer = static_cast<int64_t>(take(1))); return;
      case Primitive::int8:
        json.value(integer = static_cast<int8_t>(take(1)));  // NOLINT(bugprone-signed-char-misuse)
        return;
      case Primitive::int16: json.value(integer = static_cast<int16_t>(take(2))); return;
      case Primitive::int32: json.value(integer = static_cast<int32_t>(take(4))); return;
      case Primitive::int64: json.value(integer = static_cast<int64_t>(take(8))); return;
      case Primitive::float32: {
        const auto bits = static_cast<uint32_t>(take(4));
        float value = 0;
        std::memcpy(&value, &bits, sizeof value);
        json.raw(json_number(value));
        return;
      }
      case Primitive::float64: {
        const uint64_t bits = take(8);
        double value = 0;
        std::memcpy(&value, &bits, sizeof value);
        json.raw(json_number(value));
        return;
      }
      case Primitive::string: {
        const size_t size = static_cast<size_t>(take(4));  // with the 0 at its end
        json.value(printable({reinterpret_cast<const char*>(bytes_.data()) + at_, size - 1}));
        at_ += size;
        return;
      }
    }
  }

  std::span<const uint8_t> bytes_;
  size_t at_ = 0;
};

}  // namespace

std::string json_number(double value) { return number_text(value); }
std::string json_number(float value) { return number_text(value); }

std::string json_schema(const Schema& schema) {
  JsonWriter json;
  write_type(schema, json);
  return json.text();
}

std::string json_message(const Schema& schema, std::span<const uint8_t> message) {
  if (!well_formed(schema, message)) return "";
  JsonWriter json;
  Walk walk(message);
  walk.skip(sizeof(int64_t));  // the fingerprint
  walk.object(schema, json);
  return json.text();
}

}  // namespace ruedo::foxglove
