// CDR by hand: alignment, strings, sequences, both byte orders, and malformed bytes.
#include "bridges/ros2/messages/cdr.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace ruedo::ros2 {
namespace {

using testing::ElementsAre;

TEST(Cdr, NumbersAreAlignedFromBehindTheHeader) {
  CdrWriter out;
  out.put(uint8_t{7}).put(1.0).put(uint16_t{0x0102}).put(uint32_t{3});
  EXPECT_THAT(out.bytes(), ElementsAre(0, 1, 0, 0,                                            //
                                       7, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xF0, 0x3F,  //
                                       2, 1, 0, 0, 3, 0, 0, 0));
}

TEST(Cdr, TextsEndWithZeroAndSequencesBeginWithTheirLength) {
  CdrWriter out;
  const float values[] = {0.5f};
  out.put("ab").put_sequence(std::span<const float>(values)).put("");
  EXPECT_THAT(out.bytes(),
              ElementsAre(0, 1, 0, 0,  //
                          3, 0, 0, 0, 'a', 'b', 0, 0, 1, 0, 0, 0, 0, 0, 0, 0x3F, 1, 0, 0, 0, 0));
}

TEST(Cdr, AnEmptySequenceAlignsNothing) {
  CdrWriter out;
  out.put_sequence(std::span<const double>()).put(uint8_t{1});
  EXPECT_THAT(out.bytes(), ElementsAre(0, 1, 0, 0, 0, 0, 0, 0, 1));
}

TEST(Cdr, ReadsBackWrittenValues) {
  CdrWriter out;
  const double values[] = {1.5, -2.5};
  out.put(true).put(int64_t{-5}).put("text").put_sequence(std::span<const double>(values));
  CdrReader in(out.bytes());
  EXPECT_TRUE(in.get<bool>());
  EXPECT_EQ(in.get<int64_t>(), -5);
  EXPECT_EQ(in.get_text(), "text");
  EXPECT_THAT(in.get_sequence<double>(), ElementsAre(1.5, -2.5));
  EXPECT_TRUE(in.good());
}

TEST(Cdr, ReadsBigEndian) {
  const uint8_t bytes[] = {0, 0, 0, 0, 0, 0, 1, 2, 0, 0, 0, 2, 'a', 0};
  CdrReader in(bytes);
  EXPECT_EQ(in.get<uint32_t>(), 0x102u);
  EXPECT_EQ(in.get_text(), "a");
  EXPECT_TRUE(in.good());
}

TEST(Cdr, RefusesOtherEncodings) {
  for (const uint8_t kind : {2, 3, 6, 7, 10, 11}) {  // parameter lists, XCDR2
    const uint8_t bytes[] = {0, kind, 0, 0, 1, 0, 0, 0};
    CdrReader in(bytes);
    EXPECT_EQ(in.get<uint32_t>(), 0u);
    EXPECT_FALSE(in.good()) << int{kind};
  }
}

TEST(Cdr, EveryCutIsSeen) {
  CdrWriter out;
  const double values[] = {1, 2};
  out.put("name").put_sequence(std::span<const double>(values)).put(uint32_t{9});
  for (size_t size = 0; size < out.bytes().size(); ++size) {
    CdrReader in(std::span(out.bytes()).first(size));
    in.get_text();
    in.get_sequence<double>();
    in.get<uint32_t>();
    EXPECT_FALSE(in.good()) << size;
  }
}

TEST(Cdr, ForgedLengthsAllocateNothing) {
  const uint8_t bytes[] = {0, 1, 0, 0, 0xFF, 0xFF, 0xFF, 0xFF, 1, 2, 3, 4};
  CdrReader text(bytes), numbers(bytes), texts(bytes);
  EXPECT_EQ(text.get_text(), "");
  EXPECT_TRUE(numbers.get_sequence<double>().empty());
  EXPECT_TRUE(texts.get_texts().empty());
  EXPECT_FALSE(text.good() || numbers.good() || texts.good());
}

TEST(Cdr, ATextWithoutItsEndIsRefused) {
  const uint8_t bytes[] = {0, 1, 0, 0, 2, 0, 0, 0, 'a', 'b'};
  CdrReader in(bytes);
  EXPECT_EQ(in.get_text(), "");
  EXPECT_FALSE(in.good());
}

}  // namespace
}  // namespace ruedo::ros2
