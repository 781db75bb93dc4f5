// Servos and odometry of the wheels drive.
#include "robot/wheels_drive.h"

#include <algorithm>
#include <cmath>

#include "ruedo/math.h"

namespace ruedo::robot {

namespace {

// Default gains if the file gives none: time constants for a wheel, with its share of the robot's
// mass, to reach its rate, and to make up for its lag.
constexpr double kRateTime_s = 0.01, kAngleTime_s = 0.02;
// maximum lag of a servo; if the robot is held, it does not wind up further
constexpr double kLargestLag_m = 0.05;
constexpr double kSteeringTorque = 100.0;  // N m per rad/s of error: steering uses all its torque
// fraction of the lag corrected in one step; more would overshoot
constexpr double kMostOfLag = 0.5;
constexpr double kLargestYawError_rad = 0.3;
constexpr SimTime kFallAsleep_us = 500'000;
// thresholds for the end of a primitive
constexpr double kSettled_m_s = 2e-3, kSettled_rad_s = 1e-2;
constexpr double kStill_m_s = 5e-3, kStill_rad_s = 2e-2;

// The base, the wheels, and the suspension between them.
std::vector<BodyIndex> bodies_of(const world::WorldModel& world, const world::BodyLayout& layout,
                                 RobotIndex robot) {
  const world::RobotPlacement& placement = layout.robots[robot];
  std::vector<BodyIndex> bodies{placement.body};
  const auto add = [&](BodyIndex body) {
    if (!body.valid() || std::find(bodies.begin(), bodies.end(), body) != bodies.end())
      return false;
    bodies.push_back(body);
    return true;
  };
  for (const WheelIndex index : placement.wheels) add(layout.links[layout.wheels[index].link].body);
  for (const WheelIndex index : placement.wheels) {
    const auto& model = *world.models[placement.instance].model;
    const ModelLinkIndex holder = model.joints[layout.wheels[index].joint].parent;
    if (!holder.valid()) continue;
    BodyIndex body = layout.links[layout.link_of(placement.instance, holder)].body;
    while (add(body)) {
      const auto above =
          std::find_if(placement.joints.begin(), placement.joints.end(),
                       [&](JointIndex joint) { return layout.joints[joint].child_body == body; });
      if (above != placement.joints.end()) body = layout.joints[*above].parent_body;
    }
  }
  return bodies;
}

}  // namespace

WheelsDrive::WheelsDrive(const world::WorldModel& world, const world::BodyLayout& layout,
                         physics::PhysicsWorld& physics, RobotIndex robot,
                         const std::vector<world::LevelPlane>& planes)
    : Drive(world, layout, physics, robot),
      servos_(wheels_.size()),
      planes_(planes),
      lowest_(lowest_of_wheels(world, layout, robot)),
      max_torque_(description_->max_wheel_torque),
      believed_(WheelKinematics::believed(description_)) {
  place_wheels(layout);
  bodies_ = bodies_of(world, layout, robot);
  for (const BodyIndex body : layout.bodies.indices())
    if (layout.bodies[body].instance == layout.robots[robot].instance) all_bodies_.push_back(body);
  double mass = 0.0;
  for (const BodyIndex body : bodies_) mass += physics.mass(body);
  set_gains(mass);
  begin_at_rest();
}

void WheelsDrive::place_wheels(const world::BodyLayout& layout) {
  if (world::BaseOdometry::is_for(description_))
    base_.emplace(layout, robot_, description_, description_->track_error, 0.0);
  const Pose X_BaseW = (layout.bodies[body_].X_WB * X_BBase_).inverse();
  for (const WheelIndex index : wheels_) {
    const world::WheelPlacement& wheel = layout.wheels[index];
    const world::WheelPlacement& place = wheel.on.valid() ? layout.wheels[wheel.on] : wheel;
    const world::LinkPlacement& link = layout.links[place.link];
    const Vec3 p_Base = X_BaseW * (layout.bodies[link.body].X_WB * (link.X_BL * place.center_in_L));
    places_.push_back(
        {wheel.left, wheel.steers, wheel.on.valid(), wheel.rim, p_Base.x(), p_Base.y()});
  }
}

void WheelsDrive::set_gains(double mass) {
  const double r = description_->wheel_radius;
  const auto rolling = static_cast<double>(
      std::count_if(places_.begin(), places_.end(), [](const Place& at) { return !at.steers; }));
  if (rolling > 0) max_torque_ = std::min(max_torque_, description_->max_force * r / rolling);
  max_torque_ = std::min(max_torque_, description_->stall_torque * description_->gear);
  for (size_t i = 0; i < servos_.size(); ++i) {
    Servo& servo = servos_[i];
    const double inertia = mass * r * r / rolling;
    if (places_[i].steers) {
      servo.rate_gain = inertia / kRateTime_s;
      servo.angle_gain = servo.rate_gain / kAngleTime_s;
      continue;
    }
    servo.rate_gain =
        description_->servo_rate_gain > 0.0 ? description_->servo_rate_gain : inertia / kRateTime_s;
    servo.angle_gain = description_->servo_angle_gain > 0.0 ? description_->servo_angle_gain
                                                            : servo.rate_gain / kAngleTime_s;
  }
}

// The values of each wheel, in the order of wheels_.
SideRates WheelsDrive::mean_of_sides(const std::vector<double>& of_wheels) const {
  SideRates sum{};
  for (size_t i = 0; i < of_wheels.size(); ++i)
    (places_[i].left ? sum.left : sum.right) += of_wheels[i];
  const size_t left = description_->left_joints.size();
  return {sum.left / static_cast<double>(left),
          sum.right / static_cast<double>(wheels_.size() - left)};
}

void WheelsDrive::begin_at_rest() {
  leave_the_ground();
  stand_still();
}

// The wheels of many models reach into the ground: contacts would throw the robot out.
void WheelsDrive::leave_the_ground() {
  constexpr double kGives_m = 5e-3, kLevel_rad = 5e-3;
  const auto plane = nearest_plane(planes_, X_WBase_.translation.z() + lowest_);
  const Vec3 up = X_WBase_.rotation * Vec3::UnitZ();
  if (!plane || up.z() <= math::cos(kLevel_rad)) return;
  const double deep = plane->height - (X_WBase_.translation.z() + lowest_);
  if (deep < kGives_m || deep > description_->wheel_radius) return;
  for (const BodyIndex body : all_bodies_) {
    Pose X_WB = physics_->pose(body);
    X_WB.translation.z() += deep;
    physics_->set_pose(body, X_WB);
  }
  X_WBase_.translation.z() += deep;
}

void WheelsDrive::stand_still() {
  last_angles_.resize(wheels_.size());
  for (size_t i = 0; i < wheels_.size(); ++i)
    last_angles_[i] = servos_[i].angle = physics_->wheel_angle(wheels_[i]);
  way_missing_ = angle_missing_ = yaw_integral_ = 0.0;
}

void WheelsDrive::wake() {
  asleep_ = false;
  still_us_ = 0;
  for (const BodyIndex body : bodies_) physics_->wake(body);
}

void WheelsDrive::exchange(StateArchive& archive) {
  Drive::exchange(archive);
  archive(servos_, last_angles_, believed_rate_, way_, way_missing_, angle_missing_, yaw_integral_,
          still_us_, asleep_);
  if (base_) archive(*base_);
}

void WheelsDrive::before_step(SimTime now) {
  if (asleep_) {
    if (physics_->sleeping(body_)) return;
    wake();
  }
  way_ = planner_.step(now, step_us_);
  way_missing_ += way_.way;
  angle_missing_ += way_.angle;
  turn_wheels(way_);
}

// rad/s, from the gyro; wheel commands are not affected.
double WheelsDrive::yaw_correction() {
  const double gain = description_->yaw_gain;
  if (gain <= 0.0 || planner_.by_wheels()) return 0.0;
  const double error = std::clamp(angle_missing_, -kLargestYawError_rad, kLargestYawError_rad);
  yaw_integral_ += 0.25 * gain * gain * error * step_s_;  // critically damped
  const double most = 3.0 * std::abs(planner_.omega()) + 0.1;
  yaw_integral_ = std::clamp(yaw_integral_, -most, most);
  return gain * error + yaw_integral_;
}

void WheelsDrive::turn_wheels(const Displacement& way) {
  const Vec3 twist(way.way / step_s_, way.side / step_s_, way.angle / step_s_ + yaw_correction());
  const double curvature = planner_.curvature();
  const SideRates sides = base_ ? SideRates{} : believed_.wheels({twist.x(), twist.z()});
  for (size_t i = 0; i < wheels_.size(); ++i) {
    if (places_[i].steers) {
      steer(i, steering_of(i, curvature));
      continue;
    }
    const double rate = base_             ? rate_of(i, twist, curvature)
                        : places_[i].left ? sides.left
                                          : sides.right;
    drive_wheel(i, std::clamp(rate, -description_->max_wheel_rate, description_->max_wheel_rate));
  }
}

// rad/s, from the radii and lever arms that the robot believes; curvature: 1/m, for steered bases.
double WheelsDrive::rate_of(size_t wheel, const Vec3& twist, double curvature) const {
  const Place& at = places_[wheel];
  const double radius =
      description_->wheel_radius * (1.0 + description_->radius_error[at.left ? 0 : 1]);
  const double lever = 1.0 + description_->track_error;
  if (base_->rolls_sideways())
    return Vec3(at.rim.x(), at.rim.y(), at.rim.z() * lever).dot(twist) / radius;
  const double along = 1.0 - curvature * lever * at.y;
  return twist.x() * (at.steered ? math::hypot(along, curvature * lever * at.x) : along) / radius;
}

// Perpendicular to the line to the centre of the circle.
double WheelsDrive::steering_of(size_t wheel, double curvature) const {
  const Place& at = places_[wheel];
  const double lever = 1.0 + description_->track_error;
  return math::atan2(curvature * lever * at.x, 1.0 - curvature * lever * at.y);
}

void WheelsDrive::steer(size_t wheel, double angle) {
  Servo& servo = servos_[wheel];
  const double missing = angle - physics_->wheel_angle(wheels_[wheel]);
  physics::WheelServo command;
  command.rate = std::min(servo.angle_gain / servo.rate_gain, kMostOfLag / step_s_) * missing;
  command.gain = servo.rate_gain;
  command.highest_torque = kSteeringTorque * servo.rate_gain;
  command.lowest_torque = -command.highest_torque;
  physics_->drive_wheel(wheels_[wheel], command);
}

void WheelsDrive::drive_wheel(size_t wheel, double rate) {
  Servo& servo = servos_[wheel];
  const double angle = physics_->wheel_angle(wheels_[wheel]),
               most = kLargestLag_m / description_->wheel_radius;
  const double lag = std::clamp(servo.angle + rate * step_s_ - angle, -most, most);
  servo.angle = angle + lag;
  physics::WheelServo command;
  command.rate = rate + std::min(servo.angle_gain / servo.rate_gain, kMostOfLag / step_s_) * lag;
  command.gain = servo.rate_gain;
  // The motor's torque-speed line: less torque the faster it turns, and more against its rotation,
  // up to the stall torque.
  const double part =
      physics_->wheel_rate(wheels_[wheel]) * description_->gear / description_->no_load_rate;
  const double stall = std::isfinite(description_->stall_torque)
                           ? description_->stall_torque * description_->gear
                           : max_torque_;
  command.highest_torque = std::isfinite(stall)
                               ? std::min(max_torque_, stall * std::clamp(1.0 - part, 0.0, 1.0))
                               : max_torque_;
  command.lowest_torque = std::isfinite(stall)
                              ? -std::min(max_torque_, stall * std::clamp(1.0 + part, 0.0, 1.0))
                              : -max_torque_;
  physics_->drive_wheel(wheels_[wheel], command);
}

bool WheelsDrive::touches_something() {
  const Vec3 up = X_WBase_.rotation * Vec3::UnitZ();
  bool touched = false;
  for (const BodyIndex body : bodies_) {
    for (const Contact& contact : physics_->contacts(body)) {
      if (std::abs(contact.normal.dot(up)) >= kSupportNormal) continue;
      touched = true;
      resist(contact);
    }
  }
  return touched;
}

void WheelsDrive::after_step(SimTime now) {
  if (asleep_) {
    velocity_.setZero();
    acceleration_.setZero();
    planner_.show_step();
    return;
  }
  const Pose X_WBase = base_pose().normalized();
  const Quat turn = X_WBase_.rotation.conjugate() * X_WBase.rotation;
  const double turned = wrap_angle(2.0 * math::atan2(turn.z(), turn.w()));
  const Vec3 moved = X_WBase_.rotation.conjugate() * (X_WBase.translation - X_WBase_.translation);
  set_state(X_WBase, base_twist(X_WBase));

  const Vec3 way = believed_way();
  believed_rate_ = way / step_s_;
  PlaneMotion made{way.x(), way.z()};
  read_wheel_rates();
  if (description_->yaw_gain > 0.0)
    made.omega =
        turned * (1.0 + description_->gyro_scale_error) + description_->gyro_bias * step_s_;
  believed_heading_ = wrap_angle(believed_heading_ + made.omega);
  way_missing_ -= made.v;
  angle_missing_ -= made.omega;
  const bool touched = touches_something();
  // A primitive ends by the robot's own estimate; whether a velocity makes progress is judged by
  // its true motion.
  const bool believes = planner_.has_primitive();
  planner_.finish(now, believes ? made.v : moved.x(), believes ? made.omega : turned, touched,
                  lag(), moved.y());
  if (touched && planner_.has_primitive())
    way_missing_ = angle_missing_ = 0.0;  // it was replanned from its estimated position
  if (!planner_.has_primitive()) {        // for a velocity command the lag is not made up
    way_missing_ = 0.0;
    angle_missing_ = std::clamp(angle_missing_, -kLargestYawError_rad, kLargestYawError_rad);
  }
  fall_asleep_when_still();
  planner_.show_step();
}

Lag WheelsDrive::lag() const {
  const bool moving =
      std::abs(wheel_v_) > kSettled_m_s || std::abs(wheel_omega_) > kSettled_rad_s ||
      (description_->yaw_gain > 0.0 && std::abs(twist_.angular.z()) > kSettled_rad_s);
  return {way_missing_, angle_missing_, moving};
}

// m forward, m to the left, rad: of this step, by the encoders.
Vec3 WheelsDrive::believed_way() {
  const SideRates before = mean_of_sides(last_angles_);
  std::vector<double> ways(wheels_.size());
  for (size_t i = 0; i < wheels_.size(); ++i) {
    const double angle = physics_->wheel_angle(wheels_[i]);
    ways[i] = (angle - last_angles_[i]) * description_->wheel_radius *
              (1.0 + description_->radius_error[places_[i].left ? 0 : 1]);
    last_angles_[i] = angle;
  }
  if (base_) return base_->moved(ways, last_angles_);
  const SideRates now = mean_of_sides(last_angles_);
  const PlaneMotion made = believed_.motion({now.left - before.left, now.right - before.right});
  return {made.v, 0.0, made.omega};
}

void WheelsDrive::read_wheel_rates() {
  if (base_) {
    wheel_v_ = believed_rate_.x();
    wheel_omega_ = believed_rate_.z();
    return;
  }
  std::vector<double> rates;
  for (const WheelIndex wheel : wheels_) rates.push_back(physics_->wheel_rate(wheel));
  const PlaneMotion motion = WheelKinematics::real(description_).motion(mean_of_sides(rates));
  wheel_v_ = motion.v;
  wheel_omega_ = motion.omega;
}

void WheelsDrive::fall_asleep_when_still() {
  const bool still = planner_.resting() && physics_->may_sleep(body_) &&
                     twist_.linear.norm() < kStill_m_s && twist_.angular.norm() < kStill_rad_s &&
                     std::abs(wheel_v_) < kStill_m_s;
  still_us_ = still ? still_us_ + step_us_ : 0;
  if (still_us_ < kFallAsleep_us) return;
  asleep_ = true;
  twist_ = {};
  wheel_v_ = wheel_omega_ = 0.0;
  stand_still();
  for (const BodyIndex body : bodies_) physics_->sleep(body);
}

void WheelsDrive::read_wheels(Snapshot& snapshot) const {
  for (const WheelIndex wheel : wheels_) {
    snapshot.wheel_angles[wheel] = physics_->wheel_angle(wheel);
    snapshot.wheel_rates[wheel] = asleep_ ? 0.0 : physics_->wheel_rate(wheel);
  }
}

}  // namespace ruedo::robot
