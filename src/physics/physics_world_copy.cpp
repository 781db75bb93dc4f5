// Gives one copy of a world the state of another: in memory, or in bytes.
//
// Copies what bodies, joints, pairs and contacts keep between steps; everything else, the trees of
// boxes, the islands and the solver's data, follows from that in each step.
#include <map>

#include "physics/physics_world_impl.h"

namespace ruedo::physics {

void PhysicsWorld::Impl::copy_from(const Impl& other) {
  take_ties(other);
  poses_ = other.poses_;
  twists_ = other.twists_;
  last_twists_ = other.last_twists_;
  motions_ = other.motions_;
  for (BodyMotion& motion : motions_) motion.listed = false;
  busy_.clear();
  renew();
  contacts_ = other.contacts_;
  tied_ = other.tied_;
  wind_ = other.wind_;
  for (const JointIndex i : joints_.indices()) joints_[i].copy_from(other.joints_[i]);
  for (const WheelJointIndex i : wheels_.indices()) wheels_[i].copy_from(other.wheels_[i]);
  for (const BodyIndex i : motions_.indices()) take_body(i, other);
  broadphase_.copy_from(other.broadphase_, &dispatcher_);

  std::map<const btTypedConstraint*, btTypedConstraint*> here;  // only looked up, never iterated
  const auto add = [&](const auto& there, auto& joints) {
    for (const auto i : joints.indices())
      here[const_cast<JointConstraint&>(there[i]).constraint()] = joints[i].constraint();
  };
  add(other.joints_, joints_);
  add(other.wheels_, wheels_);
  for (const TieIndex i : ties_.indices())
    here[other.ties_[i].constraint.get()] = ties_[i].constraint.get();
  dynamics_.copy_from(other.dynamics_, [&](btTypedConstraint* there) { return here.at(there); });

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
  if (BodyShape* shape = rigid_.bodies[body].compound.get())
    shape->see_in_tree(other.rigid_.bodies[body].compound->seen_in_tree());
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

// ---- The same, in bytes: in the same order.

void PhysicsWorld::Impl::exchange(StateArchive& archive) {
  exchange_ties(archive);
  archive.each(poses_);
  archive.each(twists_);
  archive.each(last_twists_);
  archive.each(motions_);
  archive(contacts_, tied_, wind_);
  archive.each(joints_);
  archive.each(wheels_);
  for (const BodyIndex i : motions_.indices()) exchange_body(archive, i);
  broadphase_.exchange(archive, &dispatcher_);

  IndexedVector<BodyIndex, std::pair<int, btScalar>> rests;  // the bodies' state of sleep
  for (const BodyIndex i : motions_.indices()) {
    rests.emplace_back(bullet(i).getActivationState(), bullet(i).getDeactivationTime());
    if (archive.reads()) bullet(i).forceActivationState(ACTIVE_TAG);
  }
  dynamics_.exchange(archive, numbered_constraints());
  archive.each(rests);
  for (const BodyIndex i : motions_.indices()) {
    bullet(i).forceActivationState(rests[i].first);
    bullet(i).setDeactivationTime(rests[i].second);
  }
  if (archive.reads()) renew();
}

std::vector<btTypedConstraint*> PhysicsWorld::Impl::numbered_constraints() {
  std::vector<btTypedConstraint*> all;
  for (JointConstraint& joint : joints_) all.push_back(joint.constraint());
  for (JointConstraint& joint : wheels_) all.push_back(joint.constraint());
  for (Tie& tie : ties_) all.push_back(tie.constraint.get());
  std::erase(all, nullptr);
  return all;
}

void PhysicsWorld::Impl::exchange_ties(StateArchive& archive) {
  std::vector<std::pair<BodyIndex, BodyIndex>> bodies;
  for (const Tie& tie : ties_) bodies.emplace_back(tie.body, tie.other);
  archive(bodies);
  for (size_t i = ties_.size(); i < bodies.size(); ++i) {
    const auto [body, other] = bodies[i];
    if (!poses_.has(body) || (other.valid() && !poses_.has(other)))
      StateArchive::refuse("there is no such body");
    make_tie(body, other);
  }
  for (Tie& tie : ties_) {
    btTransform frames[2] = {tie.constraint->getFrameOffsetA(), tie.constraint->getFrameOffsetB()};
    archive(tie.closed, tie.hung_before);
    archive.raw(frames);
    if (!archive.reads()) continue;
    tie.constraint->setFrames(frames[0], frames[1]);
    tie.constraint->setEnabled(tie.closed);
  }
}

void PhysicsWorld::Impl::exchange_body(StateArchive& archive, BodyIndex body) {
  ObjectInfo& info = rigid_.bodies[body].info;
  archive(info.on_plane, info.moved, info.gone, info.joined);
  if (BodyShape* shape = rigid_.bodies[body].compound.get()) {
    btScalar seen = shape->seen_in_tree();
    archive.raw(seen);
    constexpr btScalar kFarthest_m = 1e6;
    if (!(seen >= kSeenAhead_m && seen <= kFarthest_m))
      StateArchive::refuse("a body sees too far ahead");
    if (archive.reads()) shape->see_in_tree(seen);
  }
  btRigidBody& here = bullet(body);
  btTransform places[2] = {here.getWorldTransform(), here.getInterpolationWorldTransform()};
  btVector3 values[] = {here.getInterpolationLinearVelocity(),
                        here.getInterpolationAngularVelocity(),
                        here.getLinearVelocity(),
                        here.getAngularVelocity(),
                        here.getLinearFactor(),
                        here.getAngularFactor(),
                        here.getGravity(),
                        here.getTotalForce(),
                        here.getTotalTorque()};
  archive.raw(places);
  archive.raw(values);
  if (!archive.reads()) return;
  here.setWorldTransform(places[0]);
  here.updateInertiaTensor();
  here.setInterpolationWorldTransform(places[1]);
  here.setInterpolationLinearVelocity(values[0]);
  here.setInterpolationAngularVelocity(values[1]);
  here.setLinearVelocity(values[2]);
  here.setAngularVelocity(values[3]);
  here.setLinearFactor(values[4]);
  here.setAngularFactor(values[5]);
  here.setGravity(values[6]);
  here.clearForces();
  here.applyCentralForce(values[7]);
  here.applyTorque(values[8]);
}

}  // namespace ruedo::physics
