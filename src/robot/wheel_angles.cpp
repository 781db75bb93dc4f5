// Rolling without slip: each wheel's rim moves at the speed of the ground below it, along the
// wheel.
#include "robot/wheel_angles.h"

#include <cmath>

#include "ruedo/math.h"

namespace ruedo::robot {

WheelAngles::WheelAngles(const world::BodyLayout& layout, RobotIndex robot,
                         const world::DriveDescription& drive)
    : radius_(drive.wheel_radius) {
  const world::RobotPlacement& placement = layout.robots[robot];
  const Pose X_BaseB = placement.X_BBase.inverse();
  for (const WheelIndex index : placement.wheels) {
    const world::WheelPlacement& wheel = layout.wheels[index];
    const world::WheelPlacement& place = wheel.on.valid() ? layout.wheels[wheel.on] : wheel;
    const Vec3 p_Base = X_BaseB * (layout.links[place.link].X_BL * place.center_in_L);
    wheels_.push_back({index, wheel.steers, wheel.on.valid(), wheel.rim, p_Base.x(), p_Base.y()});
  }
}

void WheelAngles::advance(const Displacement& way) {
  way_ += way.way;
  side_ += way.side;
  angle_ += way.angle;
  for (Wheel& wheel : wheels_) {
    if (wheel.steered)
      wheel.rolled +=
          std::copysign(math::hypot(way.way - way.angle * wheel.y, way.angle * wheel.x), way.way);
  }
}

void WheelAngles::read(Snapshot& snapshot, const Vec3& twist, double curvature) const {
  const Vec3 sums(way_, side_, angle_);
  for (const Wheel& wheel : wheels_) {
    double angle = 0.0, rate = 0.0;
    if (wheel.steers) {  // perpendicular to the line to the centre of the circle
      angle = math::atan2(curvature * wheel.x, 1.0 - curvature * wheel.y);
    } else if (radius_ > 0.0 && wheel.steered) {
      angle = wheel.rolled / radius_;
      rate = std::copysign(math::hypot(twist.x() - twist.z() * wheel.y, twist.z() * wheel.x),
                           twist.x()) /
             radius_;
    } else if (radius_ > 0.0) {
      angle = wheel.rim.dot(sums) / radius_;
      rate = wheel.rim.dot(twist) / radius_;
    }
    snapshot.wheel_angles[wheel.index] = angle;
    snapshot.wheel_rates[wheel.index] = rate;
  }
}

}  // namespace ruedo::robot
