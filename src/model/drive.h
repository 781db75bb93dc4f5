// How a robot drives: <ruedo:drive>, and the drive plugins of Gazebo, which are translated to it.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "model/read_context.h"
#include "model/world_model.h"

namespace ruedo::model {

// Gives the model its drive and odometry, from its <ruedo:drive> or a plugin that is known; other plugins are told
// once. The model's links and joints are complete.
void read_drive_of(const Element& model_element, const std::string& where, ReadContext& context, Model& model);

// The drive that a <ruedo:drive> describes. Throws InputError.
DriveDescription read_drive(std::shared_ptr<const Element> drive, std::shared_ptr<const Element> odometry, const Model& model);

// A Gazebo drive plugin as <ruedo:drive>; null when the plugin is another one.
std::unique_ptr<Element> drive_from_plugin(const Element& plugin);

// Whether a plugin moves a model's joints, or publishes them: what ROBOT/joints and ROBOT/joint_command do here.
bool commands_joints(const Element& plugin);

// What is to be said of a drive plugin of another kind; null for other plugins.
const char* unsupported_drive(const Element& plugin);

// What may stand in <ruedo:drive> and <ruedo:odometry>.
const std::vector<std::string>& drive_elements();
const std::vector<std::string>& odometry_elements();

}  // namespace ruedo::model
