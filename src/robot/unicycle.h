// Exact motion of a unicycle (a differential drive's base_link) whose speed and turn rate follow
// profiles.
//
// x' = v cos(theta), y' = v sin(theta), theta' = omega: eqs. 1 to 3 of Hernandez-Belmonte et al.
// (ROSSUM 2011) with v = r (w_right + w_left) / 2 and omega = r (w_right - w_left) / track.
#pragma once

#include "robot/profile.h"

namespace ruedo::robot {

// Displacement over an interval, in base_link's frame at its start.
struct Displacement {
  double x = 0.0, y = 0.0;  // m
  double angle = 0.0;       // rad, not wrapped
  double way = 0.0;         // m, path length: integral of v
  double side = 0.0;        // m, integral of the lateral speed, for bases that move sideways
};

// For constant curvature (a line, an arc, or speed and turn rate in proportion): closed form.
Displacement along_arc(double way, double angle);

// From `begin` to `end` (s since the start of both profiles). If v and omega vary independently, by
// Gauss-Legendre quadrature over each interval between changes of the profiles: exact up to
// rounding.
Displacement integrate(const Profile& v, const Profile& omega, double begin, double end);

// `first`, followed by `second`.
Displacement chained(const Displacement& first, const Displacement& second);

}  // namespace ruedo::robot
