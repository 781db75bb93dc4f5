// Text on standard error, formatted as by fmt::print. Where it cannot be written (a full disk, a
// terminal that has gone) it is lost, and nothing else: what is done and its exit code stay.
//
// A std::string may hold the words of others, from a file or the bus: it is printed as one line
// that no terminal obeys. A `const char*` is a text of ours, such as a colour, and printed as it
// is.
#pragma once

#include <cstdio>
#include <string>
#include <string_view>
#include <type_traits>

#include <fmt/format.h>

#include "base/utf8.h"

namespace ruedo {

// As one line, whatever it holds.
inline std::string one_line(std::string_view text) { return in_one_line(for_terminal(text)); }

template <typename Value>
decltype(auto) safe(const Value& value) {
  if constexpr (std::is_same_v<Value, std::string> || std::is_same_v<Value, std::string_view>)
    return one_line(value);
  else
    return (value);
}

// Whether it was written.
template <typename... Values>
bool to_stderr(fmt::format_string<const Values&...> format, const Values&... values) {
  const std::string text = fmt::format(fmt::runtime(format), safe(values)...);
  return std::fwrite(text.data(), 1, text.size(), stderr) == text.size() &&
         std::fflush(stderr) == 0;
}

}  // namespace ruedo
