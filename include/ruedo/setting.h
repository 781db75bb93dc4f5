/// @file
// The value of a setting of a world. ruedo/client.h and ruedo/engine.h include it.
#pragma once

#include <charconv>
#include <string>
#include <type_traits>
#include <utility>

namespace ruedo {

/// The value of a setting: a number, true or false, or a text, as `ruedo run --set` takes it.
class Setting {
 public:
  /// @tparam Number bool, or any type of numbers
  /// @param value of that type
  template <class Number, class = std::enable_if_t<std::is_arithmetic_v<Number>>>
  Setting(Number value) {  // NOLINT: converts on purpose, as the next two do
    if constexpr (std::is_same_v<Number, bool>) {
      text_ = value ? "true" : "false";
    } else {
      char text[64];
      text_.assign(text, std::to_chars(text, text + sizeof text, value).ptr);
    }
  }
  /// @param text as written
  Setting(const char* text) : text_(text) {}  // NOLINT
  /// @param text as written
  Setting(std::string text) : text_(std::move(text)) {}            // NOLINT
  [[nodiscard]] const std::string& text() const { return text_; }  ///< @return as written

 private:
  std::string text_;
};

}  // namespace ruedo
