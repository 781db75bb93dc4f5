// ROS 2 over Eclipse Cyclone DDS, with the mapping of rmw_cyclonedds: names, QoS, type hashes in
// the user data.
#pragma once

#include <memory>
#include <string>

#include "bridges/ros2/transport.h"

namespace ruedo::dds {

// The range of discovery, as in ROS_AUTOMATIC_DISCOVERY_RANGE.
enum class Range { off, localhost, subnet, system_default };

struct CycloneOptions {
  uint32_t domain = 0;
  Range range = Range::localhost;
  std::string static_peers;  // separated by ';'
  std::string more;          // additional Cyclone configuration: "" or "," and a URI or XML
};

// From ROS_DOMAIN_ID, ROS_AUTOMATIC_DISCOVERY_RANGE, ROS_LOCALHOST_ONLY, ROS_STATIC_PEERS and
// CYCLONEDDS_URI. Throws
// InputError.
CycloneOptions options_from_environment();

// Throws EnvironmentError if Cyclone finds no usable network.
std::unique_ptr<ros2::Transport> open_cyclone(const CycloneOptions& options);

}  // namespace ruedo::dds
