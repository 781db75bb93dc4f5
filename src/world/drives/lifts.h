// Lifts that are called to floors, and doors that open on command: Gazebo's Elevator and
// ElevatorPlugin, and RMF's doors and lifts.
#pragma once

#include <vector>

#include "world/model/world_model.h"
#include "world/read/read_context.h"

namespace ruedo::world {

// Adds the doors and lifts of the model's plugins, and makes the model take commands. Links and
// joints must be complete; a door may use joints of a model that contains this one.
void read_lifts(const std::vector<const Element*>& plugins, const std::string& where,
                Findings& findings, Model& model);

// Reports joints and doors that do not exist.
void check_lifts(const WorldModel& world, Findings& findings);

}  // namespace ruedo::world
