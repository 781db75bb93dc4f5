// What clients draw, as it is checked before it is taken.
#pragma once

#include <string>

#include "ruedo/markers_t.hpp"

namespace ruedo::engine {

// "" or what is wrong with it.
std::string check_markers(const markers_t& markers);

}  // namespace ruedo::engine
