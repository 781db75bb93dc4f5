// Parameters of plugins whose job Ruedo does: which of them change nothing here.
#pragma once

#include <string>

#include "model/plugins.h"

namespace ruedo::model {

// Names each parameter of a plugin that Ruedo serves that changes what Gazebo does and nothing
// here, and each that the plugin's documentation does not know. What only gives names (topics,
// frames) or tunes a display is passed over.
void name_parameters(const Element& plugin, const std::string& where, Findings& findings);

}  // namespace ruedo::model
