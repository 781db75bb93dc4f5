// Walks through the bytes of a message by its schema. The bytes are hostile: every length is
// checked against what is there before it is believed.
#include <bit>
#include <charconv>

#include "base/big_endian.h"
#include "base/type_files.h"
#include "base/wire_size.h"
#include "ruedo/schema.h"

namespace ruedo {
namespace {

// The smallest size of a value: of a string its length, which the text follows.
size_t fixed_size(Primitive primitive) {
  return primitive == Primitive::string ? 4 : wire_size(primitive);
}

using Visitor = std::function<bool(const FieldPath&, const FieldValue&)>;

class Walk {
 public:
  Walk(std::span<const uint8_t> bytes, const Visitor* visitor)
      : bytes_(bytes),
        visitor_(visitor),
        fields_left_(kMostTypeFields + kMostFieldsOfByte * bytes.size()) {}

  bool fields(const Schema& schema, int depth) {
    if (depth > kMostTypeDepth) return false;
    std::vector<int64_t> counts(schema.fields.size(), 0);
    for (size_t i = 0; i < schema.fields.size(); ++i) {
      if (fields_left_-- == 0) return false;
      const Field& field = schema.fields[i];
      if (visitor_ != nullptr)
        path_.parts.push_back({&field, std::vector<int64_t>(field.dimensions.size(), 0)});
      if (!has_room(field, counts)) return false;
      if (!is_empty(field, counts) && !elements(field, counts, 0, depth)) return false;
      if (visitor_ != nullptr) path_.parts.pop_back();
      counts[i] = last_integer_;
    }
    return true;
  }

  bool at_end() const { return ended_ || at_ == bytes_.size(); }
  bool skip(size_t size) {
    if (bytes_.size() - at_ < size) return false;
    at_ += size;
    return true;
  }

 private:
  // Whether each of its dimensions, up to one of nothing, is one that the bytes that are left may
  // have.
  bool has_room(const Field& field, const std::vector<int64_t>& counts) const {
    const size_t least = least_size(field);
    const size_t most = least > 0 ? (bytes_.size() - at_) / least : SIZE_MAX;
    for (const Dimension& dimension : field.dimensions) {
      const int64_t count = count_of(dimension, counts);
      if (count < 0 || static_cast<uint64_t>(count) > most) return false;
      if (count == 0) break;
    }
    return true;
  }

  bool elements(const Field& field, const std::vector<int64_t>& counts, size_t dimension,
                int depth) {
    if (dimension == field.dimensions.size()) return value(field, depth);
    const int64_t count = count_of(field.dimensions[dimension], counts);
    const size_t least = least_size(field);
    if (least > 0 && static_cast<uint64_t>(count) > (bytes_.size() - at_) / least) return false;
    // Without a visitor, numbers need no look at each.
    if (visitor_ == nullptr && dimension + 1 == field.dimensions.size() &&
        field.primitive != Primitive::none && field.primitive != Primitive::string) {
      return skip(static_cast<size_t>(count) * fixed_size(field.primitive));
    }
    for (int64_t i = 0; i < count && !ended_; ++i) {
      if (visitor_ != nullptr) path_.parts.back().indices[dimension] = i;
      if (!elements(field, counts, dimension + 1, depth)) return false;
    }
    return true;
  }

  bool value(const Field& field, int depth) {
    if (ended_) return true;
    if (field.primitive == Primitive::none)
      return field.type != nullptr && fields(*field.type, depth + 1);
    const size_t size = fixed_size(field.primitive);
    if (bytes_.size() - at_ < size) return false;
    const uint64_t raw = read_big_endian(bytes_.data() + at_, size);
    at_ += size;
    switch (field.primitive) {
      case Primitive::boolean: return give(raw != 0);
      case Primitive::byte: return give(static_cast<int64_t>(raw));
      case Primitive::int8: return give(int64_t{static_cast<int8_t>(raw)});
      case Primitive::int16: return give(int64_t{static_cast<int16_t>(raw)});
      case Primitive::int32: return give(int64_t{static_cast<int32_t>(raw)});
      case Primitive::int64: return give(static_cast<int64_t>(raw));
      case Primitive::float32:
        return give(double{std::bit_cast<float>(static_cast<uint32_t>(raw))});
      case Primitive::float64: return give(std::bit_cast<double>(raw));
      case Primitive::string: return text(static_cast<int32_t>(raw));
      case Primitive::none: break;
    }
    return false;
  }

  bool text(int32_t length_with_zero) {
    if (length_with_zero < 1) return false;
    const auto length = static_cast<size_t>(length_with_zero);
    if (bytes_.size() - at_ < length || bytes_[at_ + length - 1] != 0) return false;
    const std::string_view text(reinterpret_cast<const char*>(bytes_.data()) + at_, length - 1);
    if (text.find('\0') != text.npos) return false;  // a text ends there when it is encoded again
    at_ += length;
    return give(text);
  }

  template <class T>
  bool give(T value) {
    if constexpr (std::is_same_v<T, int64_t>) last_integer_ = value;
    if (visitor_ != nullptr) ended_ = !(*visitor_)(path_, FieldValue(value));
    return true;
  }

  std::span<const uint8_t> bytes_;
  const Visitor* visitor_;
  size_t at_ = 0;
  size_t fields_left_;
  int64_t last_integer_ = 0;
  bool ended_ = false;
  FieldPath path_;
};

bool walk(const Schema& schema, std::span<const uint8_t> message, const Visitor* visitor) {
  if (message.size() < 8 || fingerprint_of(message) != schema.fingerprint) return false;
  Walk walk(message, visitor);
  return walk.skip(8) && walk.fields(schema, 0) && walk.at_end();
}

template <class Number>
std::string number_text(Number value) {
  char buffer[40];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, value).ptr;
  return {buffer, end};
}

}  // namespace

int64_t fingerprint_of(std::span<const uint8_t> message) {
  return message.size() < 8 ? 0 : read_big_endian<int64_t>(message.data());
}

bool visit_message(const Schema& schema, std::span<const uint8_t> message, const Visitor& visitor) {
  return walk(schema, message, &visitor);
}

bool well_formed(const Schema& schema, std::span<const uint8_t> message) {
  return walk(schema, message, nullptr);
}

std::string FieldPath::str() const {
  std::string text;
  for (const Part& part : parts) {
    if (!text.empty()) text += '.';
    text += part.field->name;
    for (const int64_t index : part.indices) text += '[' + std::to_string(index) + ']';
  }
  return text;
}

std::string FieldPath::pattern() const {
  std::string text;
  for (const Part& part : parts) {
    if (!text.empty()) text += '.';
    text += part.field->name;
  }
  return text;
}

std::string to_string(const FieldValue& value) {
  return std::visit(
      [](const auto& v) -> std::string {
        using T = std::decay_t<decltype(v)>;
        if constexpr (std::is_same_v<T, bool>)
          return v ? "true" : "false";
        else if constexpr (std::is_same_v<T, std::string_view>)
          return '"' + std::string(v) + '"';
        else
          return number_text(v);
      },
      value);
}

}  // namespace ruedo
