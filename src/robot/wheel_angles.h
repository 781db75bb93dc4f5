// The rotation of a kinematic drive's wheels, and the angles of its steered wheels, from the motion
// of base_link.
#pragma once

#include <vector>

#include "robot/unicycle.h"
#include "ruedo/snapshot.h"
#include "ruedo/state_archive.h"
#include "world/model/body_layout.h"

namespace ruedo::robot {

class WheelAngles {
 public:
  WheelAngles(const world::BodyLayout& layout, RobotIndex robot,
              const world::DriveDescription& drive);

  void advance(const Displacement& way);
  void exchange(StateArchive& archive) {
    for (Wheel& wheel : wheels_) archive(wheel.rolled);
    archive(way_, side_, angle_);
  }
  // twist: m/s forward, m/s to the left, rad/s. curvature: 1/m, of the path that the steering sets.
  void read(Snapshot& snapshot, const Vec3& twist, double curvature) const;

 private:
  struct Wheel {
    WheelIndex index;
    bool steers, steered;  // steers: a steering joint; steered: a rolling wheel that hangs on one
    Vec3 rim;
    double x, y;          // m, in base_link: for a steered wheel, that of its steering joint
    double rolled = 0.0;  // m, for a steered wheel
  };

  double radius_;
  std::vector<Wheel> wheels_;
  double way_ = 0.0, side_ = 0.0,
         angle_ = 0.0;  // of base_link since the start: integrals of its twist
};

}  // namespace ruedo::robot
