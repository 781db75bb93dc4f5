// Conversion between wheel rates and the speed and turn rate of a differential drive: v = (r_l w_l
// + r_r w_r) / 2 and omega = (r_r w_r - r_l w_l) / track. The same holds for distances and angles.
#pragma once

#include "world/model/world_model.h"

namespace ruedo::robot {

struct SideRates {
  double left, right;
};  // rad/s, or rad
struct PlaneMotion {
  double v, omega;
};  // m/s and rad/s, or m and rad

class WheelKinematics {
 public:
  // With the robot's true geometry, or with what it believes: including the errors of
  // <ruedo:odometry>.
  static WheelKinematics real(const world::DriveDescription& drive) {
    return {drive.wheel_radius, drive.wheel_radius, drive.track};
  }
  static WheelKinematics believed(const world::DriveDescription& drive) {
    return {drive.wheel_radius * (1.0 + drive.radius_error[0]),
            drive.wheel_radius * (1.0 + drive.radius_error[1]),
            drive.track * (1.0 + drive.track_error)};
  }

  SideRates wheels(const PlaneMotion& motion) const {
    const double half = 0.5 * track_ * motion.omega;
    return {(motion.v - half) / left_, (motion.v + half) / right_};
  }
  PlaneMotion motion(const SideRates& rates) const {
    const double left = left_ * rates.left, right = right_ * rates.right;
    return {0.5 * (left + right), (right - left) / track_};
  }

 private:
  WheelKinematics(double left, double right, double track)
      : left_(left), right_(right), track_(track) {}
  double left_, right_, track_;  // m
};

}  // namespace ruedo::robot
