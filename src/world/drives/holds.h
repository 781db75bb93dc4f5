// Detachable joints: gz-sim's plugin DetachableJoint.
#pragma once

#include <string>
#include <vector>

#include "world/model/world_model.h"
#include "world/read/read_context.h"

namespace ruedo::world {

// Adds what the model's plugins hold, and makes the model take commands. Its links must be
// complete.
void read_holds(const std::vector<const Element*>& plugins, const std::string& where,
                Findings& findings, Model& model);

// Reports models and links to be held that do not exist.
void check_holds(const WorldModel& world, Findings& findings);

}  // namespace ruedo::world
