// Faults for which urdfdom gives a whole robot up.
#pragma once

#include "ruedo/element.h"

namespace ruedo::model {

// Mends what is wrong with single links and joints of a <robot>, or leaves them out, and names
// each, so that the rest of the robot is read: names, types, limits and places of joints, joints
// between links that are not there or in a circle, links that do not hang on the others.
void repair_urdf(Element& robot, Findings& findings);

}  // namespace ruedo::model
