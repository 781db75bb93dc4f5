// Position control is a velocity in proportion to the error, within the joint's own limits of rate
// and effort.
#include "robot/joint_control.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <ruedo/joint_command_t.hpp>
#include <ruedo/motion_status_t.hpp>

#include "ruedo/quantity.h"

namespace ruedo::robot {

namespace {

constexpr double kGainPerStep = 0.2;  // no more than this part of the error in a step
}  // namespace

JointControl::JointControl(const model::WorldModel& world, const model::BodyLayout& layout,
                           physics::PhysicsWorld& physics)
    : world_(world),
      layout_(layout),
      physics_(physics),
      largest_gain_(kGainPerStep / (static_cast<double>(world.step_us) * 1e-6)) {
  targets_.reserve(layout.joints.size());
}

int8_t JointControl::apply(int robot, const JointCommand& command) {
  const size_t n = command.names.size();
  if (command.modes.size() != n || command.values.size() != n)
    return motion_status_t::REASON_BAD_VALUE;
  const auto& placement = layout_.robots[static_cast<size_t>(robot)];
  const auto& model = *world_.models[static_cast<size_t>(placement.instance)].model;
  const auto description = [&](int joint) -> const model::Joint& {
    return model.joints[static_cast<size_t>(layout_.joints[static_cast<size_t>(joint)].joint)];
  };
  const auto find = [&](const std::string& name) {
    const auto found = std::find_if(placement.joints.begin(), placement.joints.end(),
                                    [&](int joint) { return description(joint).name == name; });
    return found == placement.joints.end() ? -1 : *found;
  };
  for (size_t i = 0; i < n; ++i) {
    if (!std::isfinite(command.values[i])) return motion_status_t::REASON_NOT_FINITE;
    const double most = command.modes[i] == joint_command_t::EFFORT     ? quantity::kEffort.most
                        : command.modes[i] == joint_command_t::VELOCITY ? quantity::kSpeed.most
                                                                        : quantity::kLength.most;
    if (std::abs(command.values[i]) > most) return motion_status_t::REASON_BAD_VALUE;
    if (command.modes[i] < joint_command_t::POSITION ||
        command.modes[i] > joint_command_t::EFFORT) {
      return motion_status_t::REASON_BAD_KIND;
    }
    const int joint = find(command.names[i]);
    if (joint < 0 || description(joint).leader >= 0)
      return motion_status_t::REASON_BAD_VALUE;  // one that mimics another takes no commands
  }
  for (size_t i = 0; i < n; ++i) {
    const int joint = find(command.names[i]);
    const model::JointAxis& axis = description(joint).axis;
    std::erase_if(targets_, [joint](const Target& target) { return target.joint == joint; });
    if (command.modes[i] == joint_command_t::VELOCITY) {
      physics_.drive_joint_velocity(joint, command.values[i], axis.effort);
    } else if (command.modes[i] == joint_command_t::EFFORT) {
      physics_.apply_joint_effort(joint, command.values[i]);
    } else {
      const bool limited = axis.lower <= axis.upper;
      targets_.push_back(
          {joint,
           limited ? std::clamp(command.values[i], axis.lower, axis.upper) : command.values[i],
           std::min(axis.position_gain, largest_gain_)});
    }
    const auto& placed = layout_.joints[static_cast<size_t>(joint)];
    if (placed.parent_body >= 0) physics_.wake(placed.parent_body);
    if (placed.child_body >= 0) physics_.wake(placed.child_body);
  }
  return motion_status_t::REASON_NONE;
}

void JointControl::forget(int instance) {
  std::erase_if(targets_, [&](const Target& target) {
    return layout_.joints[static_cast<size_t>(target.joint)].instance == instance;
  });
}

void JointControl::before_step() {
  for (const Target& target : targets_) {
    const double error = target.position - physics_.joint_position(target.joint);
    const auto& placed = layout_.joints[static_cast<size_t>(target.joint)];
    const auto& model = *world_.models[static_cast<size_t>(placed.instance)].model;
    physics_.drive_joint_velocity(target.joint, target.gain * error,
                                  model.joints[static_cast<size_t>(placed.joint)].axis.effort);
  }
}

}  // namespace ruedo::robot
