// Reads where the world lies and what surrounds it.
#pragma once

#include "model/world_model.h"

namespace ruedo::model {

// <spherical_coordinates>, <atmosphere>, <wind>, <magnetic_field> (SDF before 1.6: in <physics>).
// What is wrong in one of them is named, and that element is left out.
void read_environment(const Element& world, Environment& environment, Findings& findings);

// The plugins WindEffects and WindPlugin: the wind pushes, and changes.
void read_wind_plugin(const Element& plugin, Wind& wind, Findings& findings);

}  // namespace ruedo::model
