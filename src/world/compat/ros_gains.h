// The joints' gains from the files of ros_control and ros2_control.
#pragma once

#include <string>
#include <vector>

#include "world/model/world_model.h"
#include "world/read/read_context.h"

namespace ruedo::world {

// Sets the joints' PIDs from gazebo_ros_control, gazebo_ros2_control and effort controllers, and
// the gains of velocity controllers.
void read_ros_gains(const Element& model_element, const std::vector<const Element*>& plugins,
                    const std::string& where, ReadContext& context, Model& model);

}  // namespace ruedo::world
