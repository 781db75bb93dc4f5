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
    keep_below_the_axle();
    calculateSimulationIslands();
    getSolverInfo().m_timeStep = substep_s;
    solveConstraints(getSolverInfo());
    integrateTransforms(substep_s);
    updateActivationState(substep_s);
    clearForces();
  }

 private:
  // Bullet finds one contact of a lying cylinder a substep, at one of its ends, and keeps what it found at the other. Those
  // points roll with the cylinder, to behind its axle, and lift it from there: it would roll faster and faster. So they are
  // moved back to below the axle.
  void keep_below_the_axle() {
    for (int i = 0; i < getDispatcher()->getNumManifolds(); ++i) {
      btPersistentManifold& manifold = *getDispatcher()->getManifoldByIndexInternal(i);
      for (int k = 0; k < manifold.getNumContacts(); ++k) {
        btManifoldPoint& point = manifold.getContactPoint(k);
        keep_below_the_axle(*manifold.getBody0(), *manifold.getBody1(), point, point.m_index0, -point.m_normalWorldOnB,
                            point.m_positionWorldOnA, point.m_localPointA, point.m_positionWorldOnB, point.m_localPointB);
        keep_below_the_axle(*manifold.getBody1(), *manifold.getBody0(), point, point.m_index1, point.m_normalWorldOnB,
                            point.m_positionWorldOnB, point.m_localPointB, point.m_positionWorldOnA, point.m_localPointA);
      }
    }
  }

  // `outward` is the contact's normal away from `body`; p and q are the contact's points on the body and on the other one.
  static void keep_below_the_axle(const btCollisionObject& body, const btCollisionObject& other, btManifoldPoint& point, int child,
                                  const btVector3& outward, btVector3& p_W, btVector3& p_Body, btVector3& q_W, btVector3& q_Other) {
    const btCollisionShape* shape = body.getCollisionShape();
    btTransform X_WS = body.getWorldTransform();
    if (shape->isCompound()) {
      const auto& compound = static_cast<const btCompoundShape&>(*shape);
      if (child < 0 || child >= compound.getNumChildShapes()) return;
      shape = compound.getChildShape(child);
      X_WS = X_WS * compound.getChildTransform(child);
    }
    if (shape->getShapeType() != CYLINDER_SHAPE_PROXYTYPE) return;
    const btVector3 axis = X_WS.getBasis().getColumn(2);
    const btVector3 down = outward - outward.dot(axis) * axis;
    constexpr btScalar kLying = 0.7;    // of a unit normal across the axis
    if (down.length2() < kLying * kLying) return;
    const btScalar radius = static_cast<const btCylinderShapeZ*>(shape)->getRadius();
    const btVector3 moved = X_WS.getOrigin() + (p_W - X_WS.getOrigin()).dot(axis) * axis + radius * down.normalized();
    btVector3 along = moved - p_W;
    if (along.length2() > gContactBreakingThreshold * gContactBreakingThreshold) return;
    along -= along.dot(outward) * outward;
    p_W = moved;
    q_W += along;
    p_Body = body.getWorldTransform().invXform(p_W);
    q_Other = other.getWorldTransform().invXform(q_W);
    point.m_distance1 = (q_W - p_W).dot(outward);
  }
};

}  // namespace ruedo::physics
