// From pairs to manifolds to islands, which are solved and put to sleep.
#include "physics/dynamics/dynamics.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

#include "physics/collision/contact_copies.h"

namespace ruedo::physics {

namespace {

constexpr size_t kTouchingABody = 8;  // expected maximum
// An island falls asleep after 2 s at low speed and within this distance of one place.
constexpr btScalar kStays_m = 5e-5, kStays_rad = 5e-5;
// A motor with a faster target keeps its bodies awake; m/s or rad/s.
constexpr double kTold = 1e-6;

// Bullet's island tag is a body's index in bodies_; negative for bodies that do not take part.
bool takes_part(const btCollisionObject& object) { return object.getIslandTag() >= 0; }
size_t number(const btCollisionObject& object) {
  return static_cast<size_t>(object.getIslandTag());
}
// Whether the solver may move it: movers and walls do not connect islands.
bool can_be_moved(const btCollisionObject& object) {
  return takes_part(object) && !object.isStaticOrKinematicObject();
}

bool asleep(const btRigidBody& body) { return body.getActivationState() == ISLAND_SLEEPING; }

bool moves(const btCollisionObject& object) {
  const auto* body = btRigidBody::upcast(&object);
  return body && body->isKinematicObject() &&
         !(body->getLinearVelocity().isZero() && body->getAngularVelocity().isZero());
}

// Bullet counts how long a body is slow. A body that moves on slowly does not rest: the count
// restarts, at a new place, which Bullet's interpolated pose stores.
bool rests(btRigidBody& body, double substep_s) {
  body.updateDeactivation(substep_s);
  const btTransform &X = body.getWorldTransform(), &before = body.getInterpolationWorldTransform();
  btScalar turned2 = 0.0;  // twice the square of the angle
  for (int axis = 0; axis < 3; ++axis)
    turned2 += (X.getBasis().getColumn(axis) - before.getBasis().getColumn(axis)).length2();
  if ((X.getOrigin() - before.getOrigin()).length2() > kStays_m * kStays_m ||
      turned2 > 2 * kStays_rad * kStays_rad) {
    body.setInterpolationWorldTransform(X);
    body.setDeactivationTime(0.0);
  }
  return body.wantsSleeping();
}

bool is_told_to_move(btTypedConstraint& joint) {
  const auto* motors = static_cast<const JointMotors*>(joint.getUserConstraintPtr());
  const auto told = [](const JointMotor& motor) {
    return motor.on && std::abs(motor.rate) > kTold && motor.upper > 0.0;
  };
  return motors && (told(motors->first) || told(motors->second));
}

bool moves_at_all(const btRigidBody& body) {
  return !body.getLinearVelocity().isZero() || !body.getAngularVelocity().isZero();
}

int id_of(const btCollisionObject& object) { return object.getBroadphaseHandle()->m_uniqueId; }

std::tuple<int, int, int, int> place_of(const btPersistentManifold& manifold) {
  const btManifoldPoint& first = manifold.getContactPoint(0);
  return {id_of(*manifold.getBody0()), id_of(*manifold.getBody1()), first.m_index0, first.m_index1};
}

}  // namespace

Dynamics::Dynamics(btDispatcher& dispatcher, Broadphase& broadphase,
                   btCollisionConfiguration& configuration, const ContactSurfaces& surfaces,
                   const SolverSettings& settings)
    : btDiscreteDynamicsWorld(&dispatcher, &broadphase, nullptr, &configuration),
      near_(broadphase),
      solver_(surfaces, settings) {}

void Dynamics::reserve(size_t bodies) {
  bodies_.reserve(bodies);
  parents_.reserve(bodies);
  island_of_root_.reserve(bodies);
  pairs_.reserve(kTouchingABody * bodies);
  manifolds_.reserve(kTouchingABody * bodies);
  islands_.resize(std::max(islands_.size(), bodies));
  for (Island& island : islands_) {
    island.bodies.reserve(kTouchingABody);
    island.manifolds.reserve(kTouchingABody);
  }
}

void Dynamics::set_bodies(const std::vector<btRigidBody*>& bodies) {
  m_collisionObjects.resizeNoInitialize(0);  // Bullet's own lists are not used
  m_nonStaticRigidBodies.resizeNoInitialize(0);
  for (btRigidBody* body : bodies_) body->setIslandTag(-1);
  bodies_ = bodies;
  for (size_t i = 0; i < bodies_.size(); ++i) bodies_[i]->setIslandTag(static_cast<int>(i));
  pairs_.clear();
  manifolds_.clear();
  joints_.clear();
  if (bodies_.empty()) return;
  for (btRigidBody* body : bodies_) {
    if (body->isStaticOrKinematicObject()) continue;  // the other one of a pair can be moved
    near_.for_each_pair(body->getBroadphaseHandle(),
                        [&](btBroadphasePair& pair, const btCollisionObject& partner) {
                          if (!can_be_moved(partner) || number(*body) < number(partner))
                            pairs_.push_back(&pair);
                        });
  }
  std::sort(pairs_.begin(), pairs_.end(), [](const btBroadphasePair* a, const btBroadphasePair* b) {
    return std::pair(a->m_pProxy0->m_uniqueId, a->m_pProxy1->m_uniqueId) <
           std::pair(b->m_pProxy0->m_uniqueId, b->m_pProxy1->m_uniqueId);
  });
  for (int i = 0; i < m_constraints.size(); ++i) {
    btTypedConstraint& joint = *m_constraints[i];
    if (joint.isEnabled() &&
        (takes_part(joint.getRigidBodyA()) || takes_part(joint.getRigidBodyB())))
      joints_.push_back(&joint);
  }
}

void Dynamics::copy_from(const Dynamics& other,
                         const std::function<btTypedConstraint*(btTypedConstraint*)>& joint_here) {
  const auto& from =
      // as Bullet's interface has it
      const_cast<Dynamics&>(other).getPairCache()->getOverlappingPairArray();
  auto& to = getPairCache()->getOverlappingPairArray();
  for (int i = 0; i < to.size(); ++i)
    copy_contacts(from[i], to[i], *getDispatcher(), getDispatchInfo());
  for (int i = 0; i < m_constraints.size(); ++i)  // in solving order
    m_constraints[i] = joint_here(other.m_constraints[i]);
}

void Dynamics::exchange(StateArchive& archive, const std::vector<btTypedConstraint*>& joints) {
  auto& pairs = getPairCache()->getOverlappingPairArray();
  for (int i = 0; i < pairs.size(); ++i)
    exchange_contacts(archive, pairs[i], *getDispatcher(), getDispatchInfo());
  std::vector<size_t> order;
  for (int i = 0; i < m_constraints.size(); ++i) {
    const auto found = std::find(joints.begin(), joints.end(), m_constraints[i]);
    order.push_back(static_cast<size_t>(found - joints.begin()));
  }
  archive.each(order);
  for (int i = 0; i < m_constraints.size(); ++i) {
    const size_t number = order[static_cast<size_t>(i)];
    if (number >= joints.size()) archive.refuse("there is no such joint");
    m_constraints[i] = joints[number];
  }
}

void Dynamics::find_manifolds() {
  manifolds_.clear();
  for (const btBroadphasePair* pair : pairs_) {
    if (!pair->m_algorithm) continue;
    of_pair_.resizeNoInitialize(0);
    pair->m_algorithm->getAllContactManifolds(of_pair_);
    for (int i = 0; i < of_pair_.size(); ++i)
      if (of_pair_[i]->getNumContacts() > 0) manifolds_.push_back(of_pair_[i]);
  }
  std::sort(manifolds_.begin(), manifolds_.end(),
            [](const btPersistentManifold* a, const btPersistentManifold* b) {
              return place_of(*a) < place_of(*b);
            });
}

void Dynamics::substep(double substep_s) {
  for (btRigidBody* body : bodies_)
    if (body->isActive()) body->applyGravity();
  getDispatchInfo().m_timeStep = substep_s;
  for (btBroadphasePair* pair : pairs_)
    collide(*pair, *getDispatcher(), getDispatchInfo(), scratch_);
  find_manifolds();
  find_islands();
  for (size_t i = 0; i < island_count_; ++i) solve(islands_[i], substep_s);
  for (btRigidBody* body : bodies_) body->clearForces();
}

size_t Dynamics::root(size_t body) {
  while (parents_[body] != body) body = parents_[body] = parents_[parents_[body]];
  return body;
}

void Dynamics::join(const btCollisionObject& a, const btCollisionObject& b) {
  if (!can_be_moved(a) || !can_be_moved(b)) return;
  const size_t of_a = root(number(a)), of_b = root(number(b));
  parents_[std::max(of_a, of_b)] = std::min(of_a, of_b);
}

Dynamics::Island& Dynamics::island_of(const btCollisionObject& a, const btCollisionObject& b) {
  return islands_[island_of_root_[root(number(can_be_moved(a) ? a : b))]];
}

void Dynamics::find_islands() {
  parents_.resize(bodies_.size());
  std::iota(parents_.begin(), parents_.end(), size_t{0});
  for (const btPersistentManifold* manifold : manifolds_)
    join(*manifold->getBody0(), *manifold->getBody1());
  for (btTypedConstraint* joint : joints_) {
    join(joint->getRigidBodyA(), joint->getRigidBodyB());
    const auto* motors = static_cast<const JointMotors*>(joint->getUserConstraintPtr());
    if (!motors || !motors->first.reference) continue;
    join(*motors->first.reference, joint->getRigidBodyA());
    join(*motors->first.reference, joint->getRigidBodyB());
  }
  island_count_ = 0;
  island_of_root_.resize(bodies_.size());
  for (size_t i = 0; i < bodies_.size(); ++i) {
    if (!can_be_moved(*bodies_[i])) continue;
    const size_t of = root(i);  // the smallest number of the set
    if (of == i) {
      island_of_root_[i] = island_count_++;
      if (islands_.size() < island_count_) islands_.emplace_back();
      Island& island = islands_[island_of_root_[i]];
      island.bodies.clear();
      island.manifolds.clear();
      island.joints.clear();
    }
    islands_[island_of_root_[of]].bodies.push_back(bodies_[i]);
  }
  for (btPersistentManifold* manifold : manifolds_) {
    const btCollisionObject &a = *manifold->getBody0(), &b = *manifold->getBody1();
    if (can_be_moved(a) || can_be_moved(b)) island_of(a, b).manifolds.push_back(manifold);
  }
  for (btTypedConstraint* joint : joints_) {
    if (can_be_moved(joint->getRigidBodyA()) || can_be_moved(joint->getRigidBodyB())) {
      island_of(joint->getRigidBodyA(), joint->getRigidBodyB()).joints.push_back(joint);
    }
  }
}

void Dynamics::solve(Island& island, double substep_s) {
  // Movers take part with their velocity, and wake the bodies that they touch.
  bool awake = std::any_of(island.bodies.begin(), island.bodies.end(),
                           [](const btRigidBody* body) { return body->isActive(); });
  const size_t own = island.bodies.size();
  for (const btPersistentManifold* manifold : island.manifolds) {
    for (const btCollisionObject* object : {manifold->getBody0(), manifold->getBody1()}) {
      if (!moves(*object)) continue;
      awake = true;
      auto* mover = const_cast<btRigidBody*>(btRigidBody::upcast(object));
      if (std::find(island.bodies.begin() + static_cast<std::ptrdiff_t>(own), island.bodies.end(),
                    mover) == island.bodies.end())
        island.bodies.push_back(mover);
    }
  }
  if (!awake) return;
  for (size_t i = 0; i < own; ++i) {
    btRigidBody& body = *island.bodies[i];
    if (!asleep(body)) continue;
    body.setActivationState(ACTIVE_TAG);
    body.setDeactivationTime(0.0);
    body.applyGravity();
  }
  solver_.solve(island.bodies, island.manifolds, island.joints, substep_s);
  // A body that nothing holds is at rest only if it does not move at all.
  const bool held = !island.manifolds.empty() || !island.joints.empty();
  bool tired = std::none_of(island.joints.begin(), island.joints.end(),
                            [](auto* joint) { return is_told_to_move(*joint); });
  for (size_t i = 0; i < own; ++i)
    tired &= rests(*island.bodies[i], substep_s) && (held || !moves_at_all(*island.bodies[i]));
  for (size_t i = 0; tired && i < own; ++i) {
    btRigidBody& body = *island.bodies[i];
    body.setActivationState(ISLAND_SLEEPING);
    body.setLinearVelocity({0, 0, 0});
    body.setAngularVelocity({0, 0, 0});
  }
}

}  // namespace ruedo::physics
