// The pose of a link in its body, which sensors and scenes need at every step.
#include "ruedo/math.h"
#include "world/model/body_layout.h"

namespace ruedo::world {
namespace {

// The displacement of the link when its wheel turns by an angle, in the link's frame.
Pose turned(const WheelPlacement& wheel, double angle) {
  const Quat turn(Eigen::AngleAxisd(angle, wheel.axis_in_L));
  return {turn, wheel.center_in_L - turn * wheel.center_in_L};
}

}  // namespace

Pose BodyLayout::link_in_body(LinkIndex link,
                              const IndexedVector<WheelIndex, double>& wheel_angles) const {
  const LinkPlacement& placement = links[link];
  if (!placement.wheel.valid()) return placement.X_BL;
  const WheelPlacement& wheel = wheels[placement.wheel];
  const Pose& X_BWheel = links[wheel.link].X_BL;
  const Pose X_turn = turned(wheel, wheel_angles[placement.wheel]);
  const Pose X_BL = wheel.link == link ? X_BWheel * X_turn
                                       : X_BWheel * X_turn * X_BWheel.inverse() * placement.X_BL;
  if (!wheel.on.valid()) return X_BL;
  const WheelPlacement& steer = wheels[wheel.on];
  const Pose& X_BSteer = links[steer.link].X_BL;
  return X_BSteer * turned(steer, wheel_angles[wheel.on]) * X_BSteer.inverse() * X_BL;
}

}  // namespace ruedo::world
