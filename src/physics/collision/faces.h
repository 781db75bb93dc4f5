// Where convex shapes touch: their flat sides and straight edges, and how two of these overlap.
//
// The closest points of two shapes are one point, and of a box that lies on another, any of its
// side. A contact needs all corners of where the sides overlap, at once and anew in each substep: a
// point that is kept from earlier is no longer between the two once one of them rolls.
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "physics/base/bullet.h"

namespace ruedo::physics {

// The corners of a polygon in order, or the two ends of an edge; fewer: a single point touches.
struct Face {
  static constexpr size_t kMost = 32;
  std::array<btVector3, kMost> corners;
  size_t count = 0;
  void add(const btVector3& corner) {
    if (count < kMost) corners[count++] = corner;
  }
  btVector3 normal() const;  // not unit; zero for an edge
};

// The farthest point in that direction (unit, world); X is the shape's pose. Triangles, too.
Face face_towards(const btCollisionShape& shape, const btTransform& X, const btVector3& direction);

// The point that lies farthest in that direction (unit, world). Bullet's own rounds a cylinder's
// edges by its margin.
btVector3 farthest_point(const btConvexShape& shape, const btTransform& X,
                         const btVector3& direction);

// A point of the shape a substep ago: a triangle's corner, or the centre of a moving shape. It
// shows on which side of a surface the shape is, also when it sank into that in the last substep.
btVector3 center_before(const btCollisionObjectWrapper& placed, btScalar substep_s);

// Calls `act` with the outward normal of each flat side (unit, world), and of the round side what
// faces `towards`.
void for_each_side(const btCollisionShape& shape, const btTransform& X, const btVector3& towards,
                   const std::function<void(const btVector3&)>& act);

struct TouchingPoint {
  btVector3 on_b;
  btScalar gap;
};

// Appends the corners of where `a` and `b` overlap, seen along `normal` (unit, from b to a). None
// if they meet in one point.
void overlap(const Face& a, const Face& b, const btVector3& normal,
             std::vector<TouchingPoint>& into);

}  // namespace ruedo::physics
