// Findings where the physics simplifies the world's files, with file and line.
#pragma once

#include <vector>

#include "world/model/body_layout.h"

namespace ruedo::physics {

// Ball and universal joints (they hold, but their state and motors are partial), bodies whose
// shapes have different friction, and mechanisms too large to be solved at once.
std::vector<Finding> simplifications(const world::WorldModel& world,
                                     const world::BodyLayout& layout);

}  // namespace ruedo::physics
