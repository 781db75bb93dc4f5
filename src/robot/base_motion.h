// Exact motion of bases that are no unicycles: those that also move sideways, and those that are
// steered.
#pragma once

#include "robot/unicycle.h"

namespace ruedo::robot {

// Constant twist: ahead, to the left and turning in proportion to each other. Closed form.
Displacement along_twist(double way, double side, double angle);

// x' = v cos(theta) - u sin(theta), y' = v sin(theta) + u cos(theta), theta' = omega, from `begin`
// to `end` (s since the start of the profiles). Quadrature as of the unicycle: exact to rounding.
Displacement integrate(const Profile& v, const Profile& side, const Profile& omega, double begin,
                       double end);

// A steering angle that goes from one to another at a constant rate, and stays.
struct SteeringPlan {
  double from = 0.0, to = 0.0;  // rad
  double end = 0.0;             // s, when it is there

  static SteeringPlan between(double from, double to, double rate);
  double angle(double time) const;
};

// The bicycle model: theta' = v tan(steering) / wheelbase, with v along the fixed axle's middle.
// wheelbase < 0: steered behind.
Displacement integrate_steered(const Profile& v, const SteeringPlan& steering, double wheelbase,
                               double begin, double end);

}  // namespace ruedo::robot
