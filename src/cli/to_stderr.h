// Text on standard error, formatted as by fmt::print. Where it cannot be written (a full disk, a
// terminal that has gone) it is lost, and nothing else: what is done and its exit code stay.
#pragma once

#include <cstdio>
#include <string>
#include <utility>

#include <fmt/format.h>

namespace ruedo::cli {

// Whether it was written.
template <typename... Values>
bool to_stderr(fmt::format_string<Values...> format, Values&&... values) {
  const std::string text = fmt::format(format, std::forward<Values>(values)...);
  return std::fwrite(text.data(), 1, text.size(), stderr) == text.size() &&
         std::fflush(stderr) == 0;
}

}  // namespace ruedo::cli
