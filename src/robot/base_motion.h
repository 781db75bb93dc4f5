// Exact motion of bases other than unicycles: those that also move sideways, and steered ones.
#pragma once

#include "robot/unicycle.h"

namespace ruedo::robot {

// Constant twist: forward, sideways and angular velocity in constant proportion. Closed form.
Displacement along_twist(double way, double side, double angle);

// x' = v cos(theta) - u sin(theta), y' = v sin(theta) + u cos(theta), theta' = omega, from `begin`
// to `end` (s since the start of the profiles). Quadrature as for the unicycle: exact up to
// rounding.
Displacement integrate(const Profile& v, const Profile& side, const Profile& omega, double begin,
                       double end);

// A steering angle that changes at a constant rate until it is reached, and then stays.
struct SteeringPlan {
  double from = 0.0, to = 0.0;  // rad
  double end = 0.0;             // s, when it is reached

  static SteeringPlan between(double from, double to, double rate);
  double angle(double time) const;
};

// The bicycle model: theta' = v tan(steering) / wheelbase, with v at the centre of the fixed axle.
// wheelbase < 0: steered at the rear.
Displacement integrate_steered(const Profile& v, const SteeringPlan& steering, double wheelbase,
                               double begin, double end);

}  // namespace ruedo::robot
