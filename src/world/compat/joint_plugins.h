// How joint controllers hold the joints: the plugins of gz-sim and Gazebo Classic, and the gains of
// ros_control and ros2_control.
#pragma once

#include <vector>

#include "world/model/world_model.h"
#include "world/read/read_context.h"

namespace ruedo::world {

// Sets the joints' PIDs from the model's plugins, and what the joints do before the first command;
// reports what is not supported. The model's joints must be complete.
void read_joint_plugins(const std::vector<const Element*>& plugins, const std::string& where,
                        Findings& findings, Model& model);

// Applies the command interfaces in <transmission> and <ros2_control>: joints commanded by position
// or velocity hold their position before the first command. Reports joints that are not there.
void read_joint_interfaces(const Element& model_element, const std::string& where,
                           Findings& findings, Model& model);

}  // namespace ruedo::world
