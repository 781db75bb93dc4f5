// Numbers as they are on the wire, beside the C library's own conversions.
#include "base/big_endian.h"

#include <cstring>

#include <endian.h>

#include <gtest/gtest.h>

namespace ruedo {
namespace {

TEST(BigEndian, EqualsTheCLibrary) {
  for (const uint64_t value : {uint64_t{0}, uint64_t{1}, uint64_t{0x0123456789abcdef},
                               uint64_t{0xfedcba9876543210}, UINT64_MAX}) {
    const uint64_t of_libc = htobe64(value);
    uint8_t expected[8];
    std::memcpy(expected, &of_libc, sizeof expected);
    std::vector<uint8_t> appended = {7};
    append_big_endian(appended, value);
    ASSERT_EQ(appended.size(), 9u);
    EXPECT_EQ(std::memcmp(&appended[1], expected, 8), 0) << value;
    EXPECT_EQ(read_big_endian<uint64_t>(expected), value);
    EXPECT_EQ(read_big_endian<int64_t>(expected), static_cast<int64_t>(value));
    EXPECT_EQ(read_big_endian<uint32_t>(expected), value >> 32);
    EXPECT_EQ(read_big_endian<int16_t>(expected), static_cast<int16_t>(value >> 48));
    EXPECT_EQ(read_big_endian(expected, 3), value >> 40);
  }
}

TEST(BigEndian, WritesAsManyBytesAsTheTypeHas) {
  uint8_t bytes[4] = {9, 9, 9, 9};
  write_big_endian(bytes + 1, int16_t{-2});
  EXPECT_EQ(bytes[0], 9);
  EXPECT_EQ(bytes[1], 0xff);
  EXPECT_EQ(bytes[2], 0xfe);
  EXPECT_EQ(bytes[3], 9);
}

}  // namespace
}  // namespace ruedo
