// How a robot drives: <ruedo:drive>, and Gazebo's drive plugins, which are translated to it.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "world/model/world_model.h"
#include "world/read/read_context.h"

namespace ruedo::world {

// Sets the model's drive and odometry from its <ruedo:drive> or a known plugin; other plugins are
// reported once. The model's links and joints must be complete.
void read_drive_of(const Element& model_element, const std::string& where, ReadContext& context,
                   Model& model);

// The drive described by a <ruedo:drive>. Throws InputError.
DriveDescription read_drive(std::shared_ptr<const Element> drive,
                            std::shared_ptr<const Element> odometry, const Model& model);

// Translates a Gazebo drive plugin, or an unknown plugin that names wheels of the model in the same
// way, to <ruedo:drive>; reports parameters that cannot mean what they say. Null: it is not a drive
// plugin.
std::unique_ptr<Element> drive_from_plugin(const Element& plugin, const Model& model,
                                           const std::string& where, Findings& findings);

// The links of a tracked vehicle whose surface is a belt, including those of flippers.
std::vector<ModelLinkIndex> belts_from_plugin(const Element& plugin, const Model& model);

// Its odometry rate, as <ruedo:odometry>; null: it gives none.
std::unique_ptr<Element> odometry_from_plugin(const Element& plugin, const std::string& where,
                                              Findings& findings);

// Whether it has elements as drive plugins do, naming joints of the model on the left and right.
bool names_wheels(const Element& plugin, const Model& model);

// The value for <ruedo:drive steering="">: "differential", "mecanum", ...
std::string name_of(DriveDescription::Steering steering);

// Whether such a drive goes to the side as it goes ahead.
inline bool moves_sideways(DriveDescription::Steering steering) {
  using Steering = DriveDescription::Steering;
  return steering == Steering::mecanum || steering == Steering::omni ||
         steering == Steering::holonomic;
}

// The prefix of findings about a drive that no file describes.
// An attribute of a <ruedo:joints> that no file has.
inline constexpr const char* kImplied = "implied";
inline constexpr const char* kNoDriveIsWritten = "no file says how it drives";

// The elements allowed in <ruedo:drive> and <ruedo:odometry>.
const std::vector<std::string>& drive_elements();
const std::vector<std::string>& odometry_elements();

}  // namespace ruedo::world
