// Text for XML and HTML.
#pragma once

#include <string>
#include <string_view>

namespace ruedo {

// Names and values come from files: nothing of them may become markup. Control characters become
// blanks, but for line ends and tabs.
std::string xml_escaped(std::string_view text);

}  // namespace ruedo
