// What URDF has, element by element.
#pragma once

#include "ruedo/element.h"

namespace ruedo::model {

// Names elements of a <robot> that URDF does not have, and attributes that are nearly written as
// one of URDF's. <gazebo>, <transmission> and <ros2_control> have readers of their own.
void name_what_urdf_lacks(const Element& robot, Findings& findings);

}  // namespace ruedo::model
