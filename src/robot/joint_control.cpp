// Position control commands a velocity proportional to the error, within the joint's limits of rate
// and effort.
#include "robot/joint_control.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include <ruedo/joint_command_t.hpp>
#include <ruedo/motion_status_t.hpp>

#include "ruedo/quantity.h"

namespace ruedo::robot {

namespace {

using physics::JointSetting;

constexpr double kGainPerStep = 0.2;  // at most this fraction of the error per step
// The joint's own limit applies, which the physics knows.
constexpr double kUnlimited = std::numeric_limits<double>::infinity();

struct Limits {
  double least, most;
};

// For a command's value; null: unknown mode.
const Limits* limits_of(int8_t mode) {
  constexpr double kLeastGain = 1e-9;
  static constexpr Limits kOfModes[] = {
      {-quantity::kLength.most, quantity::kLength.most},
      {-quantity::kSpeed.most, quantity::kSpeed.most},
      {-quantity::kEffort.most, quantity::kEffort.most},
      {kLeastGain, quantity::kFactor.most},
      {kLeastGain, quantity::kDamping.most},
      {0.0, quantity::kEffort.most},
      {0.0, quantity::kSpeed.most},
      {0.0, 1.0},
      {0.0, quantity::kLength.most},
      {0.0, 1.0},
  };
  return mode >= 0 && static_cast<size_t>(mode) < std::size(kOfModes) ? &kOfModes[mode] : nullptr;
}

}  // namespace

bool takes_commands(const world::Joint& joint) {
  return !joint.leader.valid() && joint.type != world::JointType::gearbox;
}

JointControl::JointControl(const world::WorldModel& world, const world::BodyLayout& layout,
                           physics::PhysicsWorld& physics)
    : world_(world),
      layout_(layout),
      physics_(physics),
      step_s_(static_cast<double>(world.step_us) * 1e-6),
      largest_gain_(kGainPerStep / step_s_),
      holds_(world, layout, physics),
      lifts_(world, layout, physics) {
  targets_.reserve(layout.joints.size());
  for (const JointIndex joint : layout.joints.indices()) begin(joint);
}

const world::Joint& JointControl::description(JointIndex joint) const {
  const auto& placed = layout_->joints[joint];
  return world_->models[placed.instance].model->joints[placed.joint];
}

JointIndex JointControl::find(RobotIndex robot, const std::string& name) const {
  const std::vector<JointIndex>& joints = layout_->robots[robot].joints;
  const auto found = std::find_if(joints.begin(), joints.end(), [&](JointIndex joint) {
    return description(joint).name == name;
  });
  return found == joints.end() ? JointIndex() : *found;
}

int8_t JointControl::check(RobotIndex robot, const std::string& name, int8_t mode,
                           double value) const {
  if (!std::isfinite(value)) return motion_status_t::REASON_NOT_FINITE;
  const Limits* limits = limits_of(mode);
  if (!limits) return motion_status_t::REASON_BAD_KIND;
  if (value > limits->most || value < limits->least) return motion_status_t::REASON_BAD_VALUE;
  const InstanceIndex instance = layout_->robots[robot].instance;
  const auto if_so = [](bool good) {
    return good ? motion_status_t::REASON_NONE : motion_status_t::REASON_BAD_VALUE;
  };
  const bool yes_or_no = value == 0.0 || value == 1.0;
  if (mode == joint_command_t::ATTACHED) return if_so(yes_or_no && holds_.has(instance, name));
  if (mode == joint_command_t::OPEN) return if_so(yes_or_no && lifts_.has_door(instance, name));
  if (mode == joint_command_t::FLOOR) return if_so(lifts_.has_floor(instance, name, value));
  const JointIndex joint = find(robot, name);
  return if_so(joint.valid() && takes_commands(description(joint)));
}

// Commands to a hold, lift or door rather than a joint. True: it was one.
bool JointControl::tell_others(InstanceIndex instance, const std::string& name, int8_t mode,
                               double value) {
  using Mode = joint_command_t;
  switch (mode) {
    case Mode::ATTACHED: holds_.set(instance, name, value != 0.0); return true;
    case Mode::FLOOR: lifts_.call(instance, name, static_cast<int>(value)); return true;
    case Mode::OPEN: lifts_.open(instance, name, value != 0.0); return true;
    default: return false;
  }
}

int8_t JointControl::apply(RobotIndex robot, const JointCommand& command) {
  const size_t n = command.names.size();
  if (command.modes.size() != n || command.values.size() != n)
    return motion_status_t::REASON_BAD_VALUE;
  for (size_t i = 0; i < n; ++i) {
    if (const int8_t reason = check(robot, command.names[i], command.modes[i], command.values[i]))
      return reason;
  }
  for (size_t i = 0; i < n; ++i) {
    if (tell_others(layout_->robots[robot].instance, command.names[i], command.modes[i],
                    command.values[i]))
      continue;
    const JointIndex joint = find(robot, command.names[i]);
    tell(joint, command.modes[i], command.values[i]);
    const auto& placed = layout_->joints[joint];
    if (placed.parent_body.valid()) physics_->wake(placed.parent_body);
    if (placed.child_body.valid()) physics_->wake(placed.child_body);
  }
  return motion_status_t::REASON_NONE;
}

// Applies a command that passed check().
void JointControl::tell(JointIndex joint, int8_t mode, double value) {
  using Mode = joint_command_t;
  const auto of_joint = [joint](const auto& each) { return each.joint == joint; };
  switch (mode) {
    case Mode::RATE_GAIN:
      if (!is_set(joint)) gains_.push_back({joint, description(joint).axis.position_gain});
      return physics_->set_joint(joint, JointSetting::rate_gain, value);
    case Mode::EFFORT_LIMIT: return physics_->set_joint(joint, JointSetting::effort, value);
    case Mode::VELOCITY_LIMIT: return physics_->set_joint(joint, JointSetting::velocity, value);
    case Mode::POSITION_GAIN:
      std::erase_if(gains_, of_joint);
      return gains_.push_back({joint, value});
    default: break;
  }
  set_target(joint, mode, value);
}

// A position, rate or effort command.
void JointControl::set_target(JointIndex joint, int8_t mode, double value) {
  using Mode = joint_command_t;
  std::erase_if(targets_, [joint](const Target& each) { return each.joint == joint; });
  const world::JointAxis& axis = description(joint).axis;
  if (mode == Mode::EFFORT) return physics_->apply_joint_effort(joint, value);
  if (mode == Mode::VELOCITY) {
    if (!axis.rate_pid || is_set(joint))
      return physics_->drive_joint_velocity(joint, value, kUnlimited);
    return targets_.push_back({joint, true, value});
  }
  const bool limited = axis.lower <= axis.upper;
  targets_.push_back({joint, false, limited ? std::clamp(value, axis.lower, axis.upper) : value});
}

void JointControl::begin(JointIndex joint) {
  using Mode = joint_command_t;
  const world::Joint& axis_of = description(joint);
  const world::JointStart& start = axis_of.axis.start;
  if (start.mode == world::JointStart::Mode::free || axis_of.leader.valid()) return;
  const bool rate = start.mode == world::JointStart::Mode::velocity;
  set_target(joint, rate ? Mode::VELOCITY : Mode::POSITION, start.value);
}

void JointControl::start(InstanceIndex instance) {
  holds_.start(instance);
  lifts_.start(instance);
  for (const JointIndex joint : layout_->joints.indices()) {
    if (layout_->joints[joint].instance == instance) begin(joint);
  }
}

bool JointControl::is_set(JointIndex joint) const {
  return std::any_of(gains_.begin(), gains_.end(),
                     [joint](const Gain& gain) { return gain.joint == joint; });
}

double JointControl::gain_of(JointIndex joint) const {
  const auto set = std::find_if(gains_.begin(), gains_.end(),
                                [joint](const Gain& gain) { return gain.joint == joint; });
  const double gain = set == gains_.end() ? description(joint).axis.position_gain : set->value;
  return std::min(gain, largest_gain_);
}

void JointControl::forget(InstanceIndex instance) {
  holds_.forget(instance);
  lifts_.forget(instance);
  const auto of_instance = [&](const auto& each) {
    return layout_->joints[each.joint].instance == instance;
  };
  std::erase_if(targets_, of_instance);
  std::erase_if(gains_, of_instance);
}

void JointControl::serve(Target& target, const world::Pid& pid) const {
  const double now = target.is_rate ? physics_->joint_velocity(target.joint)
                                    : physics_->joint_position(target.joint);
  const double error = target.value - now;
  target.integral = std::clamp(target.integral + pid.i * error * step_s_, pid.i_min, pid.i_max);
  const double pushes = target.integral + pid.offset;
  // Below p h, a stiff joint would oscillate about its target.
  const double of_step = pid.p * step_s_;
  const double gain = target.is_rate ? pid.p : std::max(pid.d + of_step / 2.0, of_step);
  if (gain <= 0.0)
    return physics_->apply_joint_effort(target.joint, std::clamp(pushes, pid.least, pid.most));
  const double rate = target.is_rate ? target.value : pid.p * error / gain;
  physics_->servo_joint(target.joint, {rate + pushes / gain, gain, pid.least, pid.most});
}

void JointControl::before_step() {
  holds_.before_step();
  for (const Lifts::Order& order : lifts_.before_step())
    set_target(order.joint, joint_command_t::POSITION, order.position);
  for (Target& target : targets_) {
    const world::JointAxis& axis = description(target.joint).axis;
    const std::optional<world::Pid>& pid = target.is_rate ? axis.rate_pid : axis.position_pid;
    if (pid && !is_set(target.joint)) {
      serve(target, *pid);
    } else if (target.is_rate) {
      physics_->drive_joint_velocity(target.joint, target.value, kUnlimited);
    } else {
      const double error = target.value - physics_->joint_position(target.joint);
      physics_->drive_joint_velocity(target.joint, gain_of(target.joint) * error, kUnlimited);
    }
  }
}

}  // namespace ruedo::robot
