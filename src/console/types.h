// Message types unknown to the page: those of plugins, and of --types.
#pragma once

#include <string>

namespace ruedo::console {

// {"NAME": [{"name", "type", "sizes": [number of elements, or name of the field that has it]}]},
// like the descriptions of the page's own types.
std::string types_json();

}  // namespace ruedo::console
