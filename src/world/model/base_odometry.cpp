// Forward kinematics of wheels.
#include "world/model/base_odometry.h"

#include <algorithm>

#include "ruedo/math.h"

namespace ruedo::world {

using Steering = DriveDescription::Steering;

bool BaseOdometry::is_for(const DriveDescription& drive) {
  if (drive.steering == Steering::differential) return false;
  return drive.steering != Steering::tracked || drive.left_joints.empty();
}

BaseOdometry::BaseOdometry(const BodyLayout& layout, RobotIndex robot,
                           const DriveDescription& drive, double track_error, double steering_error)
    : lever_(1.0 + track_error), steering_error_(steering_error) {
  const RobotPlacement& placement = layout.robots[robot];
  if (drive.steering == Steering::mecanum || drive.steering == Steering::omni) {
    normal_.setZero();
    for (const WheelIndex wheel : placement.wheels) {
      Vec3 rim = layout.wheels[wheel].rim;
      rim.z() *= lever_;
      rims_.push_back(rim);
      normal_ += rim * rim.transpose();
    }
  } else if (drive.steering == Steering::ackermann || drive.steering == Steering::tricycle) {
    const Pose X_BaseB = placement.X_BBase.inverse();
    for (const int index : placement.wheels) {
      const WheelPlacement& wheel = layout.wheels[index];
      const WheelPlacement& place = wheel.on.valid() ? layout.wheels[wheel.on] : wheel;
      const LinkPlacement& link = layout.links[place.link];
      Pose X_BL = link.X_BL;  // in the body that carries base_link
      if (link.body != placement.body)
        X_BL = layout.bodies[placement.body].X_WB.inverse() * layout.bodies[link.body].X_WB * X_BL;
      const Vec3 p = X_BaseB * (X_BL * place.center_in_L);
      const auto on = std::find(placement.wheels.begin(), placement.wheels.end(), wheel.on);
      wheels_.push_back({wheel.steers, wheel.on.valid(),
                         static_cast<int>(on - placement.wheels.begin()), p.x(), p.y()});
    }
  }
}

// The curvature of the path, 1/m: the mean of what each steering wheel's angle gives by itself.
double BaseOdometry::curvature(const std::vector<double>& angles) const {
  double sum = 0.0;
  int count = 0;
  for (size_t i = 0; i < wheels_.size(); ++i) {
    if (!wheels_[i].steers) continue;
    const double slope = math::tan(angles[i] + steering_error_);
    sum += slope / (lever_ * wheels_[i].x + slope * wheels_[i].y);
    ++count;
  }
  return count > 0 ? sum / count : 0.0;
}

Vec3 BaseOdometry::moved(const std::vector<double>& ways, const std::vector<double>& angles) {
  if (!rims_.empty()) return moved_along(0.0, ways);
  const double now = curvature(angles);
  const double middle = started_ ? 0.5 * (curvature_before_ + now) : now;
  curvature_before_ = now;
  started_ = true;
  return moved_along(middle, ways);
}

Vec3 BaseOdometry::moved_by(size_t wheel) const {
  std::vector<double> ways(rims_.empty() ? wheels_.size() : rims_.size(), 0.0);
  ways[wheel] = 1.0;
  return moved_along(curvature_before_, ways);
}

Vec3 BaseOdometry::moved_along(double curvature, const std::vector<double>& ways) const {
  if (!rims_.empty()) {
    Vec3 sum = Vec3::Zero();
    for (size_t i = 0; i < rims_.size(); ++i) sum += rims_[i] * ways[i];
    return normal_.ldlt().solve(sum);
  }
  const bool any_fixed = std::any_of(wheels_.begin(), wheels_.end(), [](const Wheel& wheel) {
    return !wheel.steers && !wheel.steered;
  });
  double way = 0.0;
  int count = 0;
  for (size_t i = 0; i < wheels_.size(); ++i) {
    const Wheel& wheel = wheels_[i];
    if (wheel.steers || (any_fixed && wheel.steered)) continue;
    // A wheel runs on a circle about the same centre as base_link; their paths are in proportion.
    const double part = wheel.steered ? math::hypot(1.0 - curvature * wheel.y, curvature * wheel.x)
                                      : 1.0 - curvature * wheel.y;
    way += ways[i] / part;
    ++count;
  }
  if (count > 0) way /= count;
  return {way, 0.0, way * curvature};
}

Vec3 BaseOdometry::moved(const Pose& before, const Pose& after) const {
  const double angle = wrap_angle(heading(after.rotation) - heading(before.rotation)),
               half = 0.5 * angle;
  const Vec3 chord = after.translation - before.translation;
  const double c = math::cos(heading(before.rotation) + half),
               s = math::sin(heading(before.rotation) + half);
  // ratio of an arc's length to its chord
  const double part = half == 0.0 ? 1.0 : half / math::sin(half);
  return {part * (c * chord.x() + s * chord.y()), part * (c * chord.y() - s * chord.x()),
          angle / lever_};
}

}  // namespace ruedo::world
