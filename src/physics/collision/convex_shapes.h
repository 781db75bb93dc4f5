// Convex shapes that Bullet lacks: an exact ellipsoid, and a tyre, which touches the ground in one
// point like a sphere but is no wider than the wheel. Also Bullet's own shapes, with enlarged
// bounds.
//
// Ellipsoid and tyre are given to Bullet's GJK by their support functions.
#pragma once

#include "physics/base/bullet.h"

namespace ruedo::physics {

// Bullet looks for contacts where the bounds of two shapes overlap. These bounds overlap before the
// shapes touch: something put down exactly must not fall by a rounding error.
constexpr btScalar kSeenAhead_m = 2e-4;

template <class Shape>
class SeenAhead final : public Shape {
 public:
  using Shape::Shape;
  void getAabb(const btTransform& X, btVector3& low, btVector3& high) const override {
    constexpr btScalar k = kSeenAhead_m;
    Shape::getAabb(X, low, high);
    low -= {k, k, k};
    high += {k, k, k};
  }
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

 private:
  btScalar core_;
};

}  // namespace ruedo::physics
