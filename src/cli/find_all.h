// Everything that is wrong, repaired or not supported in a world, for check and run --strict.
#pragma once

#include <vector>

#include "cli/commands.h"

namespace ruedo::cli {

// What the readers, the devices and the physics found, and pictures that cannot be decoded. loaded:
// `ruedo run` would start. Throws InputError for a wrong command line alone.
std::vector<Finding> find_all(const WorldArguments& arguments, bool& loaded);

}  // namespace ruedo::cli
