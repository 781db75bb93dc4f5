// Texts from files and messages, as those take them who insist on UTF-8 (JSON, browsers), or obey
// what they are shown (terminals).
#pragma once

#include <string>
#include <string_view>

namespace ruedo {

// What is not UTF-8 becomes '?'.
std::string printable(std::string_view text);

// And so do control characters, but for line ends and tabs: nothing in a name moves a cursor or
// sets a colour.
std::string for_terminal(std::string_view text);

}  // namespace ruedo
