// Repairs faults for which urdfdom would reject a whole robot.
#pragma once

#include "ruedo/element.h"

namespace ruedo::world {

// Repairs faulty links and joints of a <robot>, or removes them, and reports each, so that the rest
// is read: names, types, limits and poses of joints, joints to missing links or in a cycle,
// disconnected links.
void repair_urdf(Element& robot, Findings& findings);

}  // namespace ruedo::world
