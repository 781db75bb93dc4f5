// ROS 2 over Eclipse Cyclone DDS, as rmw_cyclonedds maps it: names, QoS, type hashes in the user
// data.
#pragma once

#include <memory>
#include <string>

#include "ros2/transport.h"

namespace ruedo::dds {

// How far other nodes are looked for, as ROS_AUTOMATIC_DISCOVERY_RANGE has it.
enum class Range { off, localhost, subnet, system_default };

struct CycloneOptions {
  uint32_t domain = 0;
  Range range = Range::localhost;
  std::string static_peers;  // separated by ';'
  std::string more;          // of Cyclone's own configuration: "" or "," and a URI or XML
};

// From ROS_DOMAIN_ID, ROS_AUTOMATIC_DISCOVERY_RANGE, ROS_STATIC_PEERS and CYCLONEDDS_URI. Throws
// InputError.
CycloneOptions options_from_environment();

// Throws EnvironmentError when Cyclone finds no network that it may use.
std::unique_ptr<ros2::Transport> open_cyclone(const CycloneOptions& options);

}  // namespace ruedo::dds
