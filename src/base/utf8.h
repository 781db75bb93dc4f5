// Sanitises texts from files and messages for consumers that need valid UTF-8 (JSON, browsers), and
// for terminals, which obey control characters.
#pragma once

#include <string>
#include <string_view>

namespace ruedo {

// Bytes that are not UTF-8 become '?'.
std::string printable(std::string_view text);

// And so do control characters, but for line ends and tabs: nothing in a name moves a cursor, sets
// a colour, or changes the order of what is beside it.
std::string for_terminal(std::string_view text);

// Line ends and tabs become blanks: what follows one in a name would look like a line of ours.
std::string in_one_line(std::string text);

// At most so many bytes of it, without half a character at the end, and "..." for the rest.
std::string shortened(std::string_view text, size_t longest);

// Largest size of a foreign text that a log or a reply quotes: it may have megabytes.
inline constexpr size_t kLongestSaid = 1000;

// Whether it is UTF-8 without any control character, as a name should be.
bool is_one_line(std::string_view text);

}  // namespace ruedo
