// The texts of the interfaces, parsed by interfaces.cpp. Without comments and constants: no hash
// and no byte depends on them.
#pragma once

#include <span>

namespace ruedo::ros2 {

struct Definition {
  const char*
      name;  // "sensor_msgs/msg/LaserScan"; a service's request and response are separated by "---"
  const char* text;
  const char* humble = nullptr;  // if Humble's differs
};

std::span<const Definition> definitions();

}  // namespace ruedo::ros2
