// Commands against the models of their robots.
#include "engine/command_check.h"

#include <algorithm>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/utf8.h"
#include "robot/joint_control.h"
#include "ruedo/joint_command_t.hpp"
#include "world/drives/drive.h"

namespace ruedo::engine {
namespace {

constexpr size_t kLongestName = 100;  // bytes

// Calls f(name) for each thing of the robot that such a mode of a joint_command_t is for; returns
// what these are.
template <class F>
const char* for_each_target(const world::Model& model, const world::BodyLayout& layout,
                            const world::RobotPlacement& robot, int8_t mode, F&& f) {
  const auto each = [&](const auto& all, const char* kind) {
    for (const auto& one : all) f(one.name);
    return kind;
  };
  switch (mode) {
    case joint_command_t::ATTACHED: return each(model.holds, "detachable joint");
    case joint_command_t::FLOOR: return each(model.lifts, "lift");
    case joint_command_t::OPEN: return each(model.doors, "door");
    default: break;
  }
  for (const JointIndex index : robot.joints) {
    const world::Joint& joint = model.joints[layout.joints[index].joint];
    if (robot::takes_commands(joint)) f(joint.name);
  }
  return "joint";
}

}  // namespace

std::string check_possible(const world::WorldModel& world, const world::BodyLayout& layout,
                           const robot::Command& command) {
  const world::RobotPlacement& robot = layout.robots[command.robot];
  const world::ModelInstance& instance = world.models[robot.instance];
  const world::Model& model = *instance.model;
  if (const auto* velocity = std::get_if<robot::VelocityCommand>(&command.what)) {
    if (velocity->vy == 0.0 || !model.drive || world::moves_sideways(model.drive->steering))
      return "";
    return fmt::format("vy is {:g} m/s, but {} cannot move sideways", velocity->vy, instance.name);
  }
  const auto* joints = std::get_if<robot::JointCommand>(&command.what);
  if (!joints) return "";
  for (size_t i = 0; i < std::min(joints->names.size(), joints->modes.size()); ++i) {
    const std::string& name = joints->names[i];
    bool known = false;
    const char* const kind =
        for_each_target(model, layout, robot, joints->modes[i],
                        [&](const std::string& target) { known = known || target == name; });
    if (known) continue;
    std::vector<std::string> names;
    for_each_target(model, layout, robot, joints->modes[i],
                    [&](const std::string& target) { names.push_back(target); });
    return fmt::format("{} has no {} '{}' that takes commands; it has {}", instance.name, kind,
                       in_one_line(for_terminal(shortened(name, kLongestName))),
                       names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", ")));
  }
  return "";
}

}  // namespace ruedo::engine
