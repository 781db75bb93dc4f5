// Restores the message from which a ROS message was made, of those types that hold all of it: scans
// and pictures, which are most of a bag's bytes.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace ruedo::ros2 {

// The message of the bus, encoded; empty for other types, and for what is damaged.
std::vector<uint8_t> restored(const std::string& type, std::span<const uint8_t> cdr);

}  // namespace ruedo::ros2
