// Odometry of bases other than differential drives, from their encoders: least squares for mecanum
// and omni wheels, the bicycle model for steered ones. A base without wheels (Gazebo's planar move,
// tracks) reports its true motion, as Gazebo does.
#pragma once

#include <vector>

#include "ruedo/state_archive.h"
#include "world/model/body_layout.h"

namespace ruedo::world {

class BaseOdometry {
 public:
  static bool is_for(const DriveDescription& drive);

  // track_error: relative error of the lever arm between yaw and wheel travel. steering_error: rad.
  BaseOdometry(const BodyLayout& layout, RobotIndex robot, const DriveDescription& drive,
               double track_error, double steering_error);

  bool rolls_sideways() const { return !rims_.empty(); }
  bool has_wheels() const { return !wheels_.empty() || !rims_.empty(); }

  // Motion of base_link in one step: m forward, m to the left, rad. For the robot's wheels in
  // order: the distance each travelled (m), and its angle after the step (rad).
  Vec3 moved(const std::vector<double>& ways, const std::vector<double>& angles);
  Vec3 moved(const Pose& before, const Pose& after) const;
  // Motion of base_link for each metre that one wheel travels, steered as after the last step.
  Vec3 moved_by(size_t wheel) const;

  void exchange(StateArchive& archive) { archive(curvature_before_, started_); }

 private:
  struct Wheel {
    bool steers, steered;
    int on;       // in wheels_: what steers it
    double x, y;  // m, in base_link
  };
  double curvature(const std::vector<double>& angles) const;
  Vec3 moved_along(double curvature, const std::vector<double>& ways) const;

  std::vector<Wheel> wheels_;  // steered bases only
  std::vector<Vec3> rims_;     // mecanum and omni wheels only
  Eigen::Matrix3d normal_ = Eigen::Matrix3d::Identity();
  double lever_, steering_error_;
  double curvature_before_ = 0.0;
  bool started_ = false;
};

}  // namespace ruedo::world
