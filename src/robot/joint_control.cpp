// Position control is a velocity in proportion to the error, within the joint's own limits of rate
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

constexpr double kGainPerStep = 0.2;  // no more than this part of the error in a step
// The joint's own limit, which the physics knows, holds.
constexpr double kUnlimited = std::numeric_limits<double>::infinity();

struct Limits {
  double least, most;
};

// Of a command's value; null: there is no such mode.
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
  };
  return mode >= 0 && static_cast<size_t>(mode) < std::size(kOfModes) ? &kOfModes[mode] : nullptr;
}

}  // namespace

JointControl::JointControl(const model::WorldModel& world, const model::BodyLayout& layout,
                           physics::PhysicsWorld& physics)
    : world_(world),
      layout_(layout),
      physics_(physics),
      largest_gain_(kGainPerStep / (static_cast<double>(world.step_us) * 1e-6)) {
  targets_.reserve(layout.joints.size());
}

const model::Joint& JointControl::description(JointIndex joint) const {
  const auto& placed = layout_.joints[joint];
  return world_.models[placed.instance].model->joints[placed.joint];
}

JointIndex JointControl::find(RobotIndex robot, const std::string& name) const {
  const std::vector<JointIndex>& joints = layout_.robots[robot].joints;
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
  const JointIndex joint = find(robot, name);
  // One that mimics another, and a gearbox, take no commands.
  const bool takes = joint.valid() && !description(joint).leader.valid() &&
                     description(joint).type != model::JointType::gearbox;
  return takes ? motion_status_t::REASON_NONE : motion_status_t::REASON_BAD_VALUE;
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
    const JointIndex joint = find(robot, command.names[i]);
    tell(joint, command.modes[i], command.values[i]);
    const auto& placed = layout_.joints[joint];
    if (placed.parent_body.valid()) physics_.wake(placed.parent_body);
    if (placed.child_body.valid()) physics_.wake(placed.child_body);
  }
  return motion_status_t::REASON_NONE;
}

// What passed check().
void JointControl::tell(JointIndex joint, int8_t mode, double value) {
  using Mode = joint_command_t;
  const auto of_joint = [joint](const auto& each) { return each.joint == joint; };
  switch (mode) {
    case Mode::RATE_GAIN: return physics_.set_joint(joint, JointSetting::rate_gain, value);
    case Mode::EFFORT_LIMIT: return physics_.set_joint(joint, JointSetting::effort, value);
    case Mode::VELOCITY_LIMIT: return physics_.set_joint(joint, JointSetting::velocity, value);
    case Mode::POSITION_GAIN:
      std::erase_if(gains_, of_joint);
      return gains_.push_back({joint, value});
    default: break;
  }
  std::erase_if(targets_, of_joint);
  if (mode == Mode::VELOCITY) return physics_.drive_joint_velocity(joint, value, kUnlimited);
  if (mode == Mode::EFFORT) return physics_.apply_joint_effort(joint, value);
  const model::JointAxis& axis = description(joint).axis;
  const bool limited = axis.lower <= axis.upper;
  targets_.push_back({joint, limited ? std::clamp(value, axis.lower, axis.upper) : value});
}

double JointControl::gain_of(JointIndex joint) const {
  const auto set = std::find_if(gains_.begin(), gains_.end(),
                                [joint](const Gain& gain) { return gain.joint == joint; });
  const double gain = set == gains_.end() ? description(joint).axis.position_gain : set->value;
  return std::min(gain, largest_gain_);
}

void JointControl::forget(InstanceIndex instance) {
  const auto of_instance = [&](const auto& each) {
    return layout_.joints[each.joint].instance == instance;
  };
  std::erase_if(targets_, of_instance);
  std::erase_if(gains_, of_instance);
}

void JointControl::before_step() {
  for (const Target& target : targets_) {
    const double error = target.position - physics_.joint_position(target.joint);
    physics_.drive_joint_velocity(target.joint, gain_of(target.joint) * error, kUnlimited);
  }
}

}  // namespace ruedo::robot
