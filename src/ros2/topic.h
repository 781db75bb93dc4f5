// What a topic is called, carries and promises.
#pragma once

#include <string>

namespace ruedo::ros2 {

// The part of ROS's QoS that differs from topic to topic.
struct Qos {
  bool reliable = true;
  bool transient_local = false;  // who comes late gets the newest
  int depth = 10;
};

// As drivers publish: reliable, so that readers of either kind (SensorDataQoS among them) are
// served.
inline constexpr Qos kSensorQos{true, false, 5};
inline constexpr Qos kStateQos{true, false, 10};
inline constexpr Qos kTfQos{true, false, 100};
inline constexpr Qos kLatchedQos{true, true, 1};
// What clients draw: a message is of one layer, and who misses it misses that.
inline constexpr Qos kMarkersQos{true, true, 100};
inline constexpr Qos kCommandQos{true, false, 10};
// Of all clients of a service together: what one of them sends, or is sent, must not displace what
// another is. The transport bounds the bytes, and each client's share.
inline constexpr Qos kServiceQos{true, false, 10'000};

struct Topic {
  std::string name;  // "/p3at/scan"
  std::string type;  // "sensor_msgs/msg/LaserScan"
  Qos qos;
};

}  // namespace ruedo::ros2
