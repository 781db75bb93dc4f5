// Joints by their names.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "ruedo/client.h"
#include "ruedo/joint_command_t.hpp"

namespace ruedo::client {

// subject: "there is", or the robot that has them. Throws UnknownName, which lists them.
size_t index_of(const std::vector<std::string>& names, const std::string& joint,
                const std::string& subject);

// Without its time. Throws UnknownName, NotSupported and std::invalid_argument.
joint_command_t joint_message(const std::string& robot, const JointLimits& limits,
                              const std::map<std::string, double>& values, JointMode mode);

}  // namespace ruedo::client
