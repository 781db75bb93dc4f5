// A step of projected Gauss-Seidel for both friction directions of a contact, of sweeps over bodies
// (solver.h) and over the responses of a mechanism (joined_contacts.h).
#pragma once

#include <utility>

#include "physics/base/rows.h"

namespace ruedo::physics {

// One direction: its coefficient, its impulse, its velocity error, and the impulse with which that
// would vanish.
struct Rubbing {
  double friction = 0.0, impulse = 0.0, missing = 0.0, relaxed = 0.0;
};

// The next impulses. Those of sticking friction if they lie within the ellipse of Coulomb's law;
// otherwise the projection of a step against the slip onto it, in coordinates in which the ellipse
// is a circle. step: of the projected gradient.
inline std::pair<double, double> rubbed(const Rubbing& first, const Rubbing& second, double load,
                                        double step) {
  const double m1 = first.friction, m2 = second.friction;
  const double u1 = m1 > 0.0 ? first.relaxed / m1 : 0.0, u2 = m2 > 0.0 ? second.relaxed / m2 : 0.0;
  const bool inside = (m1 > 0.0 || first.relaxed == 0.0) && (m2 > 0.0 || second.relaxed == 0.0) &&
                      u1 * u1 + u2 * u2 <= load * load;
  if (inside) return {first.relaxed, second.relaxed};
  double s1 = (m1 > 0.0 ? first.impulse / m1 : 0.0) + step * m1 * first.missing,
         s2 = (m2 > 0.0 ? second.impulse / m2 : 0.0) + step * m2 * second.missing;
  const double size = length_of(s1, s2);
  if (size > load) {
    s1 *= load / size;
    s2 *= load / size;
  }
  return {m1 * s1, m2 * s2};
}

}  // namespace ruedo::physics
