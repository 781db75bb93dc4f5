// The air of the world: the International Standard Atmosphere (ISO 2533; U.S. Standard Atmosphere,
// 1976) up to 20 km, with temperature and pressure at sea level and the temperature gradient of the
// world's <atmosphere>.
#pragma once

#include "world/model/world_model.h"

namespace ruedo {

struct Air {
  double pressure;     // Pa
  double temperature;  // K
  double density;      // kg/m^3, of a dry ideal gas
};

// altitude: m above sea level, geometric. Clamped to -5 km and 20 km.
Air air_at(const world::Environment& environment, double altitude);

}  // namespace ruedo
