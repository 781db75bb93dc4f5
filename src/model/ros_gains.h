// The gains of joints in the files of ros_control and ros2_control.
#pragma once

#include <string>
#include <vector>

#include "model/read_context.h"
#include "model/world_model.h"

namespace ruedo::model {

// Gives the joints the PIDs that gazebo_ros_control, gazebo_ros2_control and the controllers of
// effort have in their files, and the gains of controllers of velocity.
void read_ros_gains(const Element& model_element, const std::vector<const Element*>& plugins,
                    const std::string& where, ReadContext& context, Model& model);

}  // namespace ruedo::model
