// Names that SDF keeps for itself.
#pragma once

#include <string>
#include <string_view>

#include "ruedo/element.h"

namespace ruedo::world {

inline bool is_reserved_name(std::string_view name) {
  return name == "world" || (name.size() >= 4 && name.starts_with("__") && name.ends_with("__"));
}

// The name of a <model>. Gazebo Classic accepts "world", the world's name here: it is replaced.
inline constexpr const char* kModelNamedWorld = "world_model";
std::string name_of_model(const Element& element);

}  // namespace ruedo::world
