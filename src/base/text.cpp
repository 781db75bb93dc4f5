#include "base/text.h"

#include <charconv>
#include <cmath>

#include "base/whole.h"

namespace ruedo {

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kSpace = " \t\r\n\f\v";
  const size_t begin = text.find_first_not_of(kSpace);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kSpace) - begin + 1);
}

std::string shown(double value) {
  if (value == std::floor(value) && std::abs(value) < 1e15) return std::to_string(whole(value));
  char buffer[32];
  const auto result = std::to_chars(buffer, buffer + sizeof buffer, value);
  return {buffer, result.ptr};
}

}  // namespace ruedo
