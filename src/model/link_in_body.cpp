// Where a link is in its body, which sensors and scenes ask at every step.
#include "model/body_layout.h"
#include "ruedo/math.h"

namespace ruedo::model {
namespace {

// What turning by an angle does to the link, in its own frame.
Pose turned(const WheelPlacement& wheel, double angle) {
  const Quat turn(Eigen::AngleAxisd(angle, wheel.axis_in_L));
  return {turn, wheel.center_in_L - turn * wheel.center_in_L};
}

}  // namespace

Pose BodyLayout::link_in_body(int link, const std::vector<double>& wheel_angles) const {
  const LinkPlacement& placement = links[static_cast<size_t>(link)];
  if (placement.wheel < 0) return placement.X_BL;
  const WheelPlacement& wheel = wheels[static_cast<size_t>(placement.wheel)];
  const Pose& X_BWheel = links[static_cast<size_t>(wheel.link)].X_BL;
  const Pose X_turn = turned(wheel, wheel_angles[static_cast<size_t>(placement.wheel)]);
  const Pose X_BL = wheel.link == link ? X_BWheel * X_turn
                                       : X_BWheel * X_turn * X_BWheel.inverse() * placement.X_BL;
  if (wheel.on < 0) return X_BL;
  const WheelPlacement& steer = wheels[static_cast<size_t>(wheel.on)];
  const Pose& X_BSteer = links[static_cast<size_t>(steer.link)].X_BL;
  return X_BSteer * turned(steer, wheel_angles[static_cast<size_t>(wheel.on)]) *
         X_BSteer.inverse() * X_BL;
}

}  // namespace ruedo::model
