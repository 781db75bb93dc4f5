// What bases that are no differential drive make of their encoders: mecanum and omni wheels by
// least squares, steered ones by the bicycle model. A base without wheels (Gazebo's planar move,
// tracks) has the way that it really made, as there.
#pragma once

#include <vector>

#include "model/body_layout.h"

namespace ruedo::model {

class BaseOdometry {
 public:
  static bool is_for(const DriveDescription& drive);

  // track_error: of the lever between turning and the wheels' ways, relative. steering_error: rad.
  BaseOdometry(const BodyLayout& layout, RobotIndex robot, const DriveDescription& drive,
               double track_error, double steering_error);

  bool rolls_sideways() const { return !rims_.empty(); }
  bool has_wheels() const { return !wheels_.empty() || !rims_.empty(); }

  // m ahead, m to the left, rad, of base_link in a step. Of the robot's wheels in their order:
  // ways, m; angles, rad, after it.
  Vec3 moved(const std::vector<double>& ways, const std::vector<double>& angles);
  Vec3 moved(const Pose& before, const Pose& after) const;

 private:
  struct Wheel {
    bool steers, steered;
    int on;       // in wheels_: what steers it
    double x, y;  // m, in base_link
  };
  double curvature(const std::vector<double>& angles) const;

  std::vector<Wheel> wheels_;  // of a base that is steered
  std::vector<Vec3> rims_;     // of mecanum and omni wheels
  Eigen::Matrix3d normal_ = Eigen::Matrix3d::Identity();
  double lever_, steering_error_;
  double curvature_before_ = 0.0;
  bool started_ = false;
};

}  // namespace ruedo::model
