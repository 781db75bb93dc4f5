// The table of what Ruedo accepts from ROS: a topic and its type in, a command on an input channel
// of the run out.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "bridges/ros2/messages/names.h"
#include "bridges/ros2/topic.h"
#include "ruedo/world_info_t.hpp"

namespace ruedo::ros2 {

struct Command {
  Topic topic;
  bool when_published;              // it is read while somebody publishes it: ROS's tools refuse a
                                    // topic of two types
  std::string channel;              // on the bus
  std::vector<std::string> joints;  // that it may command, in this order
  // The encoded command; none for bytes that are not a message of that type.
  std::function<std::optional<std::vector<uint8_t>>(std::span<const uint8_t> cdr)> convert;
};

// For every robot that takes commands. stamped: whether cmd_vel is a TwistStamped. joints: names of
// a robot's joints, in the order of joint_states.
using JointNames = std::function<std::vector<std::string>(const std::string& robot)>;
std::vector<Command> commands_of(const std::vector<world_info_t>& info, bool stamped,
                                 const JointNames& joints, Names& names);

// The same as pairs of a topic and a channel name, for a robot of which nothing else is known.
std::vector<std::pair<std::string, std::string>> command_topics(const std::string& robot,
                                                                Names& names);

}  // namespace ruedo::ros2
