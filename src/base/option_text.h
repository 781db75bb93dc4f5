// Options as users write them, read strictly: a wrong one says what it should look like.
#pragma once

#include <charconv>
#include <cmath>
#include <string>
#include <string_view>

#include "ruedo/errors.h"

namespace ruedo {

// option: its name; allowed: what it should look like.
[[noreturn]] inline void refuse_option(const std::string& option, const std::string& text,
                                       const std::string& allowed) {
  throw InputError({}, option + " '" + text + "': " + allowed);
}

// Whether this is an option instead of a file, as the source of its setting: "--set
// p3at/lrf.update_rate".
inline bool is_option(const Source& source) { return source.file.starts_with("--"); }

// False unless the text is one finite number, and nothing else.
inline bool read_number(std::string_view text, double& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() && std::isfinite(value);
}

}  // namespace ruedo
