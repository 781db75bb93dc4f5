// A topic's name, type and QoS.
#pragma once

#include <string>

namespace ruedo::ros2 {

// The part of ROS's QoS that differs from topic to topic.
struct Qos {
  bool reliable = true;
  bool transient_local = false;  // late subscribers get the newest message
  int depth = 10;
};

// As drivers publish: reliable, so that reliable and best-effort readers (SensorDataQoS) are both
// served.
inline constexpr Qos kSensorQos{true, false, 5};
inline constexpr Qos kStateQos{true, false, 10};
inline constexpr Qos kTfQos{true, false, 100};
inline constexpr Qos kLatchedQos{true, true, 1};
// Clients' drawings: a message is of one layer, which a reader without it lacks.
inline constexpr Qos kMarkersQos{true, true, 100};
inline constexpr Qos kCommandQos{true, false, 10};
// Shared by all clients of a service: messages of one must not displace those of another. The
// transport limits the total size, and each client's share.
inline constexpr Qos kServiceQos{true, false, 10'000};

struct Topic {
  std::string name;  // "/p3at/scan"
  std::string type;  // "sensor_msgs/msg/LaserScan"
  Qos qos;
};

}  // namespace ruedo::ros2
