// Bullet's dynamics world, stepped by us: only the bodies that need it take part.
//
// Bullet's own stepSimulation goes over every object of the world several times; with a thousand robots that touch
// nothing, that is most of its cost.
#pragma once

#include <vector>

#include "physics/bullet.h"

namespace ruedo::physics {

class Dynamics final : public btDiscreteDynamicsWorld {
 public:
  using btDiscreteDynamicsWorld::btDiscreteDynamicsWorld;

  // From now on only these objects are simulated. All bodies of all pairs and joints must be among them.
  void take(const std::vector<btRigidBody*>& bodies) {
    m_collisionObjects.resizeNoInitialize(0);
    m_nonStaticRigidBodies.resizeNoInitialize(0);
    for (btRigidBody* body : bodies) {
      m_collisionObjects.push_back(body);
      m_nonStaticRigidBodies.push_back(body);
    }
  }

  // One substep: forces and gravity to contacts, contacts to velocities, velocities to poses. Pairs are up to date.
  void substep(double substep_s) {
    applyGravity();
    predictUnconstraintMotion(substep_s);
    getDispatchInfo().m_timeStep = substep_s;
    getDispatcher()->dispatchAllCollisionPairs(getPairCache(), getDispatchInfo(), getDispatcher());
    calculateSimulationIslands();
    getSolverInfo().m_timeStep = substep_s;
    solveConstraints(getSolverInfo());
    integrateTransforms(substep_s);
    updateActivationState(substep_s);
    clearForces();
  }
};

}  // namespace ruedo::physics
