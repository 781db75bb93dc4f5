// Reads the world's location and environment.
#pragma once

#include "world/model/world_model.h"

namespace ruedo::world {

// <spherical_coordinates>, <atmosphere>, <wind>, <magnetic_field> (SDF before 1.6: in <physics>).
// An element with an error is reported and left out.
void read_environment(const Element& world, Environment& environment, Findings& findings);

// The plugins WindEffects and WindPlugin: wind that pushes links and varies.
void read_wind_plugin(const Element& plugin, Wind& wind, Findings& findings);

}  // namespace ruedo::world
