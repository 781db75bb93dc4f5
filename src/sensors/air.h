// The air of the world: the International Standard Atmosphere (ISO 2533; U.S. Standard Atmosphere,
// 1976), up to 20 km, with the sea level's temperature and pressure and the gradient of the world's
// <atmosphere>.
#pragma once

#include "model/world_model.h"

namespace ruedo {

struct Air {
  double pressure;     // Pa
  double temperature;  // K
  double density;      // kg/m^3, of a dry ideal gas
};

// altitude: m above sea level, geometric. From -5 km on; below, and above 20 km, that of the limit.
Air air_at(const model::Environment& environment, double altitude);

}  // namespace ruedo
