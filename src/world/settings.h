// --drive, --set and --disable: changes to individual robots of a loaded world.
#pragma once

#include <string>
#include <vector>

#include "world/load.h"

namespace ruedo::world {

// Each changed robot gets a model of its own; the others keep sharing theirs. Throws InputError for
// a robot, device or key that does not exist, listing those that do.
void apply_settings(const std::vector<Setting>& settings, WorldModel& world);

// Gives models a kinematic drive by their wheel joints, in place of any that they have. Their
// odometry is kept.
void apply_drives(const std::vector<DriveOption>& drives, WorldModel& world);

// "ROBOT/DEVICE": sensors are removed; for a robot's own channels (odometry, pose, ...) it is
// recorded in the world.
void apply_disabled(const std::vector<std::string>& disabled, WorldModel& world);

}  // namespace ruedo::world
