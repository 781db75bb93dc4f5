// Ties: fixed joints that are closed and opened between two steps.
#include <algorithm>

#include "physics/physics_world_impl.h"

namespace ruedo::physics {

TieIndex PhysicsWorld::Impl::make_tie(BodyIndex body, BodyIndex other) {
  Tie made;
  made.body = body;
  made.other = other;
  btRigidBody& second = other.valid() ? bullet(other) : ground_;
  made.constraint = std::make_unique<btFixedConstraint>(
      bullet(body), second, btTransform::getIdentity(), btTransform::getIdentity());
  made.constraint->setEnabled(false);
  // It shares its place with a number that is not 0.
  made.constraint->setUserConstraintPtr(nullptr);
  // Bullet would keep bodies of a joint from each other for good: refilter() does while it is
  // closed.
  dynamics_.addConstraint(made.constraint.get(), false);
  const TieIndex tie = ties_.next();
  ties_.push_back(std::move(made));
  return tie;
}

void PhysicsWorld::Impl::close_tie(TieIndex tie_index) {
  Tie& closing = ties_[tie_index];
  const auto gone = [&](BodyIndex body) { return body.valid() && rigid_.bodies[body].info.gone; };
  if (closing.closed || gone(closing.body) || gone(closing.other)) return;
  closing.closed = true;
  closing.hung_before = motions_[closing.body].hung;
  const auto world_of = [&](BodyIndex body) {
    return !body.valid() ? Pose{} : poses_[body] * rigid_.bodies[body].X_BI;
  };
  const Pose X_OB = world_of(closing.other).inverse() * world_of(closing.body);
  closing.constraint->setFrames(btTransform::getIdentity(), to_bt(X_OB.normalized()));
  closing.constraint->setEnabled(true);
  tie(closing.body, closing.other);
  for (const BodyIndex body : {closing.body, closing.other}) {
    if (!body.valid()) continue;
    disturb(body);
    broadphase_.refilter(bullet(body).getBroadphaseHandle(), &dispatcher_);
  }
}

void PhysicsWorld::Impl::open_tie(TieIndex tie_index) {
  Tie& opening = ties_[tie_index];
  if (!opening.closed) return;
  opening.closed = false;
  opening.constraint->setEnabled(false);
  if (!opening.other.valid()) motions_[opening.body].hung = opening.hung_before;
  untie(opening.body, opening.other);
  for (const BodyIndex body : {opening.body, opening.other}) {
    if (!body.valid()) continue;
    broadphase_.refilter(bullet(body).getBroadphaseHandle(), &dispatcher_);
    disturb(body);
  }
}

// Removes one joint between the bodies; others remain.
void PhysicsWorld::Impl::untie(BodyIndex body, BodyIndex other) {
  const auto forget = [&](BodyIndex one, BodyIndex partner) {
    std::vector<BodyIndex>& joined = rigid_.bodies[one].info.joined;
    const auto at = std::find(joined.begin(), joined.end(), partner);
    if (at != joined.end()) joined.erase(at);
  };
  if (other.valid()) {
    const auto at = std::find(tied_.begin(), tied_.end(), std::pair(body, other));
    if (at != tied_.end()) tied_.erase(at);
    forget(body, other);
    forget(other, body);
  }
  for (const BodyIndex one : {body, other}) {
    if (one.valid())
      motions_[one].tied = motions_[one].hung || !rigid_.bodies[one].info.joined.empty();
  }
}

}  // namespace ruedo::physics
