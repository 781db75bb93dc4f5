// Detachable joints: gz-sim's plugin DetachableJoint.
#pragma once

#include <string>
#include <vector>

#include "model/read_context.h"
#include "model/world_model.h"

namespace ruedo::model {

// Gives the model what its plugins hold, and makes it take commands. Its links are complete.
void read_holds(const std::vector<const Element*>& plugins, const std::string& where,
                Findings& findings, Model& model);

// Names what a model of the world is to hold and what is not there.
void check_holds(const WorldModel& world, Findings& findings);

}  // namespace ruedo::model
