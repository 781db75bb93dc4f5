// Pressure from hydrostatics: dp/dH = -p g0 / (R T) in the geopotential altitude H = r h / (r + h).
#include "sensors/air.h"

#include <algorithm>

#include "ruedo/math.h"

namespace ruedo {
namespace {

constexpr double kGravity = 9.80665;        // m/s^2
constexpr double kGas = 287.05287;          // J/(kg K), of dry air, ISO 2533
constexpr double kEarthRadius = 6356766.0;  // m, of the geopotential altitude, ISO 2533
constexpr double kTropopause = 11'000.0;    // m, geopotential
constexpr double kLowest = -5000.0, kHighest = 20'000.0;  // m, geopotential

}  // namespace

Air air_at(const world::Environment& environment, double altitude) {
  const double h =
      std::clamp(kEarthRadius * altitude / (kEarthRadius + altitude), kLowest, kHighest);
  const double troposphere = std::min(h, kTropopause), gradient = environment.temperature_gradient;
  // With a gradient from a file, the temperature may reach zero below the tropopause.
  const double temperature = std::max(environment.temperature + gradient * troposphere, 1.0);
  double pressure = environment.pressure;
  if (gradient == 0.0) {
    pressure *= math::exp(-kGravity * troposphere / (kGas * temperature));
  } else {
    pressure *= math::pow(temperature / environment.temperature, -kGravity / (kGas * gradient));
  }
  if (h > kTropopause) pressure *= math::exp(-kGravity * (h - kTropopause) / (kGas * temperature));
  return {pressure, temperature, pressure / (kGas * temperature)};
}

}  // namespace ruedo
