// The physical quantities that files and messages give, each with the largest accepted amount.
// The table is shown in docs/limits.md.
//
// The maxima are far beyond what robots need, and small enough that products of any few of them are
// finite: a force on a mass, a speed on an arm. So no input becomes an infinity or a NaN
// later on.
#pragma once

#include <span>
#include <string_view>

namespace ruedo {

struct Quantity {
  std::string_view name;
  std::string_view unit;  // "": none
  double most;            // of its absolute value
  std::string_view examples;
};

namespace quantity {

inline constexpr Quantity kLength{"length", "m", 1e6, "positions, sizes, radii, tracks"};
inline constexpr Quantity kRange{"range", "m", 1e9, "ranges of sensors and of lights, clip planes"};
inline constexpr Quantity kAngle{"angle", "rad", 1e6,
                                 "roll, pitch, yaw, headings, apertures; degrees, too"};
inline constexpr Quantity kFactor{"factor", "", 1e6,
                                  "scales, directions, lens parameters, errors of encoders"};
inline constexpr Quantity kMass{"mass", "kg", 1e9, "masses of links"};
inline constexpr Quantity kInertia{"moment of inertia", "kg m^2", 1e15,
                                   "moments and products of inertia"};
inline constexpr Quantity kDensity{"density", "kg/m^3", 1e6, "densities of collisions"};
inline constexpr Quantity kGravity{"gravity", "m/s^2", 1000, "each component of gravity"};
inline constexpr Quantity kSpeed{"speed", "m/s or rad/s", 1e6,
                                 "limits of drives, commands to joints, twists of bodies"};
inline constexpr Quantity kAcceleration{"acceleration", "m/s^2 or rad/s^2", 1e9,
                                        "limits of drives"};
inline constexpr Quantity kEffort{"effort", "N or N m", 1e9,
                                  "forces and torques of drives, commands to joints"};
inline constexpr Quantity kDamping{"damping", "N s/m or N m s/rad", 1e9,
                                   "damping, friction and stiffness of joints"};
inline constexpr Quantity kFriction{"friction", "", 1e16, "coefficients of friction"};
inline constexpr Quantity kContact{"contact", "N/m or N s/m", 1e16,
                                   "stiffness and damping of contacts"};
inline constexpr Quantity kTime{"time", "s", 1e9, "phases, waypoints, watchdogs, durations"};
inline constexpr Quantity kNoise{"noise", "of what it is added to", 1e9,
                                 "means, deviations and steps of noise"};
inline constexpr Quantity kBrightness{"brightness", "", 1e9,
                                      "intensity, attenuation and falloff of lights, shininess"};
inline constexpr Quantity kPixels{"pixels", "", 1e6, "coordinates in pictures, focal lengths"};

}  // namespace quantity

// All of them, in the order of the table.
std::span<const Quantity> quantities();

}  // namespace ruedo
