// The one way from a floating-point number to a whole one. A bare cast of what does not fit is
// undefined: it gives the most negative number, and a loop that counts up from there never ends.
// tests/walls.py finds casts that go round this file.
#pragma once

#include <cmath>
#include <concepts>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>

namespace ruedo {

// The whole part of a number. Throws std::out_of_range for what the type cannot hold, NaN included.
template <std::integral Whole = int64_t>
Whole whole(double value) {
  // The bounds are powers of two, or 0, which a double holds exactly.
  constexpr double kBegin = static_cast<double>(std::numeric_limits<Whole>::min());
  constexpr Whole kHalf = std::numeric_limits<Whole>::max() / 2 + 1;
  constexpr double kEnd = 2.0 * static_cast<double>(kHalf);
  if (!(value > kBegin - 1.0 || value == kBegin) || !(value < kEnd)) {
    throw std::out_of_range(std::to_string(value) +
                            " is not a whole number that can be counted with");
  }
  return static_cast<Whole>(value);
}

// The nearest whole number, the one below, the one above.
template <std::integral Whole = int64_t>
Whole rounded(double value) {
  return whole<Whole>(std::round(value));
}
template <std::integral Whole = int64_t>
Whole rounded_down(double value) {
  return whole<Whole>(std::floor(value));
}
template <std::integral Whole = int64_t>
Whole rounded_up(double value) {
  return whole<Whole>(std::ceil(value));
}

// Seconds as whole microseconds, the nearest.
inline int64_t microseconds(double seconds) { return rounded(seconds * 1e6); }

}  // namespace ruedo
