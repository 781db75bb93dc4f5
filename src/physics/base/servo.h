// Targets of the motors of wheels and joints.
#pragma once

namespace ruedo::physics {

// The torque (or force) that the servo of a wheel or joint gives until the next command: gain *
// (rate - actual rate), within the limits. It is integrated implicitly, and therefore stable for
// any gain.
struct WheelServo {
  double rate = 0.0;                                 // rad/s, positive rolls forward
  double gain = 0.0;                                 // N m s/rad
  double lowest_torque = 0.0, highest_torque = 0.0;  // N m
};

// The values of a joint that messages can change: N m s/rad or N s/m; N m or N; rad/s or m/s.
enum class JointSetting { rate_gain, effort, velocity };

}  // namespace ruedo::physics
