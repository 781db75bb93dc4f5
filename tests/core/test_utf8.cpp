// Texts that contain bytes that are not UTF-8.
#include "core/utf8.h"

#include <gtest/gtest.h>

namespace ruedo {
namespace {

TEST(Utf8, WhatIsNotUtf8BecomesAQuestionMark) {
  EXPECT_EQ(printable("a\u00e9\u20ac\U0001f916z"), "a\u00e9\u20ac\U0001f916z");
  EXPECT_EQ(printable("a\xe9z"), "a?z");             // Latin 1
  EXPECT_EQ(printable("\xc0\xaf"), "??");            // longer than it needs to be
  EXPECT_EQ(printable("\xed\xa0\x80"), "???");       // half of a UTF-16 pair
  EXPECT_EQ(printable("\xf4\x90\x80\x80"), "????");  // beyond U+10FFFF
  EXPECT_EQ(printable("\xe2\x82"), "??");            // cut off
  EXPECT_EQ(printable(std::string_view("a\0\x1b", 3)), std::string_view("a\0\x1b", 3));
}

TEST(Utf8, TerminalsGetNoControlCharacters) {
  EXPECT_EQ(for_terminal("two\n\tlines \u00e9"), "two\n\tlines \u00e9");
  EXPECT_EQ(for_terminal(std::string_view("\0\r\x1b[31m\x7f", 8)), "???[31m?");
  EXPECT_EQ(for_terminal("\u009b31m\u00a0"), "?31m\u00a0");
}

TEST(Utf8, ANameIsOneLine) {
  for (const char* good : {"", "p3at", "two words", "\u00e9"})
    EXPECT_TRUE(is_one_line(good)) << good;
  for (const char* bad : {"a\nb", "a\tb", "a\rb", "\x1b[m", "\x7f", "\u009b", "\xe9"})
    EXPECT_FALSE(is_one_line(bad)) << bad;
}

}  // namespace
}  // namespace ruedo
