// Worlds by name.
#pragma once

#include <string>

namespace ruedo::model {

// The file that a user means: one that is there, or NAME.sdf or NAME.world among Ruedo's own worlds
// or in a folder of RUEDO_PATH. Throws InputError, which lists the names that there are and where
// was searched.
std::string world_file(const std::string& name);

}  // namespace ruedo::model
