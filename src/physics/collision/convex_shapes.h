// Convex shapes that Bullet lacks: an exact ellipsoid, and a tyre, which touches the ground in one
// point like a sphere but is no wider than the wheel. Also Bullet's own shapes, with enlarged
// bounds.
//
// Ellipsoid and tyre are given to Bullet's GJK by their support functions.
#pragma once

#include <vector>

#include "physics/base/bullet.h"

namespace ruedo::physics {

// Bullet looks for contacts where the bounds of two shapes overlap. These bounds overlap before the
// shapes touch: something put down exactly must not fall by a rounding error.
constexpr btScalar kSeenAhead_m = 2e-4;
// Of what moves, by as much as it moves in a substep: set for each pair before its contacts are
// found. It must neither land inside of something nor pass through it.
inline thread_local btScalar seen_ahead_m = kSeenAhead_m;

template <class Shape>
class SeenAhead final : public Shape {
 public:
  using Shape::Shape;
  void getAabb(const btTransform& X, btVector3& low, btVector3& high) const override {
    const btScalar k = seen_ahead_m;
    Shape::getAabb(X, low, high);
    low -= {k, k, k};
    high += {k, k, k};
  }
};

// The shapes of a body. Bullet first looks at the bounds in its tree, which are those of shapes
// that do not move: of what does, they must overlap as early.
class BodyShape final : public btCompoundShape {
 public:
  void see_ahead(btScalar by) {
    if (by <= tree_seen_m_ && 16 * by >= tree_seen_m_) return;
    see_in_tree(2 * by);
  }
  // How far the tree's bounds see: it depends on the past, so that a saved state has it.
  btScalar seen_in_tree() const { return tree_seen_m_; }
  void see_in_tree(btScalar by) {
    widen(getDynamicAabbTree()->m_root, by - tree_seen_m_);
    tree_seen_m_ = by;
  }

 private:
  static void widen(btDbvtNode* node, btScalar by) {
    if (!node) return;
    node->volume.Expand({by, by, by});
    if (!node->isinternal()) return;
    for (btDbvtNode* child : node->childs) widen(child, by);
  }
  btScalar tree_seen_m_ = kSeenAhead_m;
};

class ConvexShape : public btConvexInternalShape {
 public:
  ConvexShape() { m_shapeType = CUSTOM_CONVEX_SHAPE_TYPE; }

  void batchedUnitVectorGetSupportingVertexWithoutMargin(const btVector3* directions,
                                                         btVector3* supports,
                                                         int count) const override {
    for (int i = 0; i < count; ++i)
      supports[i] = localGetSupportingVertexWithoutMargin(directions[i]);
  }
  void getAabb(const btTransform& X, btVector3& low, btVector3& high) const override {
    getAabbSlow(X, low, high);
  }
  // Moments of inertia come from the world file, never from shapes.
  void calculateLocalInertia(btScalar, btVector3& inertia) const override { inertia.setZero(); }
};

// The ellipsoid of the given radii (m).
class EllipsoidShape : public ConvexShape {
 public:
  explicit EllipsoidShape(const btVector3& radii) : radii_(radii) { m_collisionMargin = 0.0; }
  btVector3 localGetSupportingVertexWithoutMargin(const btVector3& direction) const override {
    const btVector3 scaled = direction * radii_;
    const btScalar length = scaled.length();
    return length > 0.0 ? scaled * radii_ / length : btVector3(radii_.x(), 0, 0);
  }
  const char* getName() const override { return "Ellipsoid"; }

 private:
  btVector3 radii_;
};

// All points within width / 2 of a disc: a wheel with a round tyre. The axis is z; radius and width
// (m) are the outer ones. The rounding is Bullet's collision margin, the disc its core.
class TyreShape : public ConvexShape {
 public:
  TyreShape(btScalar radius, btScalar width) : core_(radius - btMin(width / 2, radius)) {
    m_collisionMargin = btMin(width / 2, radius);
  }
  btVector3 localGetSupportingVertexWithoutMargin(const btVector3& direction) const override {
    const btScalar length = btSqrt(direction.x() * direction.x() + direction.y() * direction.y());
    if (length < 1e-12) return {0, 0, 0};
    return {core_ * direction.x() / length, core_ * direction.y() / length, 0};
  }
  const char* getName() const override { return "Tyre"; }
  btScalar core() const { return core_; }

 private:
  btScalar core_;
};

// A convex hull that knows its flat sides.
class HullShape : public btConvexHullShape {
 public:
  struct Side {
    btVector3 normal;
    std::vector<btVector3> corners;  // in order
  };
  const std::vector<Side>& sides() const { return sides_; }
  // To be called once all points are added.
  void find_sides();

 private:
  std::vector<Side> sides_;
};

}  // namespace ruedo::physics
