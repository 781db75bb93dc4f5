// Bullet's dynamics world with a step of our own: only bodies that need it take part, island by
// island.
//
// Bullet's stepSimulation visits every object of the world several times; with a thousand robots
// that touch nothing, that is most of its cost. It also solves islands together, in an order that
// depends on other bodies; here an island's bits depend on its own bodies alone.
#pragma once

#include <functional>
#include <vector>

#include "physics/base/bullet.h"
#include "physics/collision/broadphase.h"
#include "physics/collision/contact_points.h"
#include "physics/dynamics/solver.h"
#include "ruedo/state_archive.h"

namespace ruedo::physics {

class Dynamics final : public btDiscreteDynamicsWorld {
 public:
  Dynamics(btDispatcher& dispatcher, Broadphase& broadphase,
           btCollisionConfiguration& configuration, const ContactSurfaces& surfaces,
           const SolverSettings& settings);

  // Reserves capacity for that many bodies and their usual contacts: up to there substeps do not
  // allocate.
  void reserve(size_t bodies);

  // Selects the bodies that are simulated from now on, with all that contacts and joints could move
  // with one of them.
  void set_bodies(const std::vector<btRigidBody*>& bodies);

  // Takes the state of another copy of the world that has the same pairs in the same order, as far
  // as Bullet keeps any. All objects must be awake. joint_here maps the other world's joints to
  // those of this one.
  void copy_from(const Dynamics& other,
                 const std::function<btTypedConstraint*(btTypedConstraint*)>& joint_here);
  // Writes that state, or reads it, likewise. joints: all of the world's, in an order that copies
  // share.
  void exchange(StateArchive& archive, const std::vector<btTypedConstraint*>& joints);

  // One substep: forces and gravity, contacts, velocities, poses.
  void substep(double substep_s);

  // Of the simulated bodies, those that touch something or are near it, in a fixed order.
  const std::vector<btPersistentManifold*>& manifolds() const { return manifolds_; }

 private:
  struct Island {
    std::vector<btRigidBody*> bodies;
    std::vector<btPersistentManifold*> manifolds;
    std::vector<btTypedConstraint*> joints;
  };

  void find_manifolds();
  size_t root(size_t body);
  void join(const btCollisionObject& a, const btCollisionObject& b);
  void find_islands();
  Island& island_of(const btCollisionObject& a, const btCollisionObject& b);
  void solve(Island& island, double substep_s);

  Broadphase& near_;
  Solver solver_;
  std::vector<btRigidBody*> bodies_;
  std::vector<btBroadphasePair*> pairs_;  // of bodies_, ordered by their numbers
  std::vector<btPersistentManifold*> manifolds_;
  std::vector<btTypedConstraint*> joints_;
  btManifoldArray of_pair_;  // scratch
  ContactPoints::Scratch scratch_;
  std::vector<size_t> parents_, island_of_root_;  // union-find over bodies_
  std::vector<Island> islands_;
  size_t island_count_ = 0;
};

}  // namespace ruedo::physics
