// Whether two convex things overlap, by GJK on their support functions (Gilbert, Johnson and
// Keerthi, "A Fast Procedure for Computing the Distance Between Complex Objects in
// Three-Dimensional Space", 1988).
#pragma once

#include <span>

#include "world/model/world_model.h"

namespace ruedo::world {

// A convex set: a shape of a model at a pose, or the hull of points.
struct Convex {
  const Geometry* geometry = nullptr;  // not a plane; a mesh counts as its hull
  Pose X_WG;
  std::span<const Vec3> points;  // in the world; used when geometry is null

  // The point of the set that is furthest in that direction, in the world.
  Vec3 support(const Vec3& direction) const;
};

bool overlap(const Convex& a, const Convex& b);

}  // namespace ruedo::world
