// Frames and the published state of a drive.
#include "robot/drive.h"

#include <algorithm>
#include <cmath>

#include "base/math/sincos.h"

namespace ruedo::robot {

namespace {

const world::DriveDescription& description_of(const world::WorldModel& world,
                                              const world::BodyLayout& layout, RobotIndex robot) {
  const InstanceIndex instance = layout.robots[robot].instance;
  return *world.models[instance].model->drive;
}

std::vector<Vec3> rims_of(const world::BodyLayout& layout, RobotIndex robot) {
  std::vector<Vec3> rims;
  for (const WheelIndex wheel : layout.robots[robot].wheels) {
    const world::WheelPlacement& placement = layout.wheels[wheel];
    if (!placement.steers) rims.push_back(placement.rim);
  }
  return rims;
}

}  // namespace

Drive::Drive(const world::WorldModel& world, const world::BodyLayout& layout,
             physics::PhysicsWorld& physics, RobotIndex robot)
    : physics_(physics),
      robot_(robot),
      body_(layout.robots[robot].body),
      step_us_(world.step_us),
      step_s_(static_cast<double>(world.step_us) * 1e-6),
      X_BBase_(layout.robots[robot].X_BBase),
      X_BaseB_(X_BBase_.inverse()),
      wheels_(layout.robots[robot].wheels),
      description_(description_of(world, layout, robot)),
      planner_(description_, rims_of(layout, robot)),
      X_WBase_(base_pose().normalized()) {
  odom_heading_ = heading(X_WBase_.rotation);
}

Twist Drive::base_twist(const Pose& X_WBase) const {
  const Twist& of_body = physics_->twist(body_);
  const Vec3 arm = physics_->pose(body_).rotation * X_BBase_.translation;
  const Quat to_base = X_WBase.rotation.conjugate();
  return {to_base * (of_body.linear + of_body.angular.cross(arm)), to_base * of_body.angular};
}

Twist Drive::body_twist(const Pose& X_WBase, const Twist& of_base) const {
  const Vec3 angular = X_WBase.rotation * of_base.angular;
  const Vec3 arm = X_WBase.rotation * X_BaseB_.translation;
  return {X_WBase.rotation * of_base.linear + angular.cross(arm), angular};
}

void Drive::set_state(const Pose& X_WBase, const Twist& twist) {
  X_WBase_ = X_WBase;
  twist_ = twist;
  const Vec3 velocity = X_WBase.rotation * twist.linear;
  // The mean over the step is that in its middle; the robot has turned on since, and it with it.
  acceleration_ = X_WBase.rotation.conjugate() *
                  (about_z(0.5 * step_s_ * (X_WBase.rotation * twist.angular).z()) *
                   Vec3((velocity - velocity_) / step_s_));
  velocity_ = velocity;
}

// The power of the contact force at the planned velocity of its point. Friction with the supporting
// surface is excluded: it propels the robot, and dissipates power when wheels slip.
void Drive::resist(const Contact& contact) {
  if (!contact.link_b.valid()) return;
  const bool collides =
      std::abs(contact.normal.dot(X_WBase_.rotation * Vec3::UnitZ())) < kSupportNormal;
  const Quat to_base = X_WBase_.rotation.conjugate();
  Vec3 force = to_base * Vec3(contact.force * contact.normal);
  if (collides) force += to_base * contact.friction;
  const Vec3 p = to_base * Vec3(contact.position - X_WBase_.translation);
  const Vec3 planned(planner_.v() - planner_.omega() * p.y(),
                     planner_.side() + planner_.omega() * p.x(), 0.0);
  planner_.resist(contact.link_b, std::max(collides ? 1e-9 : 0.0, -force.dot(planned)) * step_s_);
}

void Drive::reset_odometry() {
  ++resets_;
  odom_heading_ = heading(X_WBase_.rotation);
  believed_heading_ = 0.0;
}

void Drive::placed(SimTime now) {
  const double before = heading(X_WBase_.rotation);
  X_WBase_ = base_pose().normalized();
  odom_heading_ = wrap_angle(odom_heading_ + heading(X_WBase_.rotation) - before);
  twist_ = {};
  velocity_.setZero();
  acceleration_.setZero();
  wheel_v_ = wheel_omega_ = 0.0;
  planner_.stand_still(now);
  wake();
  begin_at_rest();
}

void read_motion(const MotionLog& log, RobotIndex robot, Snapshot& snapshot) {
  snapshot.robots[robot].motion = log.shown();
  for (const MotionState& end : log.ends()) snapshot.motion_ends.push_back({robot, end});
}

void Drive::exchange(StateArchive& archive) {
  archive(planner_, X_WBase_, twist_, velocity_, acceleration_, odom_heading_, believed_heading_,
          resets_, wheel_v_, wheel_omega_);
}

void Drive::read(Snapshot& snapshot) const {
  RobotState& state = snapshot.robots[robot_];
  state.X_WBase = X_WBase_;
  state.twist = twist_;
  state.acceleration = acceleration_;
  state.wheel_v = wheel_v_;
  state.wheel_omega = wheel_omega_;
  state.odometry_resets = resets_;
  read_motion(planner_.log(), robot_, snapshot);
}

}  // namespace ruedo::robot
