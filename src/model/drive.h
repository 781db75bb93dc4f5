// How a robot drives: <ruedo:drive>, and the drive plugins of Gazebo, which are translated to it.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "model/read_context.h"
#include "model/world_model.h"

namespace ruedo::model {

// Gives the model its drive and odometry, from its <ruedo:drive> or a plugin that is known; other
// plugins are told once. The model's links and joints are complete.
void read_drive_of(const Element& model_element, const std::string& where, ReadContext& context,
                   Model& model);

// The drive that a <ruedo:drive> describes. Throws InputError.
DriveDescription read_drive(std::shared_ptr<const Element> drive,
                            std::shared_ptr<const Element> odometry, const Model& model);

// A Gazebo drive plugin as <ruedo:drive>, or one that is not known and names wheels of the model as
// these do; null when the plugin is another one.
std::unique_ptr<Element> drive_from_plugin(const Element& plugin, const Model& model);

// The links of a tracked vehicle whose surface is a belt, those of flippers among them.
std::vector<ModelLinkIndex> belts_from_plugin(const Element& plugin, const Model& model);

// Its rate of odometry, as <ruedo:odometry>; null: it says none.
std::unique_ptr<Element> odometry_from_plugin(const Element& plugin);

// It has elements as drive plugins do, with joints of the model to the left and to the right.
bool names_wheels(const Element& plugin, const Model& model);

// As <ruedo:drive steering=""> has it: "differential", "mecanum", ...
std::string name_of(DriveDescription::Steering steering);

// What findings about a drive that no file has begin with.
inline constexpr const char* kNoDriveIsWritten = "no file says how it drives";

// What may stand in <ruedo:drive> and <ruedo:odometry>.
const std::vector<std::string>& drive_elements();
const std::vector<std::string>& odometry_elements();

}  // namespace ruedo::model
