// The reason why a robot's model cannot execute a command, for the log, and for clients in
// lockstep. The robot itself refuses more, such as values out of range; ROBOT/motion shows it.
#pragma once

#include <string>

#include "robot/robots.h"
#include "world/model/body_layout.h"

namespace ruedo::engine {

// Why the command can never act on its robot: it moves sideways and the robot does not, or names a
// joint, hold, lift or door that the robot does not have. "": nothing is wrong with it.
std::string check_possible(const world::WorldModel& world, const world::BodyLayout& layout,
                           const robot::Command& command);

}  // namespace ruedo::engine
