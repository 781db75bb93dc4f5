// The initial acceleration of what joints hold: from two substeps so short that nothing moves,
// which are then undone. A substep ends with the velocity at its middle, so that the first one does
// not include what keeps a link on its arc.
#include <algorithm>

#include "physics/dynamics/solver.h"
#include "physics/physics_world_impl.h"

namespace ruedo::physics {

namespace {

constexpr double kInstant_s = 1e-4;

// Restores a body's state.
class Kept {
 public:
  explicit Kept(btRigidBody& body)
      : body_(body),
        pose_(body.getWorldTransform()),
        linear_(body.getLinearVelocity()),
        angular_(body.getAngularVelocity()) {}
  void restore() const {
    body_.setWorldTransform(pose_);
    body_.updateInertiaTensor();
    body_.setLinearVelocity(linear_);
    body_.setAngularVelocity(angular_);
    body_.clearForces();
  }

 private:
  btRigidBody& body_;
  btTransform pose_;
  btVector3 linear_, angular_;
};

}  // namespace

// All bodies connected to a body by joints; empty if anything touches or otherwise holds them.
std::vector<BodyIndex> PhysicsWorld::Impl::mechanism_in_the_air(BodyIndex body) const {
  std::vector<BodyIndex> tied{body};
  for (size_t i = 0; i < tied.size(); ++i) {
    const RigidBody& rigid = rigid_.bodies[tied[i]];
    if (rigid.info.moved || rigid.info.gone || rigid.info.on_plane || !alone(tied[i])) return {};
    for (const BodyIndex other : rigid.info.joined) {
      if (std::find(tied.begin(), tied.end(), other) == tied.end()) tied.push_back(other);
    }
  }
  return tied;
}

// Acceleration of the body's origin, in Bullet's frame.
Vec3 PhysicsWorld::Impl::velocity_now(BodyIndex body) const {
  const RigidBody& rigid = rigid_.bodies[body];
  const Pose X_IB = rigid.X_BI.inverse();
  const Vec3 arm = from_bt(rigid.bullet->getWorldTransform()).rotation * X_IB.translation;
  return from_bt(rigid.bullet->getLinearVelocity()) +
         from_bt(rigid.bullet->getAngularVelocity()).cross(arm);
}

void PhysicsWorld::Impl::accelerate_at_start(Snapshot& snapshot) {
  IndexedVector<BodyIndex, char> known;
  for (const BodyIndex i : motions_.indices()) {
    if (!motions_[i].fresh || !motions_[i].tied) continue;
    known.resize(motions_.size());
    if (known[i]) continue;
    const std::vector<BodyIndex> bodies = mechanism_in_the_air(i);
    for (const BodyIndex body : bodies) known[body] = 1;
    if (!bodies.empty()) accelerate_at_start(bodies, snapshot);
  }
}

// As one rigid body, if nothing holds them.
void PhysicsWorld::Impl::fall_at_start(const std::vector<BodyIndex>& bodies,
                                       Snapshot& snapshot) const {
  const btVector3& gravity = rigid_.bodies[bodies[0]].bullet->getGravity();
  for (const BodyIndex body : bodies) {
    if (motions_[body].hung || rigid_.bodies[body].bullet->getGravity() != gravity) return;
  }
  for (const BodyIndex body : bodies) snapshot.body_accelerations[body] = from_bt(gravity);
}

void PhysicsWorld::Impl::accelerate_at_start(const std::vector<BodyIndex>& bodies,
                                             Snapshot& snapshot) {
  std::vector<JointConstraint*> joints;
  for (const JointIndex i : joints_.indices()) {
    const BodyIndex body = body_of(i);
    if (!body.valid() || std::find(bodies.begin(), bodies.end(), body) == bodies.end()) continue;
    if (leaders_[i].valid()) return fall_at_start(bodies, snapshot);  // it jumps to its position
    btTypedConstraint* constraint = joints_[i].constraint();
    if (constraint && constraint->isEnabled()) joints.push_back(&joints_[i]);
  }
  const auto of_mechanism = [&](JointConstraint& wheel) {
    const auto* constraint = wheel.constraint();
    if (!constraint || !constraint->isEnabled()) return false;
    return std::any_of(bodies.begin(), bodies.end(), [&](BodyIndex body) {
      return &bullet(body) == &constraint->getRigidBodyA() ||
             &bullet(body) == &constraint->getRigidBodyB();
    });
  };
  for (JointConstraint& wheel : wheels_)
    if (of_mechanism(wheel)) joints.push_back(&wheel);

  std::vector<btRigidBody*> movers;
  std::vector<Kept> kept;
  for (const BodyIndex body : bodies) {
    if (motions_[body].dirty) push_to_bullet(body);
    movers.push_back(&bullet(body));
    kept.emplace_back(bullet(body));
  }
  std::vector<btTypedConstraint*> constraints;
  std::vector<JointMotors> motors;
  for (JointConstraint* joint : joints) {
    constraints.push_back(joint->constraint());
    motors.push_back(*static_cast<JointMotors*>(constraints.back()->getUserConstraintPtr()));
  }
  Solver solver(surfaces_, SolverSettings{world_.solver.iterations, world_.solver.tolerance,
                                          world_.solver.error_reduction});
  const auto go_on = [&] {
    for (btRigidBody* body : movers) {
      body->clearForces();
      body->applyGravity();
    }
    for (JointConstraint* joint : joints) joint->before_substep(kInstant_s);
    solver.solve(movers, {}, constraints, kInstant_s);
  };
  go_on();
  for (const BodyIndex body : bodies) snapshot.body_accelerations[body] = -velocity_now(body);
  go_on();
  for (const BodyIndex body : bodies) {
    Vec3& acceleration = snapshot.body_accelerations[body];
    acceleration = (acceleration + velocity_now(body)) / kInstant_s;
  }
  for (const Kept& body : kept) body.restore();
  for (size_t i = 0; i < constraints.size(); ++i)
    *static_cast<JointMotors*>(constraints[i]->getUserConstraintPtr()) = motors[i];
}

}  // namespace ruedo::physics
