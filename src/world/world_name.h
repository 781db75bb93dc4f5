// Worlds by name.
#pragma once

#include <string>
#include <vector>

namespace ruedo::world {

// The names that world_file() takes, in order.
std::vector<std::string> world_names();

// The file that a user means: an existing file, or NAME.sdf or NAME.world among Ruedo's own worlds
// or in a folder of RUEDO_PATH. Throws InputError, listing the existing names and the folders
// searched.
std::string world_file(const std::string& name);

}  // namespace ruedo::world
