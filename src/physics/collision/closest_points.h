// The closest points of two convex shapes, by Gilbert, Johnson and Keerthi's algorithm (GJK, 1988).
//
// Bullet's own versions compare with absolute lengths and volumes, which fit shapes of decimetres,
// and compute every distance to the end. This one has the same accuracy for shapes of millimetres,
// and gives up as soon as the shapes are known to be farther apart than asked.
#pragma once

#include <limits>

#include "physics/base/bullet.h"

namespace ruedo::physics {

// A shape's margin rounds its core outwards, as for spheres, capsules and tyres.
struct PlacedShape {
  const btConvexShape& shape;
  const btTransform& X;
};

struct ClosestPoints {
  // m, to 1e-6 m; +inf: farther than asked; 0: they touch or overlap
  double distance = std::numeric_limits<double>::infinity();
  btVector3 on_a{0, 0, 0}, on_b{0, 0, 0};
  btVector3 normal{0, 0, 0};  // unit, from b to a; zero if the cores overlap
};

ClosestPoints closest_points(const PlacedShape& a, const PlacedShape& b, double reach);

}  // namespace ruedo::physics
