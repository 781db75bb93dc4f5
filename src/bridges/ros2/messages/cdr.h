// CDR as ROS 2 uses it: plain XCDR1, little endian, with a header of four bytes, each number
// aligned to its own size relative to the end of the header. Reading checks every length against
// the available bytes, and never allocates more than they hold.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace ruedo::ros2 {

static_assert(std::endian::native == std::endian::little, "CDR is written as it lies in memory");

inline constexpr size_t kCdrHeader = 4;

class CdrWriter {
 public:
  CdrWriter() { clear(); }

  // Starts a message; keeps the allocated memory.
  void clear() { bytes_ = {0, 1, 0, 0}; }

  template <class Number>
    requires std::is_arithmetic_v<Number>
  CdrWriter& put(Number value) {
    align(sizeof value);
    append(&value, sizeof value);
    return *this;
  }
  CdrWriter& put(std::string_view text) {
    put(static_cast<uint32_t>(text.size() + 1));
    append(text.data(), text.size());
    bytes_.push_back(0);
    return *this;
  }
  CdrWriter& put(const std::string& text) { return put(std::string_view(text)); }
  CdrWriter& put(const char* text) { return put(std::string_view(text)); }

  // Numbers in sequence, as in an array; a sequence has its length in front.
  template <class Number>
  CdrWriter& put_array(std::span<const Number> values) {
    if (values.empty()) return *this;
    align(sizeof(Number));
    append(values.data(), values.size_bytes());
    return *this;
  }
  template <class Number>
  CdrWriter& put_sequence(std::span<const Number> values) {
    return put_length(values.size()).put_array(values);
  }
  CdrWriter& put_length(size_t size) { return put(static_cast<uint32_t>(size)); }

  const std::vector<uint8_t>& bytes() const { return bytes_; }

 private:
  void align(size_t size) {
    bytes_.resize((bytes_.size() - kCdrHeader + size - 1) / size * size + kCdrHeader);
  }
  void append(const void* data, size_t size) {
    const auto* from = static_cast<const uint8_t*>(data);
    bytes_.insert(bytes_.end(), from, from + size);
  }

  std::vector<uint8_t> bytes_;
};

// Reads what a peer sent. After an error every value is 0 and good() is false.
class CdrReader {
 public:
  explicit CdrReader(std::span<const uint8_t> bytes) : bytes_(bytes) {
    // Plain CDR in either byte order; ROS does not use parameter lists and XCDR2.
    good_ = bytes.size() >= kCdrHeader && bytes[0] == 0 && bytes[1] <= 1;
    swap_ = good_ && bytes[1] == 0;
  }

  template <class Number>
    requires std::is_arithmetic_v<Number>
  Number get() {
    Number value{};
    const size_t at = (offset_ + sizeof value - 1) / sizeof value * sizeof value;
    if (!good_ || !fits(at, sizeof value)) return fail<Number>();
    uint8_t raw[sizeof value];
    std::memcpy(raw, bytes_.data() + kCdrHeader + at, sizeof value);
    if (swap_) {
      for (size_t i = 0; i < sizeof value / 2; ++i) std::swap(raw[i], raw[sizeof value - 1 - i]);
    }
    if constexpr (std::is_same_v<Number, bool>) {
      value = raw[0] != 0;
    } else {
      std::memcpy(&value, raw, sizeof value);
    }
    offset_ = at + sizeof value;
    return value;
  }

  std::string get_text() {
    const auto size = get<uint32_t>();
    if (!good_ || !fits(offset_, size)) return fail<std::string>();
    const char* begin = reinterpret_cast<const char*>(bytes_.data()) + kCdrHeader + offset_;
    offset_ += size;
    if (size == 0) return {};  // not allowed, but some write an empty string like this
    if (begin[size - 1] != 0) return fail<std::string>();
    return std::string(begin, size - 1);
  }

  // The length of a sequence whose elements take at least `element_size` bytes each.
  size_t get_length(size_t element_size) {
    const auto size = get<uint32_t>();
    if (!good_ || size > (bytes_.size() - kCdrHeader - offset_) / element_size)
      return fail<size_t>();
    return size;
  }

  template <class Number>
  std::vector<Number> get_sequence() {
    std::vector<Number> values(get_length(sizeof(Number)));
    for (Number& value : values) value = get<Number>();
    return good_ ? values : std::vector<Number>();
  }
  std::vector<std::string> get_texts() {
    std::vector<std::string> texts(get_length(sizeof(uint32_t)));
    for (std::string& text : texts) text = get_text();
    return good_ ? texts : std::vector<std::string>();
  }
  template <class Number>
  void skip(size_t count) {
    for (size_t i = 0; i < count && good_; ++i) get<Number>();
  }

  // Whether all values read lay within the bytes.
  bool good() const { return good_; }

 private:
  bool fits(size_t at, size_t size) const {
    const size_t room = bytes_.size() - kCdrHeader;
    return at <= room && size <= room - at;
  }
  template <class Value>
  Value fail() {
    good_ = false;
    return Value{};
  }

  std::span<const uint8_t> bytes_;
  size_t offset_ = 0;  // after the header
  bool good_ = false, swap_ = false;
};

}  // namespace ruedo::ros2
