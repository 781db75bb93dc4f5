// The interface of the physics world, over physics_world_impl.h.
#include "physics/physics_world.h"

#include <limits>

#include "physics/physics_world_impl.h"

namespace ruedo::physics {

PhysicsWorld::PhysicsWorld(const model::WorldModel& world, const model::BodyLayout& layout)
    : impl_(std::make_unique<Impl>(world, layout)) {}
PhysicsWorld::~PhysicsWorld() = default;

void PhysicsWorld::step() { impl_->step(); }
const Pose& PhysicsWorld::pose(int body) const { return impl_->poses_[Impl::index(body)]; }
const Twist& PhysicsWorld::twist(int body) const { return impl_->twists_[Impl::index(body)]; }
void PhysicsWorld::set_pose(int body, const Pose& X_WB) { impl_->set_pose(body, X_WB); }
void PhysicsWorld::set_twist(int body, const Twist& twist) { impl_->set_twist(body, twist); }
void PhysicsWorld::set_support(int body, Support support) { impl_->set_support(body, support); }

void PhysicsWorld::guide(int body, const Twist& mean, const Pose& X_WB) {
  BodyMotion& motion = impl_->motions_[Impl::index(body)];
  motion.kind = BodyMotion::Kind::guided;
  motion.mean = mean;
  motion.end = X_WB;
}

void PhysicsWorld::drive(int body, const Twist& twist) {
  BodyMotion& motion = impl_->motions_[Impl::index(body)];
  motion.kind = BodyMotion::Kind::driven;
  motion.mean = twist;
}

void PhysicsWorld::set_gravity(int body, const Vec3& gravity) {
  impl_->bullet(body).setGravity(to_bt(gravity));
}

void PhysicsWorld::set_wind(const Vec3& wind) { impl_->set_wind(wind); }

double PhysicsWorld::mass(int body) const {
  const double inverse = impl_->bullet(body).getInvMass();
  return inverse > 0.0 ? 1.0 / inverse : 0.0;
}
Vec3 PhysicsWorld::center_of_mass(int body) const {
  return pose(body) * impl_->rigid_.bodies[Impl::index(body)].X_BI.translation;
}
Eigen::Matrix3d PhysicsWorld::inertia(int body) const {
  const RigidBody& rigid = impl_->rigid_.bodies[Impl::index(body)];
  const Eigen::Matrix3d R = (pose(body).rotation * rigid.X_BI.rotation).toRotationMatrix();
  const Vec3 inverse = from_bt(rigid.bullet->getInvInertiaDiagLocal());
  return R * inverse.cwiseInverse().asDiagonal() * R.transpose();
}
void PhysicsWorld::apply_impulse(int body, const Vec3& linear, const Vec3& angular) {
  impl_->apply_impulse(body, linear, angular);
}
std::span<const Contact> PhysicsWorld::contacts(int body) const {
  return impl_->contacts_.touching(body);
}
std::span<const Contact> PhysicsWorld::nearby(int body) const {
  return impl_->contacts_.near(body);
}
bool PhysicsWorld::alone(int body) const { return impl_->alone(body); }
void PhysicsWorld::wake(int body) { impl_->bullet(body).activate(true); }
void PhysicsWorld::sleep(int body) { impl_->sleep(body); }
bool PhysicsWorld::sleeping(int body) const { return impl_->sleeping(body); }

double PhysicsWorld::joint_position(int joint) const {
  return impl_->joints_[Impl::index(joint)].position();
}
double PhysicsWorld::joint_velocity(int joint) const {
  return impl_->joints_[Impl::index(joint)].velocity();
}
double PhysicsWorld::joint_effort(int joint) const {
  return impl_->joints_[Impl::index(joint)].effort();
}
void PhysicsWorld::drive_joint_velocity(int joint, double rate, double max_effort) {
  impl_->joints_[Impl::index(joint)].set_motor(rate, -max_effort, max_effort,
                                               std::numeric_limits<double>::infinity());
}
void PhysicsWorld::apply_joint_effort(int joint, double effort) {
  impl_->joints_[Impl::index(joint)].set_effort(effort);
}

void PhysicsWorld::set_joint(int joint, JointSetting setting, double value) {
  impl_->joints_[Impl::index(joint)].set(setting, value);
}

double PhysicsWorld::wheel_angle(int wheel) const {
  const int joint = impl_->wheel_joint_[Impl::index(wheel)];
  return joint < 0 ? 0.0
                   : impl_->wheel_sign_[Impl::index(wheel)] *
                         impl_->wheels_[Impl::index(joint)].position();
}
double PhysicsWorld::wheel_rate(int wheel) const {
  const int joint = impl_->wheel_joint_[Impl::index(wheel)];
  return joint < 0 ? 0.0
                   : impl_->wheel_sign_[Impl::index(wheel)] *
                         impl_->wheels_[Impl::index(joint)].velocity();
}
void PhysicsWorld::drive_wheel(int wheel, const WheelServo& servo) {
  const int joint = impl_->wheel_joint_[Impl::index(wheel)];
  if (joint < 0) return;
  const bool ahead = impl_->wheel_sign_[Impl::index(wheel)] > 0.0;
  impl_->wheels_[Impl::index(joint)].set_motor(
      ahead ? servo.rate : -servo.rate, ahead ? servo.lowest_torque : -servo.highest_torque,
      ahead ? servo.highest_torque : -servo.lowest_torque, servo.gain);
}

void PhysicsWorld::add(int instance) { impl_->add(instance); }
void PhysicsWorld::remove(int instance) { impl_->remove(instance); }
void PhysicsWorld::disturb(int body) { impl_->disturb(body); }
void PhysicsWorld::start_again(int joint) { impl_->joints_[Impl::index(joint)].start_again(); }

const std::vector<Finding>& PhysicsWorld::findings() const { return impl_->rigid_.findings; }
void PhysicsWorld::read(Snapshot& snapshot) const { impl_->read(snapshot); }

}  // namespace ruedo::physics
