// One step of the kinematic drive, before and after Bullet's.
#include "robot/kinematic_drive.h"

#include <algorithm>
#include <cmath>

#include "robot/ground.h"

namespace ruedo::robot {

namespace {

constexpr double kSupportNormal = 0.5;       // cosine between a support's normal and the robot's up
constexpr double kStanding_m = 2e-3;         // a wheel so near to the ground stands on it
constexpr double kSeesBump_m = 1e-2;         // a bump so near makes the robot leave the plane's support
// A robot so level, near and calm goes over to the plane's support; at the start its height may be further off,
// as wheels of many models are a little in the ground.
constexpr double kLevel_rad = 5e-3, kNear_m = 2e-3, kCalm_m_s = 0.05, kNearAtStart_m = 5e-3;
constexpr double kLeverWithoutWheels_m = 0.25;    // of the force that turns a robot without wheels
constexpr SimTime kFallAsleep_us = 500'000;
constexpr double kStill_m_s = 2e-3, kStill_rad_s = 1e-2;    // of what Bullet moves

Quat about_z(double angle) { return {std::cos(0.5 * angle), 0.0, 0.0, std::sin(0.5 * angle)}; }

}  // namespace

KinematicDrive::KinematicDrive(const model::WorldModel& world, const model::BodyLayout& layout,
                               physics::PhysicsWorld& physics, int robot, const std::vector<double>& planes)
    : Drive(world, layout, physics, robot),
      wheel_angles_(layout, robot, description_),
      planes_(planes),
      lowest_(lowest_of_wheels(world, layout, robot)),
      mass_(physics.mass(body_)),
      yaw_inertia_((X_WBase_.rotation * Vec3::UnitZ()).dot(physics.inertia(body_) * (X_WBase_.rotation * Vec3::UnitZ()))),
      lever_(description_.track > 0.0 ? 0.5 * description_.track : kLeverWithoutWheels_m),
      max_force_(std::min(description_.max_force, mass_ * world.gravity.norm())),
      gravity_(world.gravity) {
  stand_on_near_plane();
}

void KinematicDrive::stand_on_near_plane() {
  const auto plane = nearest_plane(planes_, X_WBase_.translation.z() + lowest_);
  const Vec3 up = X_WBase_.rotation * Vec3::UnitZ();
  if (plane && std::abs(plane_gap(*plane)) < kNearAtStart_m && up.z() > std::cos(kLevel_rad)) stand_on_plane(*plane);
}

void KinematicDrive::stand_on_plane(double height) {
  on_plane_ = true;
  heading_ = heading(X_WBase_.rotation);
  X_WBase_.rotation = about_z(heading_);
  X_WBase_.translation.z() = height - lowest_;
  physics_.set_support(body_, physics::Support::plane);
  physics_.set_gravity(body_, Vec3::Zero());
  physics_.set_pose(body_, X_WBase_ * X_BaseB_);
}

void KinematicDrive::begin_at_rest() {
  touched_ = held_ = behind_ = false;
  sent_.setZero();
  way_ = {};
  if (on_plane_) leave_plane();
  supported_ = false;
  stand_on_near_plane();
}

// The plane that it stands on may be gone.
void KinematicDrive::ground_changed() {
  if (!on_plane_) return;
  const auto plane = nearest_plane(planes_, X_WBase_.translation.z() + lowest_);
  if (plane && std::abs(plane_gap(*plane)) < kNear_m) return;
  leave_plane();
  supported_ = false;
  wake();
}

void KinematicDrive::leave_plane() {
  on_plane_ = false;
  supported_ = true;
  physics_.set_support(body_, physics::Support::contacts);
}

bool KinematicDrive::is_support(const Contact& contact, const Vec3& up) const {
  return contact.normal.dot(up) > kSupportNormal;
}

void KinematicDrive::choose_support() {
  const Vec3 up = X_WBase_.rotation * Vec3::UnitZ();
  if (on_plane_) {
    for (const Contact& contact : physics_.nearby(body_)) {
      if (is_support(contact, up) && contact.depth > -kSeesBump_m) return leave_plane();
    }
    return;
  }
  supported_ = false;
  bool bump = false;
  const auto plane = nearest_plane(planes_, X_WBase_.translation.z() + lowest_);
  for (const Contact& contact : physics_.nearby(body_)) {
    if (!is_support(contact, up)) continue;
    supported_ |= contact.depth > -kStanding_m;
    bump |= contact.body_b >= 0 || contact.normal.z() < 1.0 - 1e-9 || !plane ||
            std::abs(contact.position.z() - *plane) > kNear_m;
  }
  if (plane && supported_ && !bump && up.z() > std::cos(kLevel_rad) && std::abs(plane_gap(*plane)) < kNear_m &&
      std::abs(twist_.linear.z()) < kCalm_m_s) {
    stand_on_plane(*plane);
  }
}

void KinematicDrive::wake() {
  asleep_ = false;
  still_us_ = 0;
  physics_.wake(body_);
}

void KinematicDrive::before_step(SimTime now) {
  if (asleep_) {
    if (physics_.sleeping(body_)) return;
    wake();
  }
  way_ = motion_.step(now, step_us_);
  wheel_angles_.advance(way_);
  if (!physics_.alone(body_)) choose_support();
  if (on_plane_) {
    before_on_plane();
  } else {
    before_on_contacts();
  }
}

bool KinematicDrive::servo(Twist& twist, bool bounded) {
  double dx = way_.x / step_s_ - twist.linear.x(), dy = way_.y / step_s_ - twist.linear.y();
  double turn = way_.angle / step_s_ - twist.angular.z();
  if (touched_ && held_) {    // what contacts took in the last step they will take again: the servo gives it in advance
    dx += sent_.x() - twist.linear.x();
    dy += sent_.y() - twist.linear.y();
    turn += sent_.z() - twist.angular.z();
  }
  bool reached = true;
  if (bounded) {
    const double change = std::hypot(dx, dy), allowed = max_force_ * step_s_ / mass_;
    if (change > allowed) {
      dx *= allowed / change;
      dy *= allowed / change;
      reached = false;
    }
    const double allowed_turn = max_force_ * lever_ * step_s_ / yaw_inertia_;
    if (std::abs(turn) > allowed_turn) {
      turn = std::copysign(allowed_turn, turn);
      reached = false;
    }
  }
  twist.linear.x() += dx;
  twist.linear.y() += dy;
  twist.angular.z() += turn;
  sent_ = {twist.linear.x(), twist.linear.y(), twist.angular.z()};
  return reached;
}

void KinematicDrive::before_on_plane() {
  Pose& next = next_;
  next = X_WBase_;
  const double c2 = X_WBase_.rotation.w(), s2 = X_WBase_.rotation.z();    // of half the heading
  const double c = c2 * c2 - s2 * s2, s = 2.0 * c2 * s2;
  next.translation.x() += c * way_.x - s * way_.y;
  next.translation.y() += s * way_.x + c * way_.y;
  if (way_.angle != 0.0) next.rotation = about_z(heading_ + way_.angle);

  if (touched_ || behind_) {
    Twist twist = twist_;
    behind_ = !servo(twist, true);
    if (behind_) {
      physics_.drive(body_, body_twist(X_WBase_, twist));
      return;
    }
  }
  const Pose X_WB = next * X_BaseB_;
  const Twist mean{(X_WB.translation - physics_.pose(body_).translation) / step_s_, {0.0, 0.0, way_.angle / step_s_}};
  physics_.guide(body_, mean, X_WB);
}

void KinematicDrive::before_on_contacts() {
  if (!supported_) {
    physics_.set_gravity(body_, gravity_);
    return;
  }
  const Vec3 up = X_WBase_.rotation * Vec3::UnitZ();
  physics_.set_gravity(body_, up * up.dot(gravity_));
  Twist twist = twist_;
  behind_ = !servo(twist, touched_ || behind_);
  physics_.drive(body_, body_twist(X_WBase_, twist));
}

void KinematicDrive::after_step(SimTime now) {
  if (asleep_) {
    velocity_.setZero();
    acceleration_.setZero();
    motion_.show_step();
    return;
  }
  if (on_plane_) {
    after_on_plane(now);
  } else {
    after_on_contacts(now);
  }
  wheel_v_ = motion_.v();
  wheel_omega_ = motion_.omega();
  motion_.show_step();
}

void KinematicDrive::after_on_plane(SimTime now) {
  held_ = touched_;
  touched_ = !physics_.contacts(body_).empty();
  if (!touched_ && !behind_) {
    heading_ += way_.angle;
    if (std::abs(heading_) > M_PI) heading_ = wrap_angle(heading_);
    motion_.finish(now, way_.way, way_.angle, false);
    const Twist twist{{motion_.v(), motion_.side(), 0.0}, {0.0, 0.0, motion_.omega()}};
    set_state(next_, twist);
    physics_.set_twist(body_, body_twist(X_WBase_, twist));
    fall_asleep_when_still(true);
    return;
  }
  // Bullet decided; out of the plane it can only have rounded.
  Pose X_WBase = base_pose();
  const double last_heading = heading_;
  const Vec3 moved = X_WBase.translation - X_WBase_.translation;
  heading_ = heading(X_WBase.rotation);
  X_WBase.rotation = about_z(heading_);
  X_WBase.translation.z() = X_WBase_.translation.z();
  const double angle = wrap_angle(heading_ - last_heading), middle = last_heading + 0.5 * angle;
  Twist twist = base_twist(X_WBase);
  twist.linear.z() = twist.angular.x() = twist.angular.y() = 0.0;
  set_state(X_WBase, twist);
  motion_.finish(now, moved.x() * std::cos(middle) + moved.y() * std::sin(middle), angle, true);
  fall_asleep_when_still(false);
}

void KinematicDrive::after_on_contacts(SimTime now) {
  const Vec3 up = X_WBase_.rotation * Vec3::UnitZ();
  held_ = touched_;
  touched_ = false;
  for (const Contact& contact : physics_.contacts(body_)) touched_ |= !is_support(contact, up);
  Pose X_WBase = base_pose().normalized();
  const Quat turn = X_WBase_.rotation.conjugate() * X_WBase.rotation;
  const double bullet_angle = 2.0 * std::atan2(turn.z(), turn.w());
  const Vec3 moved = X_WBase_.rotation.conjugate() * (X_WBase.translation - X_WBase_.translation);
  if (!supported_ || touched_ || behind_) {
    set_state(X_WBase, base_twist(X_WBase));
    motion_.finish(now, moved.x(), wrap_angle(bullet_angle), touched_);
    fall_asleep_when_still(false);
    return;
  }
  // Only the support: along the robot's own plane the plan holds, across it Bullet.
  X_WBase.translation = X_WBase_ * Vec3(way_.x, way_.y, moved.z());
  X_WBase.rotation = (X_WBase_.rotation * (turn * about_z(-bullet_angle)) * about_z(way_.angle)).normalized();
  Twist twist = base_twist(X_WBase);
  motion_.finish(now, way_.way, way_.angle, false);
  twist.linear.x() = motion_.v();
  twist.linear.y() = motion_.side();
  twist.angular.z() = motion_.omega();
  physics_.set_pose(body_, X_WBase * X_BaseB_);
  physics_.set_twist(body_, body_twist(X_WBase, twist));
  set_state(X_WBase, twist);
  fall_asleep_when_still(std::abs(twist.linear.z()) < kStill_m_s && twist.angular.head<2>().norm() < kStill_rad_s);
}

void KinematicDrive::fall_asleep_when_still(bool still) {
  if (!still || !motion_.resting()) {
    still_us_ = 0;
    return;
  }
  still_us_ += step_us_;
  if (still_us_ < kFallAsleep_us) return;
  asleep_ = true;
  twist_ = {};
  way_ = {};
  physics_.sleep(body_);
}

void KinematicDrive::read_wheels(Snapshot& snapshot) const {
  wheel_angles_.read(snapshot, {wheel_v_, motion_.side(), wheel_omega_}, motion_.curvature());
}

}  // namespace ruedo::robot
