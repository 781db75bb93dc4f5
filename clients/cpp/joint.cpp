// Joints by their names: limits, states and commands.
#include "joint.h"

#include <algorithm>
#include <cmath>

#include "core.h"
#include "replies.h"
#include "ruedo/name_request_t.hpp"
#include "ruedo/request_t.hpp"

namespace ruedo::client {
namespace {

// The name is of a detachable joint, a lift or a door: the server knows those.
bool is_of_others(JointMode mode) {
  return mode == JointMode::attached || mode == JointMode::floor || mode == JointMode::open;
}

NotSupported takes_no_commands(const std::string& kind, const std::string& name,
                               const std::string& robot) {
  return NotSupported("the " + kind + " joint " + name + " of " + robot + " takes no commands");
}

}  // namespace

size_t index_of(const std::vector<std::string>& names, const std::string& joint,
                const std::string& subject) {
  const auto found = std::find(names.begin(), names.end(), joint);
  if (found != names.end()) return static_cast<size_t>(found - names.begin());
  std::string there;
  for (const std::string& name : names) there += (there.empty() ? "" : ", ") + name;
  const bool of_robot = subject != "there is";
  throw UnknownName(subject + (of_robot ? " has" : "") + " no joint '" + joint + "'; " +
                    (of_robot ? "it has " : "there is ") + (there.empty() ? "none" : there));
}

joint_command_t joint_message(const std::string& robot, const JointLimits& limits,
                              const std::map<std::string, double>& values, JointMode mode) {
  if (mode == JointMode::unknown)
    throw std::invalid_argument("mode is unknown: it must be another of JointMode");
  joint_command_t command{};
  for (const auto& [name, value] : values) {
    if (!std::isfinite(value))
      throw std::invalid_argument(name + " is " + text_of(value) + ": it must be a finite number");
    if (!is_of_others(mode)) {
      const size_t index = index_of(limits.names, name, robot);
      if (!limits.takes_commands.at(index))
        throw takes_no_commands(limits.kinds.at(index), name, robot);
    }
    command.name.push_back(name);
    command.mode.push_back(static_cast<uint8_t>(mode));
    command.value.push_back(value);
  }
  command.n = static_cast<int32_t>(values.size());
  return command;
}

Joint::Joint(std::shared_ptr<Core> core, std::string robot, std::string name)
    : core_(std::move(core)), robot_(std::move(robot)), name_(std::move(name)) {
  const JointLimits limits = core_->joint_limits(robot_);
  const size_t index = index_of(limits.names, name_, robot_);
  kind_ = limits.kinds.at(index);
  lower_ = limits.lower.at(index);
  upper_ = limits.upper.at(index);
  max_velocity_ = limits.max_velocities.at(index);
  max_effort_ = limits.max_efforts.at(index);
  takes_commands_ = limits.takes_commands.at(index);
  holds_ = limits.holds.at(index);
}

double Joint::position() const { return Robot(core_, robot_).joints().latest().position(name_); }
double Joint::velocity() const { return Robot(core_, robot_).joints().latest().velocity(name_); }
double Joint::effort() const { return Robot(core_, robot_).joints().latest().effort(name_); }

void Joint::set_position(double value) const {
  Robot(core_, robot_).command_joints({{name_, value}}, JointMode::position);
}
void Joint::set_velocity(double value) const {
  Robot(core_, robot_).command_joints({{name_, value}}, JointMode::velocity);
}
void Joint::set_effort(double value) const {
  Robot(core_, robot_).command_joints({{name_, value}}, JointMode::effort);
}

JointLimits Core::joint_limits(const std::string& robot) {
  robot_info(robot);
  const auto now = info();
  {
    const std::lock_guard lock(mutex_);
    if (joint_limits_of_ != now) joint_limits_.clear();
    joint_limits_of_ = now;
    if (const auto found = joint_limits_.find(robot); found != joint_limits_.end())
      return found->second;
  }
  name_request_t body;
  body.name = robot;
  JointLimits limits =
      joint_limits_of(session_.request(request_t::GET_JOINT_LIMITS, encoded(body), 5.0));
  const std::lock_guard lock(mutex_);
  if (joint_limits_of_ == now) joint_limits_[robot] = limits;
  return limits;
}

}  // namespace ruedo::client
