// The contact points of a pair, all of a substep and no others.
//
// Bullet keeps points from substep to substep while they stay within a distance, and takes two
// within it for one. No distance fits a robot and a screw; and a point that was between two shapes
// lifts the one that rolled on, so that it would roll faster and faster. Here the points of a
// substep replace those before, which only hand on their impulses.
#pragma once

#include <vector>

#include "physics/base/bullet.h"
#include "physics/collision/faces.h"

namespace ruedo::physics {

// A body that a kinematic drive moves touches only shapes that it overlaps, and keeps Bullet's
// points while it passes over edges: they are its ground. The world marks such bodies.
inline bool is_driven(const btCollisionObject& object) { return object.getHitFraction() == 0.0; }

class ContactPoints : public btManifoldResult {
 public:
  // Reused, so that contacts do not allocate.
  struct Scratch {
    struct Found {
      btPersistentManifold* manifold;
      btManifoldPoint point;
      btScalar gap_then;  // at the end of the substep, at the present velocities
    };
    std::vector<Found> found;
    std::vector<TouchingPoint> touching;
    btManifoldArray manifolds;
    btScalar substep_s = 0.0;
  };

  ContactPoints(const btCollisionObjectWrapper& a, const btCollisionObjectWrapper& b,
                Scratch& scratch)
      : btManifoldResult(&a, &b), scratch_(scratch) {
    scratch_.found.clear();
  }

  // B is the manifold's second object, whichever of the two it is.
  void addContactPoint(const btVector3& normal_on_b, const btVector3& point_on_b,
                       btScalar depth) final;
  // To be called after the pair's algorithm.
  void finish(btCollisionAlgorithm& algorithm);

 private:
  struct Placed;
  struct Touch;
  // Whether a contact that is not of a side is one of these two shapes.
  virtual bool belongs(const btVector3& /*normal_on_b*/, const btVector3& /*point_on_b*/,
                       btScalar /*gap*/) const {
    return true;
  }
  // Whether the two meet on their way in this substep; then touch is where.
  bool meet_later(const Placed& a, const Placed& b, Touch& touch) const;
  void find_better_normal(const Placed& a, const Placed& b, Touch& touch) const;
  bool find_above_triangle(const Placed& a, const Placed& b, Touch& touch) const;
  void add(const btVector3& normal_on_b, const btVector3& point_on_b, btScalar gap);
  Scratch& scratch_;
};

// Replaces Bullet's near callback: finds the contacts of a pair.
// In a substep of info.m_timeStep.
void collide(btBroadphasePair& pair, btDispatcher& dispatcher, const btDispatcherInfo& info,
             ContactPoints::Scratch& scratch);

}  // namespace ruedo::physics
