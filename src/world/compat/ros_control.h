// A robot's drive as defined by ros_control and ros2_control: translates a controller's parameters,
// from its YAML file, to <ruedo:drive>.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "world/compat/plugins.h"
#include "world/model/world_model.h"
#include "world/read/read_context.h"

namespace ruedo::world {

struct ControllersDrive {
  std::unique_ptr<Element> drive;  // null: no controller drives this robot
  std::unique_ptr<Element> odometry;
  std::string controller;  // its name and file, for messages
  bool named = false;      // by the plugin; false: found in a package's config folder
};

// Looks for a controller that drives the model's joints: first in the files named by ros_control's
// plugins, then in the config folders of the package and its neighbours. Reports what of it is not
// supported.
ControllersDrive drive_from_controllers(const Element& model_element,
                                        const std::vector<const Element*>& plugins,
                                        const Model& model, const std::string& where,
                                        ReadContext& context);

// The joints that <transmission> and <ros2_control> let a controller turn: those with a velocity
// interface, or all without one.
std::vector<std::string> controlled_joints(const Element& model_element);

}  // namespace ruedo::world
