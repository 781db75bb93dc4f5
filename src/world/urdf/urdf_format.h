// The elements of the URDF format.
#pragma once

#include "ruedo/element.h"

namespace ruedo::world {

// Reports elements of a <robot> that URDF does not have, and attributes that look like misspelt
// ones. <gazebo>, <transmission> and <ros2_control> have readers of their own.
void name_what_urdf_lacks(const Element& robot, Findings& findings);

}  // namespace ruedo::world
