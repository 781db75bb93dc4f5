// Small things that readers and writers of text share.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace ruedo {

// Without the blanks, tabs and line ends at both ends.
std::string_view trimmed(std::string_view text);

// The shortest text that reads back to the same number; whole numbers without an exponent: 0.5, not
// 0.500000; 1000000000, not 1e+09.
std::string shown(double value);

// RFC 4648's base64, padded, without line ends.
std::string base64(std::span<const uint8_t> bytes);

}  // namespace ruedo
