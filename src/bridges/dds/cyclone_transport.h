// ROS 2 over Eclipse Cyclone DDS, with the mapping of rmw_cyclonedds: names, QoS, type hashes in
// the user data.
#pragma once

#include <memory>

#include "bridges/dds/configuration.h"
#include "bridges/ros2/transport.h"

namespace ruedo::dds {

// Throws EnvironmentError if Cyclone finds no usable network.
std::unique_ptr<ros2::Transport> open_cyclone(const CycloneOptions& options);

}  // namespace ruedo::dds
