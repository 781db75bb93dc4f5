// Reads an LCM message field by field, and never beyond its end: a length that promises more is
// refused.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/big_endian.h"
#include "base/utf8.h"

namespace ruedo::client {

// The bytes are not what their type says.
struct WireError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

class WireReader {
 public:
  WireReader(const uint8_t* bytes, size_t size) : begin_(bytes), at_(bytes), end_(bytes + size) {}

  // The whole message, whatever was read of it.
  std::vector<uint8_t> whole() const { return {begin_, end_}; }

  int8_t int8() { return static_cast<int8_t>(take(1)[0]); }
  bool boolean() { return int8() != 0; }
  int16_t int16() { return read_big_endian<int16_t>(take(2)); }
  int32_t int32() { return read_big_endian<int32_t>(take(4)); }
  int64_t int64() { return read_big_endian<int64_t>(take(8)); }
  float float32() { return std::bit_cast<float>(read_big_endian<uint32_t>(take(4))); }
  double float64() { return std::bit_cast<double>(read_big_endian<uint64_t>(take(8))); }

  std::string string() {
    const size_t length = count(1);  // with its closing zero
    if (length == 0) throw WireError("a string without an end");
    const uint8_t* bytes = take(length);
    return {reinterpret_cast<const char*>(bytes), length - 1};
  }

  // Text to print: a terminal obeys control characters, so a name has none, and in a longer text
  // '?' replaces each but line ends and tabs.
  std::string name() {
    std::string text = string();
    if (!is_one_line(text)) throw WireError("a name with control characters");
    return text;
  }
  std::string text() { return for_terminal(string()); }

  // An int32_t that counts elements of at least `element_size` bytes each, which must still fit.
  size_t count(size_t element_size) { return fits(int32(), element_size); }
  size_t fits(int64_t n, size_t element_size) const {
    if (n < 0 || static_cast<uint64_t>(n) > static_cast<size_t>(end_ - at_) / element_size) {
      throw WireError("a length of " + std::to_string(n) + " with " + std::to_string(end_ - at_) +
                      " bytes left");
    }
    return static_cast<size_t>(n);
  }

  std::vector<float> floats(size_t n) {
    return many<float>(n, 4, [this] { return float32(); });
  }
  std::vector<double> doubles(size_t n) {
    return many<double>(n, 8, [this] { return float64(); });
  }
  std::vector<int64_t> int64s(size_t n) {
    return many<int64_t>(n, 8, [this] { return int64(); });
  }
  std::vector<std::string> strings(size_t n) {
    return many<std::string>(n, 5, [this] { return string(); });
  }
  std::vector<bool> booleans(size_t n) {
    return many<bool>(n, 1, [this] { return boolean(); });
  }
  std::vector<uint8_t> bytes(size_t n) {
    const uint8_t* from = take(n);
    return {from, from + n};
  }
  template <size_t n>
  std::array<double, n> array() {
    std::array<double, n> values;
    for (double& value : values) value = float64();
    return values;
  }

 private:
  template <class Value, class Read>
  std::vector<Value> many(size_t n, size_t element_size, Read read) {
    fits(static_cast<int64_t>(n), element_size);
    std::vector<Value> values(n);
    for (size_t i = 0; i < n; ++i) values[i] = read();
    return values;
  }
  const uint8_t* take(size_t n) {
    if (n > static_cast<size_t>(end_ - at_)) throw WireError("it is too short");
    at_ += n;
    return at_ - n;
  }

  const uint8_t* const begin_;
  const uint8_t* at_;
  const uint8_t* end_;
};

}  // namespace ruedo::client
