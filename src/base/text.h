// Small things that readers and writers of text share.
#pragma once

#include <string>
#include <string_view>

namespace ruedo {

// Without the blanks, tabs and line ends at both ends.
std::string_view trimmed(std::string_view text);

// The shortest text that reads back to the same number; whole numbers without an exponent: 0.5, not
// 0.500000; 1000000000, not 1e+09.
std::string shown(double value);

}  // namespace ruedo
