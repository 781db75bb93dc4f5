// Gives one copy of a world the state of another.
//
// Copies what bodies, joints, pairs and contacts keep between steps; everything else, the trees of
// boxes, the islands and the solver's data, follows from that in each step.
#include <map>

#include "physics/physics_world_impl.h"

namespace ruedo::physics {

void PhysicsWorld::Impl::take(const Impl& other) {
  take_ties(other);
  poses_ = other.poses_;
  twists_ = other.twists_;
  last_twists_ = other.last_twists_;
  motions_ = other.motions_;
  contacts_ = other.contacts_;
  tied_ = other.tied_;
  wind_ = other.wind_;
  for (const JointIndex i : joints_.indices()) joints_[i].take(other.joints_[i]);
  for (const WheelJointIndex i : wheels_.indices()) wheels_[i].take(other.wheels_[i]);
  for (const BodyIndex i : motions_.indices()) take_body(i, other);
  broadphase_.take(other.broadphase_, &dispatcher_);

  std::map<const btTypedConstraint*, btTypedConstraint*> here;  // only looked up, never iterated
  const auto add = [&](const auto& there, auto& joints) {
    for (const auto i : joints.indices())
      here[const_cast<JointConstraint&>(there[i]).constraint()] = joints[i].constraint();
  };
  add(other.joints_, joints_);
  add(other.wheels_, wheels_);
  for (const TieIndex i : ties_.indices())
    here[other.ties_[i].constraint.get()] = ties_[i].constraint.get();
  dynamics_.take(other.dynamics_, [&](btTypedConstraint* there) { return here.at(there); });

  for (const BodyIndex i : motions_.indices()) {  // contacts are copied between awake objects
    const btRigidBody& there = *other.rigid_.bodies[i].bullet;
    bullet(i).forceActivationState(there.getActivationState());
    bullet(i).setDeactivationTime(there.getDeactivationTime());
  }
}

void PhysicsWorld::Impl::take_ties(const Impl& other) {
  while (ties_.size() > other.ties_.size()) {
    dynamics_.removeConstraint(ties_.back().constraint.get());
    ties_.pop_back();
  }
  for (const TieIndex i : other.ties_.indices()) {
    const Tie& there = other.ties_[i];
    if (!ties_.has(i)) make_tie(there.body, there.other);
    Tie& tie = ties_[i];
    tie.closed = there.closed;
    tie.hung_before = there.hung_before;
    tie.constraint->setFrames(there.constraint->getFrameOffsetA(),
                              there.constraint->getFrameOffsetB());
    tie.constraint->setEnabled(there.closed);
  }
}

void PhysicsWorld::Impl::take_body(BodyIndex body, const Impl& other) {
  rigid_.bodies[body].info = other.rigid_.bodies[body].info;
  btRigidBody& here = bullet(body);
  const btRigidBody& there = *other.rigid_.bodies[body].bullet;
  here.setWorldTransform(there.getWorldTransform());
  here.updateInertiaTensor();
  here.setInterpolationWorldTransform(there.getInterpolationWorldTransform());
  here.setInterpolationLinearVelocity(there.getInterpolationLinearVelocity());
  here.setInterpolationAngularVelocity(there.getInterpolationAngularVelocity());
  here.setLinearVelocity(there.getLinearVelocity());
  here.setAngularVelocity(there.getAngularVelocity());
  here.setLinearFactor(there.getLinearFactor());
  here.setAngularFactor(there.getAngularFactor());
  here.setGravity(there.getGravity());
  here.clearForces();
  here.applyCentralForce(there.getTotalForce());
  here.applyTorque(there.getTotalTorque());
  here.forceActivationState(ACTIVE_TAG);
}

}  // namespace ruedo::physics
