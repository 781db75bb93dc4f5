// A robot's drive as ros_control and ros2_control have it: the parameters of a controller, from its
// YAML, as the <ruedo:drive> that says the same.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "model/plugins.h"
#include "model/read_context.h"
#include "model/world_model.h"

namespace ruedo::model {

struct ControllersDrive {
  std::unique_ptr<Element> drive;  // null: no controller drives this robot
  std::unique_ptr<Element> odometry;
  std::string controller;  // its name and file, for messages
  bool named = false;      // by the plugin; false: found in a package's config folder
};

// Looks for a controller that drives the model's joints: in the files that the plugins of
// ros_control name, then in the config folders of the package and of those beside it. Names what of
// it is not done.
ControllersDrive drive_from_controllers(const Element& model_element,
                                        const std::vector<const Element*>& plugins,
                                        const Model& model, const std::string& where,
                                        ReadContext& context);

// The joints that <transmission> and <ros2_control> let a controller turn: those by velocity, or
// all where none is.
std::vector<std::string> controlled_joints(const Element& model_element);

}  // namespace ruedo::model
