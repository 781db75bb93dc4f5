// --drive, --set and --disable: changes to single robots of a world that is read.
#pragma once

#include <string>
#include <vector>

#include "model/load.h"

namespace ruedo::model {

// Each robot that is changed gets a model of its own; the others go on sharing theirs. Throws
// InputError for a robot, device or key that is not there, listing those that are.
void apply_settings(const std::vector<Setting>& settings, WorldModel& world);

// Gives models a kinematic drive by their wheel joints; one that they have is replaced. The
// odometry stays.
void apply_drives(const std::vector<DriveOption>& drives, WorldModel& world);

// "ROBOT/DEVICE": sensors are removed; a robot's own channels (odometry, pose, ...) are noted in
// the world.
void apply_disabled(const std::vector<std::string>& disabled, WorldModel& world);

}  // namespace ruedo::model
