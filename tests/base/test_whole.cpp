// Conversions from floating point to integers at the limits of each type, and the table of
// quantities.
#include "base/whole.h"

#include <algorithm>
#include <fstream>
#include <sstream>

#include <gtest/gtest.h>

#include "ruedo/quantity.h"

namespace ruedo {
namespace {

TEST(Whole, ConvertsNumbersWithinTheTypesRange) {
  EXPECT_EQ(whole(-0x1p63), std::numeric_limits<int64_t>::min());
  EXPECT_EQ(whole(9223372036854774784.0), 9223372036854774784);  // the largest double below 2^63
  EXPECT_EQ(whole<uint64_t>(18446744073709549568.0), 18446744073709549568u);
  EXPECT_EQ(whole<int>(2147483647.9), 2147483647);
  EXPECT_EQ(whole<int>(-2147483648.9), std::numeric_limits<int>::min());
  EXPECT_EQ(whole<uint8_t>(255.5), 255);
  EXPECT_EQ(whole<uint8_t>(-0.5), 0);
  EXPECT_EQ(rounded(2.5), 3);
  EXPECT_EQ(rounded_down(-2.5), -3);
  EXPECT_EQ(rounded_up(2.1), 3);
  EXPECT_EQ(microseconds(0.0000015), 2);
}

TEST(Whole, ThrowsForNumbersOutsideTheTypesRange) {
  const double infinity = std::numeric_limits<double>::infinity(),
               nan = std::numeric_limits<double>::quiet_NaN();
  for (const double value :
       {0x1p63, -9223372036854777856.0, 1e300, -1e300, infinity, -infinity, nan})
    EXPECT_THROW(whole(value), std::out_of_range) << value;
  for (const double value : {2147483648.0, -2147483649.0, nan})
    EXPECT_THROW(whole<int>(value), std::out_of_range) << value;
  for (const double value : {256.0, -1.0, nan})
    EXPECT_THROW(whole<uint8_t>(value), std::out_of_range) << value;
  EXPECT_THROW(whole<uint64_t>(0x1p64), std::out_of_range);
  EXPECT_THROW(microseconds(1e300), std::out_of_range);
}

// 1000, 1e6
std::string shown(double most) {
  const int exponent = static_cast<int>(std::log10(most) + 0.5);
  return exponent < 6 ? std::to_string(static_cast<int>(most)) : "1e" + std::to_string(exponent);
}

TEST(Quantities, EqualTheDocumentation) {
  std::ifstream in(RUEDO_SOURCE_DIR "/docs/limits.md");
  std::vector<std::string> rows;
  for (std::string line; std::getline(in, line);) rows.push_back(line);
  for (const Quantity& q : quantities()) {
    std::ostringstream row;
    row << "| " << q.name << " | " << shown(q.most) << (q.unit.empty() ? "" : " ") << q.unit
        << " | " << q.examples << " |";
    EXPECT_NE(std::find(rows.begin(), rows.end(), row.str()), rows.end()) << row.str();
  }
}

}  // namespace
}  // namespace ruedo
