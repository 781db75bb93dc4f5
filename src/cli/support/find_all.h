// Everything that is wrong, repaired or not supported in a world, for check and run --strict.
#pragma once

#include <vector>

#include "cli/support/commands.h"

namespace ruedo::cli {

// The findings of readers, devices and physics, and pictures that cannot be decoded.
// refusal: the exit code with which `ruedo run` would refuse it, or kGood. Throws InputError for a
// wrong command line alone.
std::vector<Finding> find_all(const WorldArguments& arguments, ExitCode& refusal);

// For commands that make no devices: refuses the options that `ruedo run` would refuse. world: as
// they were loaded with. Throws InputError.
void check_options(const WorldArguments& arguments, const world::WorldModel& world);

}  // namespace ruedo::cli
