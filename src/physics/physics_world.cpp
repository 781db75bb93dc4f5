// The interface of the physics world, over physics_world_impl.h.
#include "physics/physics_world.h"

#include <limits>

#include "physics/physics_world_impl.h"

namespace ruedo::physics {

PhysicsWorld::PhysicsWorld(const world::WorldModel& world, const world::BodyLayout& layout)
    : impl_(std::make_unique<Impl>(world, layout)) {}
PhysicsWorld::~PhysicsWorld() = default;

void PhysicsWorld::step() { impl_->step(); }
void PhysicsWorld::copy_from(const PhysicsWorld& other) { impl_->copy_from(*other.impl_); }
void PhysicsWorld::exchange(StateArchive& archive) { impl_->exchange(archive); }
const Pose& PhysicsWorld::pose(BodyIndex body) const { return impl_->poses_[body]; }
const Twist& PhysicsWorld::twist(BodyIndex body) const { return impl_->twists_[body]; }
void PhysicsWorld::set_pose(BodyIndex body, const Pose& X_WB) { impl_->set_pose(body, X_WB); }
void PhysicsWorld::set_twist(BodyIndex body, const Twist& twist) { impl_->set_twist(body, twist); }
void PhysicsWorld::set_support(BodyIndex body, Support support) {
  impl_->set_support(body, support);
}

void PhysicsWorld::guide(BodyIndex body, const Twist& mean, const Pose& X_WB) {
  BodyMotion& motion = impl_->motions_[body];
  impl_->stir(body);
  motion.kind = BodyMotion::Kind::guided;
  motion.mean = mean;
  motion.end = X_WB;
}

void PhysicsWorld::drive(BodyIndex body, const Twist& twist) {
  BodyMotion& motion = impl_->motions_[body];
  impl_->stir(body);
  motion.kind = BodyMotion::Kind::driven;
  motion.mean = twist;
}

void PhysicsWorld::set_gravity(BodyIndex body, const Vec3& gravity) {
  impl_->bullet(body).setGravity(to_bt(gravity));
}

void PhysicsWorld::set_wind(const Vec3& wind) { impl_->set_wind(wind); }

double PhysicsWorld::mass(BodyIndex body) const {
  const double inverse = impl_->bullet(body).getInvMass();
  return inverse > 0.0 ? 1.0 / inverse : 0.0;
}
Vec3 PhysicsWorld::center_of_mass(BodyIndex body) const {
  return pose(body) * impl_->rigid_.bodies[body].X_BI.translation;
}
Eigen::Matrix3d PhysicsWorld::inertia(BodyIndex body) const {
  const RigidBody& rigid = impl_->rigid_.bodies[body];
  const Eigen::Matrix3d R = (pose(body).rotation * rigid.X_BI.rotation).toRotationMatrix();
  const Vec3 inverse = from_bt(rigid.bullet->getInvInertiaDiagLocal());
  return R * inverse.cwiseInverse().asDiagonal() * R.transpose();
}
void PhysicsWorld::apply_impulse(BodyIndex body, const Vec3& linear, const Vec3& angular) {
  impl_->apply_impulse(body, linear, angular);
}
std::span<const Contact> PhysicsWorld::contacts(BodyIndex body) const {
  return impl_->contacts_.touching(body);
}
std::span<const Contact> PhysicsWorld::nearby(BodyIndex body) const {
  return impl_->contacts_.near(body);
}
bool PhysicsWorld::alone(BodyIndex body) const { return impl_->alone(body); }
void PhysicsWorld::wake(BodyIndex body) { impl_->wake(body); }
bool PhysicsWorld::may_sleep(BodyIndex body) const { return impl_->rigid_.bodies[body].sleeps; }
void PhysicsWorld::sleep(BodyIndex body) { impl_->sleep(body); }
bool PhysicsWorld::sleeping(BodyIndex body) const { return impl_->sleeping(body); }

double PhysicsWorld::joint_position(JointIndex joint) const {
  return impl_->joints_[joint].position();
}
double PhysicsWorld::joint_velocity(JointIndex joint) const {
  return impl_->joints_[joint].velocity();
}
double PhysicsWorld::joint_effort(JointIndex joint) const { return impl_->joints_[joint].effort(); }
void PhysicsWorld::drive_joint_velocity(JointIndex joint, double rate, double max_effort) {
  impl_->stirred(joint).set_motor(rate, -max_effort, max_effort,
                                  std::numeric_limits<double>::infinity());
}
void PhysicsWorld::apply_joint_effort(JointIndex joint, double effort) {
  impl_->stirred(joint).set_effort(effort);
}
void PhysicsWorld::servo_joint(JointIndex joint, const WheelServo& servo) {
  impl_->stirred(joint).set_servo(servo);
}

void PhysicsWorld::set_joint(JointIndex joint, JointSetting setting, double value) {
  impl_->stirred(joint).set(setting, value);
}

TieIndex PhysicsWorld::make_tie(BodyIndex body, BodyIndex other) {
  return impl_->make_tie(body, other);
}
void PhysicsWorld::close_tie(TieIndex tie) { impl_->close_tie(tie); }
void PhysicsWorld::open_tie(TieIndex tie) { impl_->open_tie(tie); }
bool PhysicsWorld::is_closed(TieIndex tie) const { return impl_->is_closed(tie); }

double PhysicsWorld::wheel_angle(WheelIndex wheel) const {
  const WheelJointIndex joint = impl_->wheel_joint_[wheel];
  return joint.valid() ? impl_->wheel_sign_[wheel] * impl_->wheels_[joint].position() : 0.0;
}
double PhysicsWorld::wheel_rate(WheelIndex wheel) const {
  const WheelJointIndex joint = impl_->wheel_joint_[wheel];
  return joint.valid() ? impl_->wheel_sign_[wheel] * impl_->wheels_[joint].velocity() : 0.0;
}
void PhysicsWorld::drive_wheel(WheelIndex wheel, const WheelServo& servo) {
  const WheelJointIndex joint = impl_->wheel_joint_[wheel];
  if (!joint.valid()) return;
  const bool ahead = impl_->wheel_sign_[wheel] > 0.0;
  impl_->stirred(wheel).set_motor(ahead ? servo.rate : -servo.rate,
                                  ahead ? servo.lowest_torque : -servo.highest_torque,
                                  ahead ? servo.highest_torque : -servo.lowest_torque, servo.gain);
}

void PhysicsWorld::add(InstanceIndex instance) { impl_->add(instance); }
void PhysicsWorld::remove(InstanceIndex instance) { impl_->remove(instance); }
void PhysicsWorld::disturb(BodyIndex body) { impl_->disturb(body); }
void PhysicsWorld::reset(JointIndex joint) { impl_->stirred(joint).reset(); }

const std::vector<Finding>& PhysicsWorld::findings() const { return impl_->rigid_.findings; }
void PhysicsWorld::read(Snapshot& snapshot) const { impl_->read(snapshot); }

}  // namespace ruedo::physics
