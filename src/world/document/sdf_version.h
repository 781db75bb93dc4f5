// Versions of SDF: parsing, comparison, and which of them Ruedo supports.
#pragma once

#include <compare>
#include <optional>
#include <string>

namespace ruedo::world {

struct SdfVersion {
  int major = 1;
  int minor = 9;
  auto operator<=>(const SdfVersion&) const = default;

  // "1.9": exactly two whole numbers.
  static std::optional<SdfVersion> parse(const std::string& text) {
    const size_t dot = text.find('.');
    if (dot == std::string::npos) return std::nullopt;
    const auto number = [](const std::string& digits) -> int {
      if (digits.empty() || digits.size() > 4 ||
          digits.find_first_not_of("0123456789") != std::string::npos)
        return -1;
      return std::stoi(digits);
    };
    const SdfVersion version{number(text.substr(0, dot)), number(text.substr(dot + 1))};
    if (version.major < 0 || version.minor < 0) return std::nullopt;
    return version;
  }
};

}  // namespace ruedo::world
