// Bullet's algorithms own the manifold of a pair; these fill it with all points of a substep.
#include "physics/collision/collisions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <new>

#include <BulletCollision/CollisionDispatch/btBoxBoxDetector.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkEpaPenetrationDepthSolver.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkPairDetector.h>
#include <BulletCollision/NarrowPhaseCollision/btVoronoiSimplexSolver.h>

#include "physics/collision/closest_points.h"
#include "physics/collision/contact_points.h"
#include "physics/collision/convex_shapes.h"
#include "physics/collision/faces.h"

namespace ruedo::physics {

namespace {

constexpr size_t kPointsOfAManifold = 4;
// Boxes are enlarged by this: contacts are known before they touch.
constexpr btScalar kAhead_m = kSeenAhead_m;
// A point farther beside either face is not part of their contact.
constexpr btScalar kBeside_m = 2e-5;

class Pair : public btCollisionAlgorithm {
 public:
  Pair(const btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper& a,
       const btCollisionObjectWrapper& b)
      : btCollisionAlgorithm(info), manifold_(info.m_manifold) {
    if (manifold_ || !m_dispatcher->needsCollision(a.getCollisionObject(), b.getCollisionObject()))
      return;
    manifold_ = m_dispatcher->getNewManifold(a.getCollisionObject(), b.getCollisionObject());
    own_ = true;
  }
  ~Pair() override {
    if (own_) m_dispatcher->releaseManifold(manifold_);
  }
  Pair(const Pair&) = delete;
  Pair& operator=(const Pair&) = delete;

  void processCollision(const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b,
                        const btDispatcherInfo& info, btManifoldResult* result) override {
    if (!manifold_) return;
    substep_s = info.m_timeStep;
    result->setPersistentManifold(manifold_);
    collide(*a, *b, *result);
    if (own_) result->refreshContactPoints();
  }
  btScalar calculateTimeOfImpact(btCollisionObject*, btCollisionObject*, const btDispatcherInfo&,
                                 btManifoldResult*) override {
    return 1.0;
  }
  void getAllContactManifolds(btManifoldArray& manifolds) override {
    if (own_) manifolds.push_back(manifold_);
  }

 protected:
  btScalar substep_s = 0.0;

 private:
  virtual void collide(const btCollisionObjectWrapper& a, const btCollisionObjectWrapper& b,
                       btManifoldResult& result) = 0;

  btPersistentManifold* manifold_;
  bool own_ = false;
};

using Points = std::array<btVector3, 8>;  // in the shape's frame

Points corners(const btCollisionShape& shape) {
  const btVector3 half = static_cast<const btBoxShape&>(shape).getHalfExtentsWithMargin();
  Points points;
  for (size_t i = 0; i < points.size(); ++i)
    points[i] = {i & 1 ? half.x() : -half.x(), i & 2 ? half.y() : -half.y(),
                 i & 4 ? half.z() : -half.z()};
  return points;
}

// From each rim the lowest and highest points and those in between; up: in the shape's frame.
Points rim_points(const btCollisionShape& shape, const btVector3& up) {
  const auto& cylinder = static_cast<const btCylinderShapeZ&>(shape);
  const btScalar radius = cylinder.getRadius(), half = cylinder.getHalfExtentsWithMargin().z();
  btVector3 high(up.x(), up.y(), 0.0);
  high = high.length2() > 1e-12 ? high.normalized() : btVector3(1, 0, 0);
  const btVector3 aside(-high.y(), high.x(), 0.0);
  Points points;
  size_t i = 0;
  for (const btScalar z : {-half, half}) {
    for (const btVector3& direction : {high, -high, aside, -aside})
      points[i++] = radius * direction + btVector3(0, 0, z);
  }
  return points;
}

// The four lowest points; if `swapped` is false, the plane is the second object.
template <bool swapped, bool box>
class OnPlane final : public Pair {
 public:
  OnPlane(const btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper& a,
          const btCollisionObjectWrapper& b)
      : Pair(info, swapped ? b : a, swapped ? a : b) {}

 private:
  void collide(const btCollisionObjectWrapper& a, const btCollisionObjectWrapper& b,
               btManifoldResult& result) override {
    const btCollisionObjectWrapper &body = swapped ? b : a, &other = swapped ? a : b;
    const auto& plane = static_cast<const btStaticPlaneShape&>(*other.getCollisionShape());
    const btTransform& X_WP = other.getWorldTransform();
    const btTransform& X_WS = body.getWorldTransform();
    const btVector3 up = X_WP.getBasis() * plane.getPlaneNormal();
    const btScalar ground = up.dot(X_WP.getOrigin()) + plane.getPlaneConstant();
    const Points points = box ? corners(*body.getCollisionShape())
                              : rim_points(*body.getCollisionShape(), up * X_WS.getBasis());
    struct Height {
      btScalar height;
      size_t point;
      btVector3 at;
    };
    std::array<Height, std::tuple_size_v<Points>> heights;
    for (size_t i = 0; i < points.size(); ++i) {
      const btVector3 at = X_WS * points[i];
      heights[i] = {up.dot(at) - ground, i, at};
    }
    // Ties within rounding are broken by number.
    const auto lower = [](const Height& one, const Height& two) {
      return one.height < two.height - 1e-9 ||
             (one.height < two.height + 1e-9 && one.point < two.point);
    };
    for (size_t i = 1; i < heights.size(); ++i) {  // insertion sort: few points, mostly in order
      for (size_t k = i; k > 0 && lower(heights[k], heights[k - 1]); --k)
        std::swap(heights[k], heights[k - 1]);
    }
    for (size_t i = 0; i < kPointsOfAManifold; ++i)
      result.addContactPoint(up, heights[i].at - heights[i].height * up, heights[i].height);
  }
};

// Height of the lowest corner of the shape's bounding box.
btScalar lowest_of_box(const btConvexShape& shape, const btTransform& X_WS, const btVector3& up) {
  btVector3 low, high;
  shape.getAabb(X_WS, low, high);
  return up.dot(low + high) / 2 - up.absolute().dot(high - low) / 2;
}

// The lowest point of any other convex shape, and of its lowest side or edge.
template <bool swapped>
class ConvexOnPlane final : public Pair {
 public:
  ConvexOnPlane(const btCollisionAlgorithmConstructionInfo& info, const btCollisionObjectWrapper& a,
                const btCollisionObjectWrapper& b)
      : Pair(info, swapped ? b : a, swapped ? a : b) {}

 private:
  void collide(const btCollisionObjectWrapper& a, const btCollisionObjectWrapper& b,
               btManifoldResult& result) override {
    const btCollisionObjectWrapper &body = swapped ? b : a, &other = swapped ? a : b;
    const auto& plane = static_cast<const btStaticPlaneShape&>(*other.getCollisionShape());
    const auto& shape = static_cast<const btConvexShape&>(*body.getCollisionShape());
    const btTransform &X_WP = other.getWorldTransform(), &X_WS = body.getWorldTransform();
    const btVector3 up = X_WP.getBasis() * plane.getPlaneNormal();
    const btScalar ground = up.dot(X_WP.getOrigin()) + plane.getPlaneConstant();
    if (lowest_of_box(shape, X_WS, up) - ground > std::max(kReach_m, seen_ahead_m) &&
        !is_driven(*body.getCollisionObject()))
      return;
    const auto add = [&](const btVector3& at) {
      const btScalar height = up.dot(at) - ground;
      result.addContactPoint(up, at - height * up, height);
    };
    add(farthest_point(shape, X_WS, -up));
    const Face face = face_towards(shape, X_WS, -up);
    for (size_t i = 0; i < face.count; ++i) add(face.corners[i]);
  }
};

// Bullet's contacts of two enlarged boxes, corrected to their real size.
class OnRealBoxes final : public btDiscreteCollisionDetectorInterface::Result {
 public:
  OnRealBoxes(const btTransform& X_WA, const btVector3& half_a, const btTransform& X_WB,
              const btVector3& half_b, btScalar ahead, btManifoldResult& result)
      : X_WA_(X_WA),
        X_WB_(X_WB),
        half_a_(half_a),
        half_b_(half_b),
        ahead_(ahead),
        result_(result) {}
  void setShapeIdentifiersA(int, int) override {}
  void setShapeIdentifiersB(int, int) override {}

  void addContactPoint(const btVector3& normal, const btVector3& point, btScalar depth) override {
    if (ahead_ == 0.0) return result_.addContactPoint(normal, point, depth);
    const btScalar larger_a = ahead_ * (normal * X_WA_.getBasis()).absolute().dot({1, 1, 1}),
                   larger_b = ahead_ * (normal * X_WB_.getBasis()).absolute().dot({1, 1, 1});
    const btScalar gap = depth + larger_a + larger_b;
    btVector3 on_b = point - larger_b * normal;
    btScalar beside = 0.0;
    for (int round = 0; round < 3; ++round) {
      move_beside(X_WB_, half_b_, normal, on_b, on_b);
      beside = move_beside(X_WA_, half_a_, normal, on_b + gap * normal, on_b);
    }
    if (beside < kBeside_m) result_.addContactPoint(normal, on_b, gap);
  }

 private:
  // Moves a point tangentially so that `at` lies in the box. Returns the distance moved.
  static btScalar move_beside(const btTransform& X_WS, const btVector3& half,
                              const btVector3& normal, const btVector3& at, btVector3& point) {
    btVector3 local = X_WS.invXform(at);
    local.setMax(-half);
    local.setMin(half);
    btVector3 move = X_WS * local - at;
    move -= normal * normal.dot(move);
    point += move;
    return move.length();
  }

  const btTransform &X_WA_, &X_WB_;
  const btVector3 half_a_, half_b_;
  const btScalar ahead_;
  btManifoldResult& result_;
};

// A robot that its drive moves along a plane touches only shapes that it overlaps.
bool moves_along_plane(const btCollisionObjectWrapper& box) {
  const auto* body = btRigidBody::upcast(box.getCollisionObject());
  return body && body->getLinearFactor().z() == 0.0;
}

// Margins round the edges of boxes and cylinders, which may be nearer by this than closest points.
double rounded_off(const btConvexShape& shape) {
  constexpr double kOfACorner = 0.7321;  // sqrt(3) - 1
  const int type = shape.getShapeType();
  const bool has_edges = type == BOX_SHAPE_PROXYTYPE || type == CYLINDER_SHAPE_PROXYTYPE;
  return has_edges ? kOfACorner * shape.getMargin() : 0.0;
}

// Infinitely far apart: also the real edges are farther than `reach`.
ClosestPoints points_within(double reach, const PlacedShape& a, const PlacedShape& b) {
  return closest_points(a, b, reach + rounded_off(a.shape) + rounded_off(b.shape));
}

class BoxOnBox final : public Pair {
 public:
  using Pair::Pair;

 private:
  void collide(const btCollisionObjectWrapper& a, const btCollisionObjectWrapper& b,
               btManifoldResult& result) override {
    const auto half_of = [](const btCollisionObjectWrapper& box) {
      return static_cast<const btBoxShape&>(*box.getCollisionShape()).getHalfExtentsWithMargin();
    };
    const btScalar ahead = moves_along_plane(a) || moves_along_plane(b) ? 0.0 : kAhead_m;
    if (seen_ahead_m > kAhead_m) {
      const auto placed = [](const btCollisionObjectWrapper& box) {
        return PlacedShape{static_cast<const btConvexShape&>(*box.getCollisionShape()),
                           box.getWorldTransform()};
      };
      const ClosestPoints closest = points_within(seen_ahead_m, placed(a), placed(b));
      if (closest.distance > kAhead_m) {
        if (!closest.normal.isZero())
          result.addContactPoint(closest.normal, closest.on_b, closest.distance);
        return;
      }
    }
    const btVector3 more(ahead, ahead, ahead), half_a = half_of(a), half_b = half_of(b);
    const btBoxShape larger_a(half_a + more), larger_b(half_b + more);
    btDiscreteCollisionDetectorInterface::ClosestPointInput input;
    input.m_transformA = a.getWorldTransform();
    input.m_transformB = b.getWorldTransform();
    OnRealBoxes on_real(a.getWorldTransform(), half_a, b.getWorldTransform(), half_b, ahead,
                        result);
    btBoxBoxDetector(&larger_a, &larger_b).getClosestPoints(input, on_real, nullptr);
  }
};

// The closest points of two convex shapes, triangles of meshes too: Bullet finds none for things of
// millimetres. Overlapping shapes have none: then in the direction, of that which Bullet finds and
// those of their sides, in which they overlap least.
class ConvexOnConvex final : public Pair {
 public:
  using Pair::Pair;

 private:
  void collide(const btCollisionObjectWrapper& a, const btCollisionObjectWrapper& b,
               btManifoldResult& result) override {
    const auto& of_a = static_cast<const btConvexShape&>(*a.getCollisionShape());
    const auto& of_b = static_cast<const btConvexShape&>(*b.getCollisionShape());
    const btTransform &X_WA = a.getWorldTransform(), &X_WB = b.getWorldTransform();
    const double reach = is_driven(*a.getCollisionObject()) || is_driven(*b.getCollisionObject())
                             ? gContactBreakingThreshold
                             : seen_ahead_m;
    const ClosestPoints closest = points_within(reach, {of_a, X_WA}, {of_b, X_WB});
    if (std::isinf(closest.distance)) return;
    if (!closest.normal.isZero()) {
      const btScalar gap = closest.normal.dot(closest.on_a - closest.on_b);
      return result.addContactPoint(closest.normal, closest.on_b, gap);
    }
    Deepest deepest{of_a, of_b, X_WA, X_WB};
    deepest.ask_bullet();
    const btVector3 apart = center_before(a, substep_s) - center_before(b, substep_s);
    for_each_side(of_a, X_WA, -apart, [&](const btVector3& n) { deepest.look(-n); });
    for_each_side(of_b, X_WB, apart, [&](const btVector3& n) { deepest.look(n); });
    if (of_b.getShapeType() == TRIANGLE_SHAPE_PROXYTYPE) {
      for_each_side(of_b, X_WB, apart, [&](const btVector3& n) {
        if (n.dot(apart) > 0.0) deepest.prefer(n);
      });
    }
    result.addContactPoint(deepest.normal, deepest.on_b, deepest.gap);
  }

  struct Deepest final : btDiscreteCollisionDetectorInterface::Result {
    const btConvexShape &a, &b;
    const btTransform &X_WA, &X_WB;
    btVector3 normal{0, 0, 1}, on_b{0, 0, 0};
    btScalar gap = -BT_LARGE_FLOAT;

    Deepest(const btConvexShape& shape_a, const btConvexShape& shape_b, const btTransform& of_a,
            const btTransform& of_b)
        : a(shape_a), b(shape_b), X_WA(of_a), X_WB(of_b) {}
    void look(const btVector3& n) {
      const btVector3 on_a = farthest_point(a, X_WA, -n);
      const btScalar here = n.dot(on_a - farthest_point(b, X_WB, n));
      if (here <= gap) return;
      normal = n;
      on_b = on_a - here * n;
      gap = here;
    }
    // A triangle is part of a surface: an overlapping shape left the surface rather than passed the
    // edge.
    void prefer(const btVector3& n) {
      constexpr btScalar kRather = 2.0;
      const btScalar least = gap;
      gap *= kRather;
      look(n);
      if (normal != n) gap = least;
    }
    void ask_bullet() {
      btVoronoiSimplexSolver simplex;
      btGjkEpaPenetrationDepthSolver depth;
      btDiscreteCollisionDetectorInterface::ClosestPointInput input;
      input.m_transformA = X_WA;
      input.m_transformB = X_WB;
      btGjkPairDetector(&a, &b, &simplex, &depth).getClosestPoints(input, *this, nullptr);
    }
    void setShapeIdentifiersA(int, int) override {}
    void setShapeIdentifiersB(int, int) override {}
    void addContactPoint(const btVector3& n, const btVector3& point, btScalar) override {
      look(n);
      if (normal == n) on_b = point;
    }
  };
};

template <class Algorithm>
struct Create final : btCollisionAlgorithmCreateFunc {
  btCollisionAlgorithm* CreateCollisionAlgorithm(btCollisionAlgorithmConstructionInfo& info,
                                                 const btCollisionObjectWrapper* a,
                                                 const btCollisionObjectWrapper* b) override {
    void* memory = info.m_dispatcher1->allocateCollisionAlgorithm(sizeof(Algorithm));
    return new (memory) Algorithm(info, *a, *b);
  }
};

}  // namespace

void register_collisions(btCollisionDispatcher& dispatcher) {
  static Create<OnPlane<false, true>> box_plane;
  static Create<OnPlane<true, true>> plane_box;
  static Create<OnPlane<false, false>> cylinder_plane;
  static Create<OnPlane<true, false>> plane_cylinder;
  static Create<ConvexOnPlane<false>> convex_plane;
  static Create<ConvexOnPlane<true>> plane_convex;
  static Create<ConvexOnConvex> convex_convex;
  static Create<BoxOnBox> box_box;
  const auto set = [&](int a, int b, btCollisionAlgorithmCreateFunc& create) {
    dispatcher.registerCollisionCreateFunc(a, b, &create);
  };
  set(BOX_SHAPE_PROXYTYPE, STATIC_PLANE_PROXYTYPE, box_plane);
  set(STATIC_PLANE_PROXYTYPE, BOX_SHAPE_PROXYTYPE, plane_box);
  set(CYLINDER_SHAPE_PROXYTYPE, STATIC_PLANE_PROXYTYPE, cylinder_plane);
  set(STATIC_PLANE_PROXYTYPE, CYLINDER_SHAPE_PROXYTYPE, plane_cylinder);
  for (const int convex : {CAPSULE_SHAPE_PROXYTYPE, CONE_SHAPE_PROXYTYPE,
                           CONVEX_HULL_SHAPE_PROXYTYPE, CUSTOM_CONVEX_SHAPE_TYPE}) {
    set(convex, STATIC_PLANE_PROXYTYPE, convex_plane);
    set(STATIC_PLANE_PROXYTYPE, convex, plane_convex);
  }
  constexpr std::array kConvex{BOX_SHAPE_PROXYTYPE,         CYLINDER_SHAPE_PROXYTYPE,
                               CAPSULE_SHAPE_PROXYTYPE,     CONE_SHAPE_PROXYTYPE,
                               CONVEX_HULL_SHAPE_PROXYTYPE, CUSTOM_CONVEX_SHAPE_TYPE,
                               TRIANGLE_SHAPE_PROXYTYPE};
  for (const int a : kConvex) {
    for (const int b : kConvex) set(a, b, convex_convex);
  }
  set(BOX_SHAPE_PROXYTYPE, BOX_SHAPE_PROXYTYPE, box_box);
}

}  // namespace ruedo::physics
