// Finds degrees written in place of radians.
#pragma once

#include "ruedo/element.h"

namespace ruedo::world {

// Reports rotations and joint limits below the root of an SDF or URDF document whose numbers look
// like degrees: whole multiples of 5 beyond a full turn in radians. Their values are used as
// written. Also reports poses of five numbers, whose yaw is 0.
void name_degrees(const Element& root, Findings& findings);

}  // namespace ruedo::world
