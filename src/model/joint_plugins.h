// How joints' controllers hold them: the plugins of gz-sim and Gazebo Classic, and the gains of
// ros_control and ros2_control.
#pragma once

#include <vector>

#include "model/read_context.h"
#include "model/world_model.h"

namespace ruedo::model {

// Gives the joints the PIDs that plugins of the model write, and what they do until they are told
// something; names what of them is not done. The model's joints are complete.
void read_joint_plugins(const std::vector<const Element*>& plugins, const std::string& where,
                        Findings& findings, Model& model);

// What <transmission> and <ros2_control> say of how joints are commanded: those by position or
// velocity stay where they are until they are told something.
void read_joint_interfaces(const Element& model_element, Model& model);

}  // namespace ruedo::model
