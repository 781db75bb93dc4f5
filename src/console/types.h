// Message types that the page does not have: those of plugins, and of --types.
#pragma once

#include <string>

namespace ruedo::console {

// {"NAME": [{"name", "type", "sizes": [number of elements, or name of the field that has it]}]}: as
// the page's own types are described.
std::string types_json();

}  // namespace ruedo::console
