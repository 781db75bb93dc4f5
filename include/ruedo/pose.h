// Poses and twists, in double precision, and the frames they relate.
//
// A pose X_AB maps coordinates in frame B to coordinates in frame A: p_A = X_AB * p_B. Names say
// the frames: X_WB is the pose of body B in the world W. SI units, radians; x ahead, y left, z up.
#pragma once

#include <cmath>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "ruedo/math.h"

namespace ruedo {

using Vec3 = Eigen::Vector3d;
using Quat = Eigen::Quaterniond;

// A rigid transform: a unit quaternion and a translation in metres.
struct Pose {
  Quat rotation = Quat::Identity();
  Vec3 translation = Vec3::Zero();

  // SDF's and URDF's convention: fixed-axis roll about x, then pitch about y, then yaw about z, in
  // radians.
  static Pose from_xyz_rpy(const Vec3& xyz, const Vec3& rpy) {
    return {
        Quat(Eigen::AngleAxisd(rpy.z(), Vec3::UnitZ()) * Eigen::AngleAxisd(rpy.y(), Vec3::UnitY()) *
             Eigen::AngleAxisd(rpy.x(), Vec3::UnitX())),
        xyz};
  }

  Pose operator*(const Pose& other) const {
    return {rotation * other.rotation, translation + rotation * other.translation};
  }
  Vec3 operator*(const Vec3& point) const { return translation + rotation * point; }
  Pose inverse() const {
    const Quat inverse_rotation = rotation.conjugate();
    return {inverse_rotation, -(inverse_rotation * translation)};
  }
  Pose normalized() const { return {rotation.normalized(), translation}; }
};

// Velocity of a frame's origin in m/s and angular velocity in rad/s; where it is used says the
// frame in which the two are expressed.
struct Twist {
  Vec3 linear = Vec3::Zero();
  Vec3 angular = Vec3::Zero();
};

// Heading of a pose in the plane: the angle of its x axis about the world's z, in (-pi, pi].
inline double heading(const Quat& q) {
  return math::atan2(2.0 * (q.w() * q.z() + q.x() * q.y()),
                     1.0 - 2.0 * (q.y() * q.y() + q.z() * q.z()));
}

// Wraps an angle into (-pi, pi].
inline double wrap_angle(double angle_rad) {
  const double wrapped = std::remainder(angle_rad, 2.0 * M_PI);
  return wrapped <= -M_PI ? wrapped + 2.0 * M_PI : wrapped;
}

}  // namespace ruedo
