// Names that SDF keeps for itself.
#pragma once

#include <string_view>

namespace ruedo::world {

inline bool is_reserved_name(std::string_view name) {
  return name == "world" || (name.size() >= 4 && name.starts_with("__") && name.ends_with("__"));
}

}  // namespace ruedo::world
