// Texts from files and messages, as those who insist on UTF-8 take them: JSON, browsers.
#pragma once

#include <string>
#include <string_view>

namespace ruedo {

// What is not UTF-8 becomes '?'.
std::string printable(std::string_view text);

}  // namespace ruedo
