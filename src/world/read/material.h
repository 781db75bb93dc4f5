// Materials of visuals: SDF's colours and PBR maps, Gazebo's material scripts by name, OGRE's
// .material files.
#pragma once

#include <optional>
#include <string>

#include "world/model/mesh.h"
#include "world/read/read_context.h"

namespace ruedo::world {

// Reads <material>. nullopt: it holds nothing that Ruedo supports; the findings say so.
std::optional<Material> read_material(const Element& material, const std::string& where,
                                      ReadContext& context);

// One of Gazebo's own materials by name ("Gazebo/Grey"); nullopt when the name is not known.
std::optional<Material> gazebo_material(const std::string& name);

// "r g b" or "r g b a"; values are clamped to [0, 1].
Rgba read_colour(const Element& element, const std::string& where, Findings& findings);

}  // namespace ruedo::world
