// Combines two shapes' surfaces at a contact: friction, slip, bounce, stiffness. A surface belongs
// to a shape, so that a frictionless caster stays so on a chassis with friction.
#pragma once

#include <vector>

#include "physics/dynamics/solver.h"
#include "world/model/world_model.h"

namespace ruedo::physics {

// A shape's surface, in the frame of its body.
struct ShapeSurface {
  double friction = 1.0, friction2 = 1.0;
  Vec3 along_I = Vec3::Zero();  // direction of `friction` in the body's frame I; zero: not given
  Vec3 axle_I =
      Vec3::Zero();  // of a wheel: `friction` acts across it, `friction2` along it; zero: no wheel
  double roller_rad =
      0.0;  // of a wheel with rollers: its friction acts so far from across the axle
            // towards it, along the axis of the roller that stands on the ground
  double slip = 0.0, slip2 = 0.0;  // m/s per N
  double torsional = 0.0;          // coefficient
  double patch_radius_m = 0.0;     // of the torsional friction; 0: from the following two
  double surface_radius_m = 0.0;
  double rolling_m = 0.0;
  double restitution = 0.0;
  double stiffness = 0.0, damping = 0.0;  // 0: rigid
  // World. If given, the shape only yields to loads along this direction.
  Vec3 borne_along = Vec3::Zero();
};

// R_IC: the collision's axes in the body's frame.
ShapeSurface surface_of(const world::Surface& surface, const Quat& R_IC);

// Found through ObjectInfo.
class Surfaces final : public ContactSurfaces {
 public:
  ContactSurface at(const btCollisionObject& a, const btCollisionObject& b,
                    const btManifoldPoint& point) const override;
};

}  // namespace ruedo::physics
