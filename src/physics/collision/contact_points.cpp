// Points are collected, reduced to four for each two shapes, and matched with those before.
#include "physics/collision/contact_points.h"

#include <algorithm>
#include <array>

#include "physics/collision/closest_points.h"
#include "physics/collision/collisions.h"
#include "physics/collision/convex_shapes.h"
#include "physics/collision/mesh_edges.h"

namespace ruedo::physics {

namespace {

constexpr btScalar kFartherThanFirst_m = 1e-6;
// A side's normal is preferred to the closest points' unless these are farther apart by more.
constexpr btScalar kAsGood_m = 1e-7;
// Two points are one within this distance, and this part of the distance of the farthest.
constexpr btScalar kOnePlace_m = 1e-5, kOnePlace = 1e-3;
// A point has moved at most so far since the last substep, of the distance of the farthest.
constexpr btScalar kMoved = 0.3;
// Points so much higher than the lowest bear as much as it does, of that distance.
constexpr btScalar kLevel = 1e-3;
// Normals that differ by rounding: the cosine.
constexpr btScalar kRounded = 1.0 - 1e-8;

using Found = ContactPoints::Scratch::Found;

btScalar away(const btManifoldPoint& a, const btManifoldPoint& b) {
  return (a.m_positionWorldOnB - b.m_positionWorldOnB).length();
}

btScalar spread_of(const Found* points, size_t count) {
  btScalar spread = 0.0;
  for (size_t i = 1; i < count; ++i)
    spread = std::max(spread, away(points[i].point, points[0].point));
  return spread;
}

// Leaves one of those in the same place, the deepest.
size_t without_doubles(Found* points, size_t count, btScalar near) {
  size_t kept = 0;
  for (size_t i = 0; i < count; ++i) {
    size_t k = 0;
    while (k < kept && away(points[i].point, points[k].point) > near) ++k;
    if (k == kept) {
      points[kept++] = points[i];
    } else if (points[i].point.m_distance1 < points[k].point.m_distance1) {
      points[k] = points[i];
    }
  }
  return kept;
}

// Moves to `to` whichever of the points from there on has most of it.
template <class Of>
void choose(Found* points, size_t to, size_t count, Of&& of) {
  size_t best = to;
  btScalar most = of(points[to].point);
  for (size_t i = to + 1; i < count; ++i) {
    const btScalar here = of(points[i].point);
    if (here > most + kFartherThanFirst_m * kFartherThanFirst_m) best = i, most = here;
  }
  std::rotate(points + to, points + best, points + best + 1);
}

// Puts those four first that enclose the most of what may touch in this substep, among them those
// that would be lowest at its end. Where fewer than four are as low as that, these, and of the
// others those far from them.
void choose_four(Found* points, size_t count, btScalar level) {
  std::stable_sort(points, points + count,
                   [](const Found& a, const Found& b) { return a.gap_then < b.gap_then; });
  const btScalar lowest = points[0].gap_then;
  const auto below = [&](btScalar height) {
    return static_cast<size_t>(
        std::find_if(points, points + count,
                     [&](const Found& found) { return found.gap_then > height; }) -
        points);
  };
  const size_t low = below(lowest + level), near = below(lowest + level + seen_ahead_m);
  if (low < MANIFOLD_CACHE_SIZE) {
    for (size_t to = low; to < std::min(near, size_t{MANIFOLD_CACHE_SIZE}); ++to) {
      choose(points, to, near, [&](const btManifoldPoint& p) {
        btScalar least = BT_LARGE_FLOAT;
        for (size_t i = 0; i < to; ++i)
          least = std::min(least,
                           (p.m_positionWorldOnB - points[i].point.m_positionWorldOnB).length2());
        return least;
      });
    }
    return;
  }
  const auto at = [points](size_t i) { return points[i].point.m_positionWorldOnB; };
  // The lowest may lie on a line, or all at one end: what is a little higher would fall.
  if (near == low) {
    btVector3 middle(0, 0, 0);
    for (size_t i = 0; i < low; ++i) middle += at(i) / static_cast<btScalar>(low);
    choose(points, 0, low,
           [&](const btManifoldPoint& p) { return (p.m_positionWorldOnB - middle).length2(); });
  }
  choose(points, 1, near,
         [&](const btManifoldPoint& p) { return (p.m_positionWorldOnB - at(0)).length2(); });
  const btVector3 n = points[0].point.m_normalWorldOnB, across = n.cross(at(1) - at(0));
  choose(points, 2, near, [&](const btManifoldPoint& p) {
    return btFabs(across.dot(p.m_positionWorldOnB - at(0)));
  });
  const btScalar side = across.dot(at(2) - at(0)) < 0.0 ? -1.0 : 1.0;
  choose(points, 3, near, [&](const btManifoldPoint& p) {
    return -side * across.dot(p.m_positionWorldOnB - at(0));
  });
}

void inherit(btManifoldPoint& point, const btManifoldPoint& from) {
  point.m_appliedImpulse = from.m_appliedImpulse;
  point.m_appliedImpulseLateral1 = from.m_appliedImpulseLateral1;
  point.m_appliedImpulseLateral2 = from.m_appliedImpulseLateral2;
  point.m_lateralFrictionDir1 = from.m_lateralFrictionDir1;
  point.m_lateralFrictionDir2 = from.m_lateralFrictionDir2;
  substep_of(point) = substep_of(from);
  point.m_lifeTime = from.m_lifeTime;
}

// Each of the old points hands its impulses to the nearest new one.
void hand_on(const btPersistentManifold& old, Found* points, size_t count, btScalar within) {
  std::array<bool, MANIFOLD_CACHE_SIZE> used{};
  for (size_t i = 0; i < count; ++i) {
    btManifoldPoint& point = points[i].point;
    int nearest = -1;
    btScalar least = within * within;
    for (int k = 0; k < old.getNumContacts(); ++k) {
      const btManifoldPoint& before = old.getContactPoint(k);
      const btScalar moved = std::min((before.m_localPointA - point.m_localPointA).length2(),
                                      (before.m_localPointB - point.m_localPointB).length2());
      if (!used[static_cast<size_t>(k)] && moved < least) nearest = k, least = moved;
    }
    if (nearest < 0) continue;
    used[static_cast<size_t>(nearest)] = true;
    inherit(point, old.getContactPoint(nearest));
  }
}

void replace(btPersistentManifold& manifold, Found* points, size_t count) {
  const btScalar spread = spread_of(points, count);
  count = without_doubles(points, count, kOnePlace_m + kOnePlace * spread);
  if (count > MANIFOLD_CACHE_SIZE) choose_four(points, count, kLevel * spread);
  count = std::min(count, size_t{MANIFOLD_CACHE_SIZE});
  hand_on(manifold, points, count, count > 1 ? std::min(kReach_m, kMoved * spread) : kReach_m);
  manifold.clearManifold();
  for (size_t i = 0; i < count; ++i) manifold.addManifoldPoint(points[i].point);
}

// Boxes that touch boxes, and what lies on a plane, come with all their points.
bool meet_with_sides(const btCollisionShape& a, const btCollisionShape& b, btScalar gap) {
  const bool boxes =
      a.getShapeType() == BOX_SHAPE_PROXYTYPE && b.getShapeType() == BOX_SHAPE_PROXYTYPE;
  return a.isConvex() && b.isConvex() &&
         !(boxes && gap <= kSeenAhead_m && seen_ahead_m <= kSeenAhead_m);
}

btVector3 velocity_of(const btCollisionObject& object) {
  const auto* body = btRigidBody::upcast(&object);
  return body ? body->getLinearVelocity() : btVector3(0, 0, 0);
}

// How far its surface may move in a second due to its rotation.
btScalar swing_of(const btCollisionObject& object) {
  const auto* body = btRigidBody::upcast(&object);
  return body ? body->getAngularVelocity().length() * body->getCcdSweptSphereRadius() : 0.0;
}

btScalar weight_of(const btCollisionObject& object) {  // m/s^2
  const auto* body = btRigidBody::upcast(&object);
  return body ? body->getGravity().length() : 0.0;
}

// How far the two may come nearer to each other in a substep.
btScalar ahead_of(const btCollisionObject& a, const btCollisionObject& b, btScalar substep_s) {
  if (is_driven(a) || is_driven(b)) return kSeenAhead_m;
  const btScalar speed = (velocity_of(a) - velocity_of(b)).length() + swing_of(a) + swing_of(b),
                 fall = 0.5 * substep_s * std::max(weight_of(a), weight_of(b));
  return std::max(kSeenAhead_m, (speed + fall) * substep_s);
}

// Margins and enlarged boxes lead to contacts farther away than shapes are seen ahead, by less.
constexpr btScalar kSeenBeyond_m = 3e-3;

// Within what distance contacts are found: of planes and meshes, all that Bullet keeps.
btScalar reach_of(const btCollisionObject& a, const btCollisionObject& b, btScalar ahead) {
  const auto is_solid = [](const btCollisionObject& object) {
    const btCollisionShape& shape = *object.getCollisionShape();
    return shape.isConvex() || (shape.isCompound() && !object.isStaticObject());
  };
  return is_solid(a) && is_solid(b) ? ahead + kSeenBeyond_m : std::max(kReach_m, ahead);
}

// Whether their boxes are farther apart than that.
bool apart(const btCollisionObject& a, const btCollisionObject& b, btScalar by) {
  btVector3 low_a, high_a, low_b, high_b;
  a.getCollisionShape()->getAabb(a.getWorldTransform(), low_a, high_a);
  b.getCollisionShape()->getAabb(b.getWorldTransform(), low_b, high_b);
  btVector3 gap = low_a - high_b;
  gap.setMax(low_b - high_a);
  return gap[gap.maxAxis()] > by;
}

void forget_contacts(btCollisionAlgorithm& algorithm, btManifoldArray& manifolds) {
  manifolds.resizeNoInitialize(0);
  algorithm.getAllContactManifolds(manifolds);
  for (int i = 0; i < manifolds.size(); ++i) manifolds[i]->clearManifold();
}

void see_ahead(btCollisionObject& object, btScalar by) {
  if (object.getCollisionShape()->isCompound())
    static_cast<BodyShape&>(*object.getCollisionShape()).see_ahead(by);
}

}  // namespace

struct ContactPoints::Placed {
  const btCollisionObjectWrapper& wrapper;
  const btConvexShape& shape;
  const btTransform& X;
  const btCollisionObject& object;
  Face face;
  Placed(const btCollisionObjectWrapper& of, const btVector3& direction)
      : wrapper(of),
        shape(static_cast<const btConvexShape&>(*of.getCollisionShape())),
        X(of.getWorldTransform()),
        object(*of.getCollisionObject()),
        face(face_towards(shape, X, direction)) {}
  // A round side touches along a line; on one that is a little aside the shape would roll away.
  void turn(const btVector3& direction) {
    if (face.count == 2) face = face_towards(shape, X, direction);
  }
  btVector3 farthest(const btVector3& direction) const {
    return farthest_point(shape, X, direction);
  }
  // The shape's pose after a time at that velocity of its body, which goes on turning.
  btTransform moved(const btVector3& velocity, btScalar seconds) const {
    const auto* body = btRigidBody::upcast(&object);
    if (!body) return X;
    btTransform of_body;
    btTransformUtil::integrateTransform(body->getWorldTransform(), velocity,
                                        body->getAngularVelocity(), seconds, of_body);
    return of_body * body->getWorldTransform().inverseTimes(X);
  }
};

struct ContactPoints::Touch {
  btVector3 normal, on_b;
  btScalar gap;
  bool of_a_side;              // whether the normal is a side's
  bool of_a_triangle = false;  // ... of a mesh
};

// Of two overlapping shapes, and of shapes that nearly touch, the closest points found by Bullet
// have a normal that is off by rounding, for things of millimetres by anything. A side's own normal
// is exact, and better wherever it leaves the larger gap: that gap is how far apart they are.
void ContactPoints::find_better_normal(const Placed& a, const Placed& b, Touch& touch) const {
  const auto take = [&](btVector3 normal) {
    const btScalar length = normal.length();
    if (!(length > 0.0)) return false;
    normal /= length;
    const btVector3 on_a = a.farthest(-normal);
    const btScalar gap = normal.dot(on_a - b.farthest(normal));
    // Along the same normal it is exact; the closest points' edges are rounded.
    if (gap < touch.gap - kAsGood_m && normal.dot(touch.normal) < kRounded) return false;
    touch = {normal, on_a - gap * normal, gap, true};
    return true;
  };
  const btVector3 normal = touch.normal;
  if (a.face.count > 2) {
    const btVector3 outward = a.face.normal();
    take(outward.dot(normal) > 0.0 ? -outward : outward);
  }
  if (b.face.count <= 2) return;
  const btVector3 outward = b.face.normal();
  const bool triangle = b.shape.getShapeType() == TRIANGLE_SHAPE_PROXYTYPE;
  const btScalar side = outward.dot(
      triangle ? center_before(a.wrapper, scratch_.substep_s) - b.face.corners[0] : normal);
  if (take(side < 0.0 ? -outward : outward)) touch.of_a_triangle = triangle;
}

// The closest points of a body that leans over a triangle's edge belong to the triangle beyond it;
// what of the body is above this one still comes down on it.
bool ContactPoints::find_above_triangle(const Placed& a, const Placed& b, Touch& touch) const {
  constexpr btScalar kMostLean = 0.9;  // cosine
  if (b.shape.getShapeType() != TRIANGLE_SHAPE_PROXYTYPE) return false;
  btVector3 normal = b.face.normal();
  const btScalar along = normal.dot(touch.normal);
  if (btFabs(along) < kMostLean * normal.length()) return false;
  normal *= (along < 0.0 ? -1.0 : 1.0) / normal.length();
  touch.normal = normal;
  touch.of_a_triangle = true;
  scratch_.touching.clear();
  overlap(face_towards(a.shape, a.X, -normal), b.face, normal, scratch_.touching);
  return !scratch_.touching.empty();
}

// Conservative advancement (B. Mirtich, "Impulse-based dynamic simulation of rigid body systems",
// 1996).
bool ContactPoints::meet_later(const Placed& a, const Placed& b, Touch& touch) const {
  constexpr double kMet_m = 1e-4;
  constexpr int kMostRounds = 100;
  const btVector3 v = velocity_of(a.object) - velocity_of(b.object);
  const btScalar swing = swing_of(a.object) + swing_of(b.object);
  btTransform X_a = a.X, X_b = b.X;
  btScalar after_s = 0.0;
  for (int round = 0; round < kMostRounds; ++round) {
    const ClosestPoints closest = closest_points({a.shape, X_a}, {b.shape, X_b}, BT_LARGE_FLOAT);
    const btVector3& n = closest.normal;
    if (n.isZero()) return false;
    if (closest.distance <= kMet_m) {
      // The points that touch then, at their present places.
      const auto now = [&](const btVector3& on_b, btScalar gap) {
        const btVector3 b_now = b.X * X_b.invXform(on_b),
                        a_now = a.X * X_a.invXform(on_b + gap * n);
        return TouchingPoint{b_now, n.dot(a_now - b_now)};
      };
      const btScalar gap =
          n.dot(farthest_point(a.shape, X_a, -n) - farthest_point(b.shape, X_b, n));
      const TouchingPoint first = now(closest.on_b, gap);
      touch = {n, first.on_b, first.gap, false};
      overlap(face_towards(a.shape, X_a, -n), face_towards(b.shape, X_b, n), n, scratch_.touching);
      for (TouchingPoint& each : scratch_.touching) each = now(each.on_b, each.gap);
      return true;
    }
    const btScalar nearer = swing - v.dot(n);
    if (nearer <= 0.0) return false;
    after_s += closest.distance / nearer;
    if (after_s > scratch_.substep_s) return false;
    X_a = a.moved(v, after_s);
    X_b = b.moved({0, 0, 0}, after_s);
  }
  return false;
}

void ContactPoints::addContactPoint(const btVector3& normal_on_b, const btVector3& point_on_b,
                                    btScalar depth) {
  if (is_driven(*m_body0Wrap->getCollisionObject()) ||
      is_driven(*m_body1Wrap->getCollisionObject())) {
    if (belongs(normal_on_b, point_on_b, depth))
      btManifoldResult::addContactPoint(normal_on_b, point_on_b, depth);
    return;
  }
  const bool swapped = m_manifoldPtr->getBody0() != m_body0Wrap->getCollisionObject();
  const btCollisionObjectWrapper &a = swapped ? *m_body1Wrap : *m_body0Wrap,
                                 &b = swapped ? *m_body0Wrap : *m_body1Wrap;
  Touch touch{normal_on_b, point_on_b, depth, false};
  scratch_.touching.clear();
  if (meet_with_sides(*a.getCollisionShape(), *b.getCollisionShape(), depth)) {
    Placed of_a(a, -normal_on_b), of_b(b, normal_on_b);
    if (of_a.face.count > 1 && of_b.face.count > 1) {
      find_better_normal(of_a, of_b, touch);
      if (touch.normal.dot(normal_on_b) > kRounded) {
        of_a.turn(-touch.normal);
        of_b.turn(touch.normal);
      }
      overlap(of_a.face, of_b.face, touch.normal, scratch_.touching);
    }
  }
  const btScalar reach = std::max(kReach_m, seen_ahead_m);
  if (touch.gap > reach) return;
  if (touch.gap > kReach_m && a.getCollisionShape()->isConvex() &&
      b.getCollisionShape()->isConvex()) {
    scratch_.touching.clear();
    if (!meet_later({a, -normal_on_b}, {b, normal_on_b}, touch)) return;
  }
  if (!touch.of_a_side && !belongs(touch.normal, touch.on_b, touch.gap) &&
      !(b.getCollisionShape()->isConvex() &&
        find_above_triangle({a, -normal_on_b}, {b, normal_on_b}, touch)))
    return;
  bool first = false;  // whether the closest point is among them
  for (TouchingPoint& touching : scratch_.touching) {
    touching.gap = std::max(touching.gap, touch.gap);
    first |= touching.gap <= touch.gap + kFartherThanFirst_m;
  }
  // Beyond a triangle's edges is another triangle, or nothing.
  if (!first && (!touch.of_a_triangle || scratch_.touching.empty()))
    add(touch.normal, touch.on_b, touch.gap);
  for (const TouchingPoint& touching : scratch_.touching)
    if (touching.gap <= reach) add(touch.normal, touching.on_b, touching.gap);
}

void ContactPoints::add(const btVector3& normal_on_b, const btVector3& point_on_b, btScalar gap) {
  const bool swapped = m_manifoldPtr->getBody0() != m_body0Wrap->getCollisionObject();
  const btVector3 point_on_a = point_on_b + normal_on_b * gap;
  btManifoldPoint point(m_manifoldPtr->getBody0()->getWorldTransform().invXform(point_on_a),
                        m_manifoldPtr->getBody1()->getWorldTransform().invXform(point_on_b),
                        normal_on_b, gap);
  point.m_positionWorldOnA = point_on_a;
  point.m_positionWorldOnB = point_on_b;
  point.m_index0 = swapped ? m_index1 : m_index0;
  point.m_index1 = swapped ? m_index0 : m_index1;
  point.m_partId0 = swapped ? m_partId1 : m_partId0;
  point.m_partId1 = swapped ? m_partId0 : m_partId1;
  const auto velocity = [&](const btCollisionObject& object, const btVector3& at) {
    const auto* body = btRigidBody::upcast(&object);
    return body ? body->getVelocityInLocalPoint(at - body->getCenterOfMassPosition())
                : btVector3(0, 0, 0);
  };
  const btVector3 opening =
      velocity(*(swapped ? m_body1Wrap : m_body0Wrap)->getCollisionObject(), point_on_a) -
      velocity(*(swapped ? m_body0Wrap : m_body1Wrap)->getCollisionObject(), point_on_b);
  scratch_.found.push_back(
      {m_manifoldPtr, point, gap + scratch_.substep_s * opening.dot(normal_on_b)});
}

void ContactPoints::finish(btCollisionAlgorithm& algorithm) {
  scratch_.manifolds.resizeNoInitialize(0);
  algorithm.getAllContactManifolds(scratch_.manifolds);
  std::vector<Found>& found = scratch_.found;
  for (int i = 0; i < scratch_.manifolds.size(); ++i) {
    btPersistentManifold& manifold = *scratch_.manifolds[i];
    manifold.setContactBreakingThreshold(gContactBreakingThreshold);
    const auto first = std::find_if(found.begin(), found.end(),
                                    [&](const Found& each) { return each.manifold == &manifold; });
    const auto end = std::find_if(first, found.end(),
                                  [&](const Found& each) { return each.manifold != &manifold; });
    if (first == end) {
      manifold.clearManifold();
    } else {
      replace(manifold, &*first, static_cast<size_t>(end - first));
    }
  }
}

void collide(btBroadphasePair& pair, btDispatcher& dispatcher, const btDispatcherInfo& info,
             ContactPoints::Scratch& scratch) {
  auto& a = *static_cast<btCollisionObject*>(pair.m_pProxy0->m_clientObject);
  auto& b = *static_cast<btCollisionObject*>(pair.m_pProxy1->m_clientObject);
  if (!dispatcher.needsCollision(&a, &b)) return;
  const btCollisionObjectWrapper of_a(nullptr, a.getCollisionShape(), &a, a.getWorldTransform(), -1,
                                      -1);
  const btCollisionObjectWrapper of_b(nullptr, b.getCollisionShape(), &b, b.getWorldTransform(), -1,
                                      -1);
  const btScalar ahead = ahead_of(a, b, info.m_timeStep);
  // The broad phase's pairs are those within decimetres: of small things, all.
  if (!is_driven(a) && !is_driven(b) && apart(a, b, reach_of(a, b, ahead))) {
    if (pair.m_algorithm) forget_contacts(*pair.m_algorithm, scratch.manifolds);
    return;
  }
  if (!pair.m_algorithm)
    pair.m_algorithm = dispatcher.findAlgorithm(&of_a, &of_b, nullptr, BT_CONTACT_POINT_ALGORITHMS);
  if (!pair.m_algorithm) return;
  scratch.substep_s = info.m_timeStep;
  seen_ahead_m = ahead;
  see_ahead(a, seen_ahead_m);
  see_ahead(b, seen_ahead_m);
  if (seen_ahead_m > kReach_m) {
    scratch.manifolds.resizeNoInitialize(0);
    pair.m_algorithm->getAllContactManifolds(scratch.manifolds);
    for (int i = 0; i < scratch.manifolds.size(); ++i)
      scratch.manifolds[i]->setContactBreakingThreshold(seen_ahead_m);
  }
  const auto find = [&](ContactPoints&& points) {
    pair.m_algorithm->processCollision(&of_a, &of_b, info, &points);
    if (!is_driven(a) && !is_driven(b)) points.finish(*pair.m_algorithm);
  };
  if (is_mesh(a) || is_mesh(b)) {
    find(MeshContacts(of_a, of_b, is_mesh(a) ? a : b, scratch));
  } else {
    find(ContactPoints(of_a, of_b, scratch));
  }
  seen_ahead_m = kSeenAhead_m;
}

}  // namespace ruedo::physics
