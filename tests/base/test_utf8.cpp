// Texts that contain bytes that are not UTF-8.
#include "base/utf8.h"

#include <gtest/gtest.h>

namespace ruedo {
namespace {

TEST(Utf8, InvalidBytesBecomeQuestionMarks) {
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

// Unicode's marks of right-to-left text and its line ends, each with the codes beside it, which are
// none.
TEST(Utf8, TerminalsGetNoMarksThatReorderText) {
  for (const char* obeyed :
       {"\u061c", "\u200e", "\u200f", "\u2028", "\u2029", "\u202a", "\u202b", "\u202c", "\u202d",
        "\u202e", "\u2066", "\u2067", "\u2068", "\u2069"}) {
    EXPECT_EQ(for_terminal(std::string("a") + obeyed + "b"), "a?b");
    EXPECT_FALSE(is_one_line(std::string("a") + obeyed + "b"));
  }
  for (const char* shown : {"\u061b", "\u061d", "\u200d", "\u2010", "\u2027", "\u202f", "\u2065",
                            "\u206a", "\u05d0\u0627", "\U0001f916"})
    EXPECT_EQ(for_terminal(shown), shown);
}

TEST(Utf8, ShortensLongTextsBetweenCharacters) {
  EXPECT_EQ(shortened("abc", 3), "abc");
  EXPECT_EQ(shortened("abcd", 3), "abc...");
  EXPECT_EQ(shortened("a\u20acb", 4), "a\u20ac...");
  EXPECT_EQ(shortened("a\u20acb", 3), "a...");
  EXPECT_EQ(shortened("\xbf\xbf", 1), "...");  // no UTF-8
}

TEST(Utf8, ANameIsOneLine) {
  for (const char* good : {"", "p3at", "two words", "\u00e9"})
    EXPECT_TRUE(is_one_line(good)) << good;
  for (const char* bad : {"a\nb", "a\tb", "a\rb", "\x1b[m", "\x7f", "\u009b", "\xe9"})
    EXPECT_FALSE(is_one_line(bad)) << bad;
}

}  // namespace
}  // namespace ruedo
