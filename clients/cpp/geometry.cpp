// Poses of frames in frames.
#include <cmath>

#include "ruedo/client_types.h"

namespace ruedo::client {
namespace {

constexpr double kPi = 3.14159265358979323846;

Vector3 cross(const Vector3& a, const Vector3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

// v + 2 w (u x v) + 2 u x (u x v), of the unit quaternion w, u.
Vector3 rotated(const Quaternion& q, const Vector3& v) {
  const Vector3 u{q[1], q[2], q[3]};
  const Vector3 once = cross(u, v), twice = cross(u, once);
  Vector3 turned{};
  for (size_t i = 0; i < 3; ++i) turned[i] = v[i] + 2.0 * (q[0] * once[i] + twice[i]);
  return turned;
}

}  // namespace

double normalize_angle(double angle) {
  const double turned = std::fmod(angle + kPi, 2.0 * kPi);
  return (turned < 0.0 ? turned + 2.0 * kPi : turned) - kPi;
}

Transform Transform::of(double x, double y, double heading, double z) {
  return {{x, y, z}, {std::cos(heading / 2.0), 0.0, 0.0, std::sin(heading / 2.0)}};
}

double Transform::heading() const {
  const auto [w, x, y, z] = orientation;
  return std::atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z));
}

Transform Transform::inverse() const {
  const auto [w, x, y, z] = orientation;
  const Quaternion back{w, -x, -y, -z};
  const Vector3 there = rotated(back, position);
  return {{-there[0], -there[1], -there[2]}, back};
}

Transform Transform::operator*(const Transform& other) const {
  const auto [w, x, y, z] = orientation;
  const auto [s, a, b, c] = other.orientation;
  return {apply(other.position),
          {w * s - x * a - y * b - z * c, w * a + x * s + y * c - z * b,
           w * b - x * c + y * s + z * a, w * c + x * b - y * a + z * s}};
}

Vector3 Transform::apply(const Vector3& point) const {
  const Vector3 turned = rotated(orientation, point);
  return {turned[0] + position[0], turned[1] + position[1], turned[2] + position[2]};
}

}  // namespace ruedo::client
