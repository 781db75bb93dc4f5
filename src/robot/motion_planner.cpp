// Turns commands into plans. The plan's clock counts whole microseconds; events within a step (the
// watchdog) split it.
#include "robot/motion_planner.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <ruedo/motion_status_t.hpp>
#include <ruedo/move_command_t.hpp>

#include "ruedo/math.h"
#include "ruedo/quantity.h"
#include "world/drives/drive.h"

namespace ruedo::robot {

namespace {

using Status = ruedo::motion_status_t;
using Move = ruedo::move_command_t;

constexpr SimTime kNever = std::numeric_limits<SimTime>::max();
// Default limits of a drive that has none.
constexpr double kFastest_m_s = 100.0, kFastest_rad_s = 100.0, kSlowestChange = 1e-6;
// Speeds of a primitive without limits on a robot without limits.
constexpr double kUsualSpeed_m_s = 0.5, kUsualRate_rad_s = 1.0;
constexpr double kLargestValue = 1e6;  // m or rad
constexpr double kDone = 1e-6;  // m or rad: a disturbed primitive is done within this tolerance
// A primitive is blocked if, for this time, something touched the robot and less than this fraction
// of the plan was executed.
constexpr SimTime kBlockWindow_us = 500'000;
constexpr double kBlockedPart = 0.1;
constexpr double kJitter = 5e-3;  // m or rad in that time: counts as no motion
// A robot this close to its plan has settled. If it does not settle within this time after the
// plan's end (as when sliding on a slope), the primitive ends where the robot is.
constexpr double kSettled_m = 5e-4, kSettled_rad = 1e-3;
constexpr double kSettling_s = 1.0;

Limits sane(double speed, double acceleration, double deceleration, double fastest) {
  return {std::clamp(speed, 0.0, fastest), std::max(acceleration, kSlowestChange),
          std::max(deceleration, kSlowestChange)};
}

// A wheel rate beyond any robot's, for which sums stay finite.
double countable(double rate) {
  return std::clamp(rate, -quantity::kSpeed.most, quantity::kSpeed.most);
}

bool all_finite(std::initializer_list<double> values) {
  return std::all_of(values.begin(), values.end(),
                     [](double value) { return std::isfinite(value); });
}

}  // namespace

MotionPlanner::MotionPlanner(const world::DriveDescription& drive, const std::vector<Vec3>& rims)
    : deadline_(kNever),
      drive_(drive),
      kinematics_(drive.on_odometry ? WheelKinematics::believed(drive)
                                    : WheelKinematics::real(drive)),
      way_limits_(sane(drive.max_speed, drive.acceleration, drive.deceleration, kFastest_m_s)),
      angle_limits_(sane(drive.max_turn_rate, drive.turn_acceleration, drive.turn_acceleration,
                         kFastest_rad_s)),
      side_limits_(
          sane(drive.max_side_speed, drive.acceleration, drive.deceleration, kFastest_m_s)) {
  if (moves_sideways() && rims.size() >= 3) rims_ = rims;
  if (drive.max_wheel_rate * drive.wheel_radius < way_limits_.speed)
    way_limits_.speed = drive.max_wheel_rate * drive.wheel_radius;
  const double turning = 2.0 * drive.max_wheel_rate * drive.wheel_radius / drive.track;
  if (turning < angle_limits_.speed) angle_limits_.speed = turning;
}

using Steering = world::DriveDescription::Steering;

bool MotionPlanner::is_steered() const {
  return drive_->steering == Steering::ackermann || drive_->steering == Steering::tricycle;
}

bool MotionPlanner::moves_sideways() const { return world::moves_sideways(drive_->steering); }

void MotionPlanner::show(int64_t id, int8_t kind, int8_t state, int8_t reason,
                         LinkIndex blocked_by) {
  MotionState shown;
  shown.id = id;
  shown.kind = kind;
  shown.state = state;
  shown.reason = reason;
  shown.blocked_by = blocked_by;
  log_.set(shown);
  publish_progress();
}

void MotionPlanner::refuse(int64_t id, int8_t kind, int8_t reason) {
  MotionState refused;
  refused.id = id;
  refused.kind = kind;
  refused.state = Status::STATE_REFUSED;
  refused.reason = reason;
  log_.mention(refused);
}

void MotionPlanner::replace_running() {
  if (primitive_.axis == Axis::none) return;
  MotionState ended = log_.current();
  ended.state = Status::STATE_ENDED;
  ended.reason = Status::REASON_REPLACED;
  log_.mention(ended);
  primitive_ = {};
}

void MotionPlanner::exchange(StateArchive& archive) {
  archive(v_, omega_, side_, steering_, steady_, resting_, deadline_, start_, plan_v_, plan_omega_,
          plan_side_, plan_steering_, target_v_, target_omega_, target_side_, target_steering_,
          by_wheels_, holding_, primitive_, window_start_, window_done_, window_fastest_,
          window_made_, window_planned_, window_touched_, window_work_, log_);
}

void MotionPlanner::command(const VelocityCommand& command, SimTime now) {
  if (!all_finite({command.vx, command.vy, command.omega}))
    return refuse(0, Status::KIND_VELOCITY, Status::REASON_NOT_FINITE);
  if (command.vy != 0.0 && !moves_sideways())
    return refuse(0, Status::KIND_VELOCITY, Status::REASON_BAD_VALUE);
  set_velocity(command.vx, command.vy, command.omega, now, Status::KIND_VELOCITY);
}

void MotionPlanner::command(const WheelCommand& command, SimTime now) {
  const size_t left = drive_->left_joints.size(), right = drive_->right_joints.size(),
               n = command.rates.size();
  if (!rims_.empty() && n == rims_.size()) return hold_wheels(command, now);
  const bool sides =
      drive_->steering == Steering::differential || drive_->steering == Steering::tracked;
  if (!sides || (n != 2 && n != left + right) || !(drive_->wheel_radius > 0.0) ||
      !(drive_->track > 0.0)) {
    return refuse(0, Status::KIND_WHEELS, Status::REASON_BAD_VALUE);
  }
  for (const double rate : command.rates) {
    if (!std::isfinite(rate)) return refuse(0, Status::KIND_WHEELS, Status::REASON_NOT_FINITE);
  }
  // The wheels of a side are coupled: their mean counts.
  const size_t of_left = n == 2 ? 1 : left;
  double left_rate = 0.0, right_rate = 0.0;
  for (size_t i = 0; i < n; ++i)
    (i < of_left ? left_rate : right_rate) += countable(command.rates[i]);
  left_rate /= static_cast<double>(of_left);
  right_rate /= static_cast<double>(n - of_left);
  const PlaneMotion motion = kinematics_.motion({left_rate, right_rate});
  set_velocity(motion.v, 0.0, motion.omega, now, Status::KIND_WHEELS);
}

// For mecanum and omni wheels: the twist with the least squared error of rates.
void MotionPlanner::hold_wheels(const WheelCommand& command, SimTime now) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Vec3 sum = Vec3::Zero();
  for (size_t i = 0; i < rims_.size(); ++i) {
    if (!std::isfinite(command.rates[i]))
      return refuse(0, Status::KIND_WHEELS, Status::REASON_NOT_FINITE);
    normal += rims_[i] * rims_[i].transpose();
    sum += rims_[i] * (drive_->wheel_radius * countable(command.rates[i]));
  }
  const Vec3 twist = normal.ldlt().solve(sum);
  if (!twist.allFinite()) return refuse(0, Status::KIND_WHEELS, Status::REASON_BAD_VALUE);
  set_velocity(twist.x(), twist.y(), twist.z(), now, Status::KIND_WHEELS);
}

// The combination may be too fast for a wheel: the direction is kept.
void MotionPlanner::keep_wheel_rates(double& v, double& side, double& omega) const {
  if (!std::isfinite(drive_->max_wheel_rate) || is_steered()) return;
  double fastest = std::abs(v) + 0.5 * drive_->track * std::abs(omega);
  if (!rims_.empty()) {
    fastest = 0.0;
    for (const Vec3& rim : rims_)
      fastest = std::max(fastest, std::abs(rim.dot(Vec3(v, side, omega))));
  }
  const double allowed = drive_->max_wheel_rate * drive_->wheel_radius;
  if (fastest <= allowed) return;
  v *= allowed / fastest;
  side *= allowed / fastest;
  omega *= allowed / fastest;
}

// At rest it can only turn its wheels.
void MotionPlanner::steer_for(double v, double omega) {
  const double most = drive_->max_steering_angle;
  if (v != 0.0)
    target_steering_ = std::clamp(math::atan(drive_->wheelbase * omega / v), -most, most);
  else if (omega != 0.0)
    target_steering_ = std::copysign(most, omega * drive_->wheelbase);
}

void MotionPlanner::set_velocity(double v, double side, double omega, SimTime now, int8_t kind) {
  v = std::clamp(v, -way_limits_.speed, way_limits_.speed);
  side = std::clamp(side, -side_limits_.speed, side_limits_.speed);
  omega = std::clamp(omega, -angle_limits_.speed, angle_limits_.speed);
  keep_wheel_rates(v, side, omega);
  replace_running();
  by_wheels_ = kind == Status::KIND_WHEELS;
  const bool same = holding_ && v == target_v_ && omega == target_omega_ && side == target_side_;
  // Any other command continues with the known progress of the last one.
  const bool anew = !holding_ || (!same && turns_round(v, side, omega));
  holding_ = true;
  deadline_ = drive_->watchdog_us > 0 ? now + drive_->watchdog_us : kNever;
  const bool blocked = !anew && log_.current().reason == Status::REASON_BLOCKED;
  show(0, kind, Status::STATE_RUNNING, blocked ? Status::REASON_BLOCKED : Status::REASON_NONE,
       blocked ? log_.current().blocked_by : LinkIndex());
  if (same) return;  // a repeated command only resets the watchdog
  if (anew) begin_window(now);
  target_v_ = v;
  target_omega_ = omega;
  target_side_ = side;
  if (is_steered()) steer_for(v, omega);
  set_plan(Profile::to_velocity(v_, v, way_limits_),
           Profile::to_velocity(omega_, omega, angle_limits_), now, side);
}

// From the last target to these: it stood, or shall stand, or goes the other way. The turn rate
// only counts on the spot: a wall follower corrects it all the time.
bool MotionPlanner::turns_round(double v, double side, double omega) const {
  const auto stands = [](double x, double y, double turn) {
    return x == 0.0 && y == 0.0 && turn == 0.0;
  };
  if (stands(v, side, omega) || stands(target_v_, target_side_, target_omega_)) return true;
  const bool on_the_spot = v == 0.0 && side == 0.0 && target_v_ == 0.0 && target_side_ == 0.0;
  return v * target_v_ < 0.0 || side * target_side_ < 0.0 ||
         (on_the_spot && omega * target_omega_ < 0.0);
}

Limits MotionPlanner::stricter(const Limits& own, const MoveCommand& command,
                               double fallback_speed) {
  Limits limits = own;
  if (command.speed > 0.0) limits.speed = std::min(limits.speed, command.speed);
  if (command.speed == 0.0 && limits.speed >= kFastest_m_s) limits.speed = fallback_speed;
  if (command.acceleration > 0.0)
    limits.acceleration = std::min(limits.acceleration, command.acceleration);
  const double deceleration =
      command.deceleration > 0.0 ? command.deceleration : command.acceleration;
  if (deceleration > 0.0) limits.deceleration = std::min(limits.deceleration, deceleration);
  return limits;
}

int8_t MotionPlanner::aim_on_arc(const MoveCommand& command, Primitive& next) const {
  const double radius = command.radius;
  if (!(radius > 0.0)) return Status::REASON_BAD_VALUE;
  next.axis = Axis::arc;
  next.target = std::abs(command.value) * radius;
  next.unit = command.value < 0.0 ? -1.0 / radius : 1.0 / radius;
  next.curvature = next.unit;
  if (is_steered() && std::abs(drive_->wheelbase) > math::tan(drive_->max_steering_angle) * radius)
    return Status::REASON_NOT_POSSIBLE;
  Limits& limits = next.limits = stricter(way_limits_, command, kUsualSpeed_m_s);
  limits.speed = std::min(limits.speed, angle_limits_.speed * radius);
  limits.acceleration = std::min(limits.acceleration, angle_limits_.acceleration * radius);
  limits.deceleration = std::min(limits.deceleration, angle_limits_.deceleration * radius);
  if (std::isfinite(drive_->max_wheel_rate)) {
    const double outer = 1.0 + 0.5 * drive_->track / radius;
    limits.speed = std::min(limits.speed, drive_->max_wheel_rate * drive_->wheel_radius / outer);
  }
  return Status::REASON_NONE;
}

int8_t MotionPlanner::aim(const MoveCommand& command, double heading, Primitive& next) const {
  if (command.kind < Move::ADVANCE || command.kind > Move::STOP) return Status::REASON_BAD_KIND;
  if (!all_finite({command.value, command.radius, command.speed, command.acceleration,
                   command.deceleration}))
    return Status::REASON_NOT_FINITE;
  if (is_steered() && (command.kind == Move::ROTATE || command.kind == Move::HEADING))
    return Status::REASON_NOT_POSSIBLE;
  if (command.speed < 0.0 || command.acceleration < 0.0 || command.deceleration < 0.0)
    return Status::REASON_BAD_VALUE;
  switch (command.kind) {
    case Move::ADVANCE:
      next.axis = Axis::way;
      next.target = command.value;
      next.limits = stricter(way_limits_, command, kUsualSpeed_m_s);
      break;
    case Move::ROTATE:
    case Move::HEADING:
      next.axis = Axis::angle;
      next.target =
          command.kind == Move::ROTATE ? command.value : wrap_angle(command.value - heading);
      next.limits = stricter(angle_limits_, command, kUsualRate_rad_s);
      break;
    case Move::ARC:
      if (const int8_t reason = aim_on_arc(command, next); reason != Status::REASON_NONE)
        return reason;
      break;
    default: return Status::REASON_NONE;  // STOP
  }
  Limits& limits = next.limits;
  const bool too_far = std::abs(next.target) > kLargestValue ||
                       std::abs(command.value) > kLargestValue || command.radius > kLargestValue;
  const bool too_slow = limits.speed < kSlowestChange || limits.acceleration < kSlowestChange ||
                        limits.deceleration < kSlowestChange;
  limits.speed = std::max(command.share * limits.speed, kSlowestChange);
  return too_far || too_slow ? Status::REASON_BAD_VALUE : Status::REASON_NONE;
}

void MotionPlanner::command(const MoveCommand& command, SimTime now, double heading) {
  Primitive next;
  if (const int8_t reason = aim(command, heading, next); reason != Status::REASON_NONE)
    return refuse(command.id, command.kind, reason);
  replace_running();
  holding_ = by_wheels_ = false;
  deadline_ = kNever;
  primitive_ = next;
  show(command.id, command.kind, Status::STATE_RUNNING);
  if (next.axis != Axis::none) {
    plan_primitive(now);
  } else {
    Limits stopping = way_limits_;
    if (command.deceleration > 0.0)
      stopping.deceleration = std::min(stopping.deceleration, command.deceleration);
    set_plan(Profile::to_velocity(v_, 0.0, stopping),
             Profile::to_velocity(omega_, 0.0, angle_limits_), now);
  }
  begin_window(now);
}

void MotionPlanner::set_plan(const Profile& v, const Profile& omega, SimTime now, double side) {
  start_ = now;
  plan_v_ = v;
  plan_omega_ = omega;
  if (moves_sideways()) plan_side_ = Profile::to_velocity(side_, side, side_limits_);
  if (is_steered())
    plan_steering_ = SteeringPlan::between(steering_, target_steering_, drive_->max_steering_rate);
  take_speeds(now);
}

// Takes the plan's velocities at that time; infinite accelerations are completed.
void MotionPlanner::take_speeds(SimTime to) {
  const double t = seconds(to);
  v_ = plan_v_.velocity(t);
  omega_ = plan_omega_.velocity(t);
  steady_ = t >= plan_v_.end() && t >= plan_omega_.end();
  if (moves_sideways()) {
    side_ = plan_side_.velocity(t);
    steady_ = steady_ && t >= plan_side_.end();
  } else if (is_steered()) {
    steering_ = plan_steering_.angle(t);
    omega_ = v_ * math::tan(steering_) / drive_->wheelbase;
    steady_ = t >= plan_v_.end() && t >= plan_steering_.end;
  }
  const bool stopping =
      log_.current().kind == Move::STOP && log_.current().state == Status::STATE_RUNNING;
  resting_ = steady_ && v_ == 0.0 && omega_ == 0.0 && side_ == 0.0 && deadline_ == kNever &&
             primitive_.axis == Axis::none && !stopping;
}

void MotionPlanner::plan_primitive(SimTime now) {
  Primitive& p = primitive_;
  const double rest = p.target - p.done;
  p.done_before_plan = p.done;
  p.begins = p.begins_at = 0.0;
  Profile v, omega;
  if (is_steered()) {
    target_steering_ = p.axis == Axis::arc ? math::atan(drive_->wheelbase * p.curvature) : 0.0;
    if (p.axis == Axis::way || steering_ == target_steering_) {
      v = Profile::to_distance(v_, rest, p.limits);
    } else {  // an arc starts at rest, where its wheels are steered
      v = Profile::to_velocity(v_, 0.0, way_limits_);
      p.begins = std::max(
          v.end(),
          SteeringPlan::between(steering_, target_steering_, drive_->max_steering_rate).end);
      p.begins_at = v.position(p.begins);
      v.append(Profile::to_distance(0.0, rest, p.limits), p.begins);
    }
  } else if (p.axis == Axis::way) {
    v = Profile::to_distance(v_, rest, p.limits);
    omega = Profile::to_velocity(omega_, 0.0, angle_limits_);
  } else if (p.axis == Axis::angle) {
    v = Profile::to_velocity(v_, 0.0, way_limits_);
    omega = Profile::to_distance(omega_, rest, p.limits);
  } else if (std::abs(omega_ - p.curvature * v_) <= 1e-12 * (1.0 + std::abs(omega_))) {
    v = Profile::to_distance(v_, rest, p.limits);
    omega = v.scaled(p.curvature);
  } else {  // an arc starts at rest, where its curvature is possible
    v = Profile::to_velocity(v_, 0.0, way_limits_);
    omega = Profile::to_velocity(omega_, 0.0, angle_limits_);
    p.begins = std::max(v.end(), omega.end());
    p.begins_at = v.position(p.begins);
    const Profile along = Profile::to_distance(0.0, rest, p.limits);
    v.append(along, p.begins);
    omega.append(along.scaled(p.curvature), p.begins);
  }
  set_plan(v, omega, now);
}

void MotionPlanner::brake(SimTime now) {
  primitive_ = {};
  holding_ = false;
  deadline_ = kNever;
  set_plan(Profile::to_velocity(v_, 0.0, way_limits_),
           Profile::to_velocity(omega_, 0.0, angle_limits_), now);
}

void MotionPlanner::stand_still(SimTime now) {
  const MotionState state = log_.current();
  v_ = omega_ = side_ = target_v_ = target_omega_ = target_side_ = 0.0;
  target_steering_ = steering_;
  brake(now);
  if (state.state != Status::STATE_RUNNING) return;
  show(state.id, state.kind, Status::STATE_ENDED, Status::REASON_REPLACED);
  log_.progress(state.done, state.remaining);
  take_speeds(now);  // at rest from now on
}

void MotionPlanner::shift_time(SimTime us) {
  start_ -= us;
  window_start_ -= us;
  if (deadline_ != kNever) deadline_ -= us;
}

Displacement MotionPlanner::way_of(double begin, double end) const {
  if (is_steered())
    return integrate_steered(plan_v_, plan_steering_, drive_->wheelbase, begin, end);
  if (moves_sideways()) return integrate(plan_v_, plan_side_, plan_omega_, begin, end);
  return integrate(plan_v_, plan_omega_, begin, end);
}

Displacement MotionPlanner::step(SimTime now, int64_t step_us) {
  if (resting_) return {};
  const SimTime end = now + step_us;
  if (steady_ && end < deadline_) {
    const double step_s = static_cast<double>(step_us) * 1e-6;
    return side_ == 0.0 ? along_arc(v_ * step_s, omega_ * step_s)
                        : along_twist(v_ * step_s, side_ * step_s, omega_ * step_s);
  }
  Displacement way;
  if (deadline_ < end) {  // the watchdog ends the command within this step
    const SimTime deadline = std::max(deadline_, now);
    way = way_of(seconds(now), seconds(deadline));
    take_speeds(deadline);
    const int8_t kind = log_.current().kind;
    const bool moving = target_v_ != 0.0 || target_omega_ != 0.0 || target_side_ != 0.0 ||
                        v_ != 0.0 || omega_ != 0.0 || side_ != 0.0;
    if (moving) {
      show(0, kind, Status::STATE_ENDED, Status::REASON_WATCHDOG);
    } else {
      show(0, kind, Status::STATE_DONE);
    }
    brake(deadline);
    way = chained(way, way_of(seconds(deadline), seconds(end)));
  } else {
    way = way_of(seconds(now), seconds(end));
  }
  take_speeds(end);
  return way;
}

bool MotionPlanner::settled(SimTime now, const Lag& lag) const {
  const bool near = std::abs(lag.way) < kSettled_m && std::abs(lag.angle) < kSettled_rad;
  return (near && !lag.moving) ||
         seconds(now) >
             std::max({plan_v_.end(), plan_omega_.end(), plan_side_.end()}) + kSettling_s;
}

void MotionPlanner::finish(SimTime now, double way, double angle, bool touched, const Lag& lag,
                           double side) {
  if (resting_) return;
  Primitive& p = primitive_;
  if (p.axis == Axis::none) {
    const bool stopping =
        log_.current().kind == Move::STOP && log_.current().state == Status::STATE_RUNNING;
    if (stopping && steady_ && settled(now, lag)) {
      show(log_.current().id, Move::STOP, Status::STATE_DONE);
      take_speeds(now);
    }
    if (holding_) watch_held(now, {way, side, angle}, touched);
    return;
  }
  const double t = seconds(now);
  const Profile& profile = p.axis == Axis::angle ? plan_omega_ : plan_v_;
  const double planned = t < p.begins ? 0.0 : profile.position(t) - p.begins_at;
  if (!touched) {
    p.done = p.done_before_plan + planned - (p.axis == Axis::angle ? lag.angle : lag.way);
  } else if (t >= p.begins) {
    p.done += p.axis == Axis::angle ? angle : way;
  }
  const bool over = t >= profile.end() && steady_;
  if (over && (touched ? std::abs(p.target - p.done) <= kDone : settled(now, lag))) {
    if (!touched && !lag.moving && lag.way == 0.0 && lag.angle == 0.0) p.done = p.target;
    publish_progress();
    const MotionState state = log_.current();
    p = {};
    show(state.id, state.kind, Status::STATE_DONE);
    log_.progress(state.done, state.remaining);
    take_speeds(now);
    return;
  }
  watch_for_block(now, touched);
  publish_progress();
  if (touched && p.axis != Axis::none && t >= p.begins)
    plan_primitive(now);  // the remainder, from where it really is
}

void MotionPlanner::begin_window(SimTime now) {
  window_start_ = now;
  window_done_ = window_fastest_ = 0.0;
  window_made_.setZero();
  window_planned_.setZero();
  window_touched_ = false;
  window_work_.clear();
}

void MotionPlanner::resist(LinkIndex link, double work) {
  const auto known = std::find_if(window_work_.begin(), window_work_.end(),
                                  [link](const auto& each) { return each.first == link; });
  if (known == window_work_.end()) {
    window_work_.emplace_back(link, work);
  } else {
    known->second += work;
  }
}

// The link that absorbed the most work in the window; among equals the lowest link.
LinkIndex MotionPlanner::strongest() const {
  const auto weaker = [](const auto& a, const auto& b) {
    return a.second < b.second || (a.second == b.second && a.first > b.first);
  };
  const auto most = std::max_element(window_work_.begin(), window_work_.end(), weaker);
  return most == window_work_.end() ? LinkIndex() : most->first;
}

// A velocity command keeps running; its status says while it makes no progress. Commands may
// change all the time: progress is what was made in the direction of the plan, whatever it was.
void MotionPlanner::watch_held(SimTime now, const Vec3& made, bool touched) {
  window_touched_ |= touched;
  const Vec3 planned(v_, side_, omega_);
  for (int i = 0; i < 3; ++i) window_made_[i] += std::copysign(1.0, planned[i]) * made[i];
  window_planned_ = window_planned_.cwiseMax(planned.cwiseAbs());
  // It is still braking from the opposite direction: no progress yet, but not blocked.
  const bool on_the_spot = target_v_ == 0.0 && target_side_ == 0.0;
  if (v_ * target_v_ < 0.0 || side_ * target_side_ < 0.0 ||
      (on_the_spot && omega_ * target_omega_ < 0.0))
    return begin_window(now);
  if (now - window_start_ < kBlockWindow_us) return;
  const double seconds = static_cast<double>(now - window_start_) * 1e-6;
  const auto is_short = [&](int i) {
    return std::abs(window_made_[i]) <= kJitter + kBlockedPart * window_planned_[i] * seconds;
  };
  const bool stuck = is_short(0) && (!moves_sideways() || is_short(1)) && is_short(2);
  const bool blocked = !window_planned_.isZero(0.0) && window_touched_ && stuck;
  const int8_t reason = blocked ? Status::REASON_BLOCKED : Status::REASON_NONE;
  if (log_.current().state == Status::STATE_RUNNING)
    show(0, log_.current().kind, Status::STATE_RUNNING, reason,
         blocked ? strongest() : LinkIndex());
  begin_window(now);
}

void MotionPlanner::watch_for_block(SimTime now, bool touched) {
  window_touched_ |= touched;
  const double planned = primitive_.axis == Axis::angle ? omega_ : v_;
  window_fastest_ = std::max(window_fastest_, std::abs(planned));
  // It is still braking, before its own motion begins.
  if (seconds(now) < primitive_.begins || planned * (primitive_.target - primitive_.done) < 0.0) {
    begin_window(now);
    window_done_ = primitive_.done;
    return;
  }
  if (now - window_start_ < kBlockWindow_us) return;
  const double wanted = window_fastest_ * static_cast<double>(now - window_start_) * 1e-6;
  if (window_touched_ && std::abs(primitive_.done - window_done_) < kBlockedPart * wanted) {
    publish_progress();
    const MotionState state = log_.current();
    brake(now);
    show(state.id, state.kind, Status::STATE_ENDED, Status::REASON_BLOCKED, strongest());
    log_.progress(state.done, state.remaining);
    return;
  }
  begin_window(now);
  window_done_ = primitive_.done;
}

void MotionPlanner::publish_progress() {
  if (primitive_.axis == Axis::none) return;
  log_.progress(primitive_.done * primitive_.unit,
                (primitive_.target - primitive_.done) * primitive_.unit);
}

}  // namespace ruedo::robot
