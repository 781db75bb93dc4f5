// Controllers of the wheels drive.
#include "robot/wheels_drive.h"

#include <algorithm>
#include <cmath>

namespace ruedo::robot {

namespace {

// Gains, by trial on P3-AT and P3-DX: quick, and without overshoot at steps of 1 to 10 ms.
constexpr double kWayGain_per_s = 10.0;
constexpr double kYawGain_per_s = 8.0, kYawIntegral_per_s2 = 16.0;
// What the controllers may be behind; a robot that is held does not wind them up further.
constexpr double kLargestWayError_m = 0.02, kLargestYawError_rad = 0.15;
constexpr double kSupportNormal = 0.5;       // cosine between a support's normal and the robot's up
constexpr SimTime kFallAsleep_us = 500'000;
constexpr double kSettled_m_s = 2e-3, kSettled_rad_s = 1e-2;    // a primitive ends below these
constexpr double kStill_m_s = 5e-3, kStill_rad_s = 2e-2;

}  // namespace

WheelsDrive::WheelsDrive(const model::WorldModel& world, const model::BodyLayout& layout, physics::PhysicsWorld& physics, int robot)
    : Drive(world, layout, physics, robot), max_torque_(description_.max_wheel_torque) {
  bodies_.push_back(body_);
  for (const int wheel : wheels_) {
    const int body = layout.links[static_cast<size_t>(layout.wheels[static_cast<size_t>(wheel)].link)].body;
    if (std::find(bodies_.begin(), bodies_.end(), body) == bodies_.end()) bodies_.push_back(body);
  }
  if (!wheels_.empty()) {
    max_torque_ = std::min(max_torque_, description_.max_force * description_.wheel_radius / static_cast<double>(wheels_.size()));
  }
}

double WheelsDrive::way_of_wheels() const {
  double left = 0.0, right = 0.0;
  const size_t of_left = description_.left_joints.size();
  for (size_t i = 0; i < wheels_.size(); ++i) (i < of_left ? left : right) += physics_.wheel_angle(wheels_[i]);
  return 0.5 * description_.wheel_radius *
         (left / static_cast<double>(of_left) + right / static_cast<double>(wheels_.size() - of_left));
}

void WheelsDrive::begin_at_rest() {
  planned_way_ = way_of_wheels();
  heading_error_ = slip_correction_ = turned_ = 0.0;
}

void WheelsDrive::wake() {
  asleep_ = false;
  still_us_ = 0;
  for (const int body : bodies_) physics_.wake(body);
}

void WheelsDrive::before_step(SimTime now) {
  if (asleep_) {
    if (physics_.sleeping(body_)) return;
    wake();
  }
  way_ = motion_.step(now, step_us_);
  planned_way_ += way_.way;
  const double way_error = std::clamp(planned_way_ - way_of_wheels(), -kLargestWayError_m, kLargestWayError_m);
  planned_way_ = way_of_wheels() + way_error;
  heading_error_ = std::clamp(heading_error_ + way_.angle, -kLargestYawError_rad, kLargestYawError_rad);
  slip_correction_ += kYawIntegral_per_s2 * heading_error_ * step_s_;
  const double fastest = 2.0 * std::abs(motion_.omega()) + 0.1;    // slip takes half of the turn rate at most
  slip_correction_ = std::clamp(slip_correction_, -fastest, fastest);

  const double v = way_.way / step_s_ + kWayGain_per_s * way_error;
  const double omega = way_.angle / step_s_ + kYawGain_per_s * heading_error_ + slip_correction_;
  const double half_track = 0.5 * description_.track, r = description_.wheel_radius;
  for (size_t i = 0; i < wheels_.size(); ++i) {
    const bool left = i < description_.left_joints.size();
    const double rate = (v + (left ? -half_track : half_track) * omega) / r;
    physics_.drive_wheel(wheels_[i], std::clamp(rate, -description_.max_wheel_rate, description_.max_wheel_rate), max_torque_);
  }
}

void WheelsDrive::after_step(SimTime now) {
  if (asleep_) {
    velocity_.setZero();
    acceleration_.setZero();
    motion_.show_step();
    return;
  }
  const Pose X_WBase = base_pose().normalized();
  const Quat turn = X_WBase_.rotation.conjugate() * X_WBase.rotation;
  const double angle = wrap_angle(2.0 * std::atan2(turn.z(), turn.w()));
  const Vec3 moved = X_WBase_.rotation.conjugate() * (X_WBase.translation - X_WBase_.translation);
  const Vec3 up = X_WBase_.rotation * Vec3::UnitZ();
  bool touched = false;
  for (const int body : bodies_) {
    for (const Contact& contact : physics_.contacts(body)) touched |= contact.normal.dot(up) < kSupportNormal;
  }
  heading_error_ -= angle;
  set_state(X_WBase, base_twist(X_WBase));
  read_wheel_rates();
  motion_.finish(now, moved.x(), angle, touched, lag());
  if (touched && motion_.has_primitive()) {    // it was planned anew, from where the robot really is
    planned_way_ = way_of_wheels();
    heading_error_ = 0.0;
  }
  fall_asleep_when_still();
  motion_.show_step();
}

Lag WheelsDrive::lag() const {
  const bool moving = std::abs(twist_.linear.x()) > kSettled_m_s || std::abs(wheel_v_) > kSettled_m_s ||
                      std::abs(twist_.angular.z()) > kSettled_rad_s;
  return {planned_way_ - way_of_wheels(), heading_error_, moving};
}

void WheelsDrive::read_wheel_rates() {
  double left = 0.0, right = 0.0;
  const size_t of_left = description_.left_joints.size();
  for (size_t i = 0; i < wheels_.size(); ++i) (i < of_left ? left : right) += physics_.wheel_rate(wheels_[i]);
  left *= description_.wheel_radius / static_cast<double>(of_left);
  right *= description_.wheel_radius / static_cast<double>(wheels_.size() - of_left);
  wheel_v_ = 0.5 * (left + right);
  wheel_omega_ = (right - left) / description_.track;
}

void WheelsDrive::fall_asleep_when_still() {
  const bool still = motion_.resting() && twist_.linear.norm() < kStill_m_s && twist_.angular.norm() < kStill_rad_s &&
                     std::abs(wheel_v_) < kStill_m_s;
  still_us_ = still ? still_us_ + step_us_ : 0;
  if (still_us_ < kFallAsleep_us) return;
  asleep_ = true;
  twist_ = {};
  wheel_v_ = wheel_omega_ = 0.0;
  heading_error_ = slip_correction_ = 0.0;
  planned_way_ = way_of_wheels();
  for (const int wheel : wheels_) physics_.drive_wheel(wheel, 0.0, max_torque_);
  for (const int body : bodies_) physics_.sleep(body);
}

void WheelsDrive::read_wheels(Snapshot& snapshot) const {
  for (const int wheel : wheels_) {
    snapshot.wheel_angles[static_cast<size_t>(wheel)] = physics_.wheel_angle(wheel);
    snapshot.wheel_rates[static_cast<size_t>(wheel)] = asleep_ ? 0.0 : physics_.wheel_rate(wheel);
  }
}

}  // namespace ruedo::robot
