// Materials of visuals: SDF's colours and PBR maps, Gazebo's material scripts by name, OGRE's
// .material files.
#pragma once

#include <optional>
#include <string>

#include "model/mesh.h"
#include "model/read_context.h"

namespace ruedo::model {

// Reads <material>. nullopt: it says nothing that Ruedo understands, which is then in the findings.
std::optional<Material> read_material(const Element& material, const std::string& where,
                                      ReadContext& context);

// One of Gazebo's own materials by name ("Gazebo/Grey"); nullopt when the name is not known.
std::optional<Material> gazebo_material(const std::string& name);

// "r g b" or "r g b a", each in [0, 1] (values beyond are clamped).
Rgba read_colour(const Element& element);

}  // namespace ruedo::model
