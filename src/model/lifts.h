// Lifts that are called by floor, and doors that open when they are told: Gazebo's Elevator and
// ElevatorPlugin, and the doors and lifts of RMF.
#pragma once

#include <vector>

#include "model/read_context.h"
#include "model/world_model.h"

namespace ruedo::model {

// Gives the model the doors and lifts of its plugins, and makes it take commands. Its links and
// joints are complete; those of a door may be the joints of a model that this one is part of.
void read_lifts(const std::vector<const Element*>& plugins, const std::string& where,
                Findings& findings, Model& model);

// Names joints and doors that are not there.
void check_lifts(const WorldModel& world, Findings& findings);

}  // namespace ruedo::model
