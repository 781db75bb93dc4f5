// Writes JSON text: what the commands print with --json, and what the console serves.
#pragma once

#include <cmath>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "base/utf8.h"

namespace ruedo {

// Values and names in the order of the calls; commas and quotes are seen to here.
class JsonWriter {
 public:
  JsonWriter& open(char bracket) {  // '{' or '['
    separate();
    text_ += bracket;
    first_ = true;
    return *this;
  }
  JsonWriter& close(char bracket) {
    text_ += bracket;
    first_ = false;
    return *this;
  }
  JsonWriter& name(std::string_view name) {
    separate();
    quote(name);
    text_ += ": ";
    first_ = true;  // its value needs no comma
    return *this;
  }
  JsonWriter& value(std::string_view text) { return separate(), quote(text), *this; }
  JsonWriter& value(const char* text) { return value(std::string_view(text)); }
  JsonWriter& value(bool flag) { return raw(flag ? "true" : "false"); }
  JsonWriter& value(double number) {
    return raw(std::isfinite(number) ? fmt::format("{}", number) : "null");
  }
  JsonWriter& value(int64_t number) { return raw(fmt::format("{}", number)); }
  JsonWriter& value(int number) { return value(int64_t{number}); }
  template <class Value>
  JsonWriter& member(std::string_view key, const Value& of_it) {
    return name(key).value(of_it);
  }
  // A value that is JSON already.
  JsonWriter& raw(std::string_view text) {
    separate();
    text_ += text;
    return *this;
  }
  const std::string& text() const { return text_; }
  void clear() { text_.clear(), first_ = true; }

 private:
  void separate() {
    if (!first_) text_ += ", ";
    first_ = false;
  }
  void quote(std::string_view text) {
    text_ += '"';
    for (const char c : printable(text)) {
      if (c == '"' || c == '\\') {
        text_ += '\\';
        text_ += c;
      } else if (static_cast<unsigned char>(c) < 0x20) {
        text_ += fmt::format("\\u{:04x}", static_cast<int>(c));
      } else {
        text_ += c;
      }
    }
    text_ += '"';
  }

  std::string text_;
  bool first_ = true;
};

}  // namespace ruedo
