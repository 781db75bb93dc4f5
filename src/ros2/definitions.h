// The texts of the interfaces; interfaces.cpp reads them. Comments and constants are left out: no
// hash and no byte depends on them.
#pragma once

#include <span>

namespace ruedo::ros2 {

struct Definition {
  const char*
      name;  // "sensor_msgs/msg/LaserScan"; a service's request and response are apart by "---"
  const char* text;
  const char* humble = nullptr;  // where Humble's is another
};

std::span<const Definition> definitions();

}  // namespace ruedo::ros2
