// How far the wheels of a kinematic drive have turned, and where those that steer point, from the
// way of base_link.
#pragma once

#include <vector>

#include "model/body_layout.h"
#include "robot/unicycle.h"
#include "ruedo/snapshot.h"

namespace ruedo::robot {

class WheelAngles {
 public:
  WheelAngles(const model::BodyLayout& layout, RobotIndex robot,
              const model::DriveDescription& drive);

  void advance(const Displacement& way);
  // twist: m/s ahead, m/s to the left, rad/s. curvature: 1/m, of the way that the steering sets.
  void read(Snapshot& snapshot, const Vec3& twist, double curvature) const;

 private:
  struct Wheel {
    WheelIndex index;
    bool steers, steered;  // it is a steering joint; it rolls and hangs on one
    Vec3 rim;
    double x, y;          // m, in base_link: of a steered wheel the joint that steers it
    double rolled = 0.0;  // m, of a steered wheel
  };

  double radius_;
  std::vector<Wheel> wheels_;
  double way_ = 0.0, side_ = 0.0,
         angle_ = 0.0;  // of base_link since the start: integrals of its twist
};

}  // namespace ruedo::robot
