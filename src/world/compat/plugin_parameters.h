// Parameters of the plugins that Ruedo replaces: which of them have no effect here.
#pragma once

#include <string>

#include "world/compat/plugins.h"

namespace ruedo::world {

// Reports each parameter of a replaced plugin that changes what Gazebo does but has no effect here,
// and each that is not in the plugin's documentation. Skips what only sets names (topics, frames)
// or tunes a display.
void name_parameters(const Element& plugin, const std::string& where, Findings& findings);

}  // namespace ruedo::world
