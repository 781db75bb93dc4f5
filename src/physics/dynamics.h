// Bullet's dynamics world, stepped by us: only the bodies that need it take part, island by island.
//
// Bullet's own stepSimulation goes over every object of the world several times; with a thousand
// robots that touch nothing, that is most of its cost. It also solves islands together, and in an
// order that others decide; here an island's bits depend on its own bodies alone.
#pragma once

#include <functional>
#include <vector>

#include "physics/bullet.h"
#include "physics/solver.h"

namespace ruedo::physics {

class Dynamics final : public btDiscreteDynamicsWorld {
 public:
  Dynamics(btDispatcher& dispatcher, btBroadphaseInterface& broadphase,
           btCollisionConfiguration& configuration, const ContactSurfaces& surfaces,
           const SolverSettings& settings);

  // Room for so many bodies and what they usually touch: until there is more, substeps allocate
  // nothing.
  void reserve(size_t bodies);

  // From now on only these bodies are simulated. All bodies of all pairs and joints must be among
  // them.
  void take(const std::vector<btRigidBody*>& bodies);
  bool awake() const;  // one of them is

  // Becomes what it is in another copy of the world, whose pairs are the same in the same order:
  // what Bullet keeps of them. All objects must be awake. joint_here: the joint that one of the
  // other's is here.
  void take(const Dynamics& other,
            const std::function<btTypedConstraint*(btTypedConstraint*)>& joint_here);

  // One substep: forces and gravity to contacts, contacts to velocities, velocities to poses.
  void substep(double substep_s);

  // Of the bodies that take part, those that touch or are near, in a fixed order.
  const std::vector<btPersistentManifold*>& manifolds() const { return manifolds_; }
  void find_manifolds();

 private:
  struct Island {
    std::vector<btRigidBody*> bodies;
    std::vector<btPersistentManifold*> manifolds;
    std::vector<btTypedConstraint*> joints;
  };

  size_t root(size_t body);
  void join(const btCollisionObject& a, const btCollisionObject& b);
  void find_islands();
  Island& island_of(const btCollisionObject& a, const btCollisionObject& b);
  void solve(Island& island, double substep_s);
  void keep_below_the_axle(btPersistentManifold& manifold);

  Solver solver_;
  std::vector<btRigidBody*> bodies_;
  std::vector<btBroadphasePair*> pairs_;  // of bodies_, in the order of their numbers
  std::vector<btPersistentManifold*> manifolds_;
  std::vector<btTypedConstraint*> joints_;
  std::vector<size_t> parents_, island_of_root_;  // union-find over bodies_
  std::vector<Island> islands_;
  size_t island_count_ = 0;
};

}  // namespace ruedo::physics
