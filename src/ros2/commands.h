// The one table of what Ruedo takes from ROS: a topic and its type in, a command on one of the
// run's input channels out.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "ros2/names.h"
#include "ros2/topic.h"
#include "ruedo/world_info_t.hpp"

namespace ruedo::ros2 {

struct Command {
  Topic topic;
  std::string robot;
  std::string channel;  // on the bus
  // The command, encoded; nothing for what is no message of that type.
  std::function<std::optional<std::vector<uint8_t>>(std::span<const uint8_t> cdr)> convert;
};

// Of every robot that takes commands. joints: names of the joints of a robot, in the order of
// joint_states.
using JointNames = std::function<std::vector<std::string>(const std::string& robot)>;
std::vector<Command> commands_of(const std::vector<world_info_t>& info, const JointNames& joints,
                                 Names& names);

// The same as pairs of a topic and the name of the channel, of a robot of which nothing more is
// known.
std::vector<std::pair<std::string, std::string>> command_topics(const std::string& robot,
                                                                Names& names);

}  // namespace ruedo::ros2
