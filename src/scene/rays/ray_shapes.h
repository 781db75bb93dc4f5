// Exact intersections of rays with the primitive shapes, in double precision and in the shape's own
// frame.
//
// Every shape here is convex and solid: the part of a line inside it is one interval. A ray that
// starts in the interval has range 0; one that starts before it has the interval's lower end.
// Directions are unit vectors.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "ruedo/pose.h"

namespace ruedo::scene {

inline constexpr double kNoHit = std::numeric_limits<double>::infinity();

// Where a shape was hit; together with the point it gives the normal. For triangles of a mesh,
// `feature` is their index.
enum Feature : int {
  kInside = -1,
  kSide = 0,
  kBottom = 1,
  kTop = 2
};  // box: 0 to 5, see intersect_box

struct ShapeHit {
  double t = kNoHit;  // m; +inf: missed
  int feature = kInside;
};

// The part of a line inside a solid, with the feature where it enters; empty if enter > exit.
struct Interval {
  double enter = -kNoHit, exit = kNoHit;
  int feature = kInside;

  bool empty() const { return !(enter <= exit); }
  void intersect(double other_enter, double other_exit, int other_feature) {
    if (other_enter > enter) {
      enter = other_enter;
      feature = other_feature;
    }
    exit = std::min(exit, other_exit);
  }
  static Interval none() { return {kNoHit, -kNoHit, kInside}; }
  ShapeHit hit() const {
    if (empty() || exit < 0.0) return {};
    return enter > 0.0 ? ShapeHit{enter, feature} : ShapeHit{0.0, kInside};
  }
};

// Between the planes at -half and +half of one axis. Features: low for the plane at -half, high for
// the other one.
inline Interval slab(double o, double d, double half, int low, int high) {
  if (d == 0.0) return std::abs(o) <= half ? Interval{} : Interval::none();
  const double inverse = 1.0 / d;
  const double at_low = (-half - o) * inverse, at_high = (half - o) * inverse;
  return d > 0.0 ? Interval{at_low, at_high, low} : Interval{at_high, at_low, high};
}

// Inside x^2 + y^2 + z^2 <= radius^2, for vectors of two or three components; d must not be zero.
// Starts from the point nearest to the centre, so that distant origins lose no digits.
template <class Vector>
Interval ball(const Vector& o, const Vector& d, double radius, int feature = kSide) {
  const double dd = d.squaredNorm();
  const double middle = -o.dot(d) / dd;
  const Vector nearest = o + middle * d;
  const double squared = (radius * radius - nearest.squaredNorm()) / dd;
  if (!(squared >= 0.0)) return Interval::none();
  const double half_chord = std::sqrt(squared);
  return {middle - half_chord, middle + half_chord, feature};
}

// Features 2 * axis for the face at -half, 2 * axis + 1 for the face at +half.
inline ShapeHit intersect_box(const Vec3& o, const Vec3& d, const Vec3& half) {
  Interval inside;
  for (int axis = 0; axis < 3; ++axis) {
    const Interval s = slab(o[axis], d[axis], half[axis], 2 * axis, 2 * axis + 1);
    inside.intersect(s.enter, s.exit, s.feature);
  }
  return inside.hit();
}

inline ShapeHit intersect_sphere(const Vec3& o, const Vec3& d, double radius) {
  return ball(o, d, radius).hit();
}

inline ShapeHit intersect_ellipsoid(const Vec3& o, const Vec3& d, const Vec3& radii) {
  const Vec3 scaled_o = o.cwiseQuotient(radii), scaled_d = d.cwiseQuotient(radii);
  return ball(scaled_o, scaled_d, 1.0).hit();
}

// The infinite cylinder about z.
inline Interval round_wall(const Vec3& o, const Vec3& d, double radius) {
  const Eigen::Vector2d o2 = o.head<2>(), d2 = d.head<2>();
  if (d2.squaredNorm() == 0.0)
    return o2.squaredNorm() <= radius * radius ? Interval{} : Interval::none();
  return ball(o2, d2, radius);
}

inline ShapeHit intersect_cylinder(const Vec3& o, const Vec3& d, double radius,
                                   double half_length) {
  Interval inside = round_wall(o, d, radius);
  const Interval caps = slab(o.z(), d.z(), half_length, kBottom, kTop);
  inside.intersect(caps.enter, caps.exit, caps.feature);
  return inside.hit();
}

// A cylinder and two spheres: the line enters the capsule where it first enters one of them.
inline ShapeHit intersect_capsule(const Vec3& o, const Vec3& d, double radius, double half_length) {
  const Vec3 end(0.0, 0.0, half_length);
  const ShapeHit wall = intersect_cylinder(o, d, radius, half_length);
  const ShapeHit top = ball<Vec3>(o - end, d, radius, kTop).hit();
  const ShapeHit bottom = ball<Vec3>(o + end, d, radius, kBottom).hit();
  // The cylinder's caps lie inside the spheres except for rounding; the sphere counts there.
  ShapeHit first = bottom;
  if (top.t < first.t) first = top;
  if (wall.t < first.t) first = wall;
  return first;
}

// Apex at +half_length, base of that radius at -half_length.
inline ShapeHit intersect_cone(const Vec3& origin, const Vec3& d, double radius,
                               double half_length) {
  const double shift = -origin.dot(d);  // work from the point nearest to the centre
  const Vec3 o = origin + shift * d;
  const double slope = radius / (2.0 * half_length), slope2 = slope * slope;
  const double below = half_length - o.z();  // of the apex; at t it is below - t d.z
  // Inside: x^2 + y^2 - (slope * below)^2 <= 0, that is a t^2 + 2 b t + c <= 0, in the lower half
  // only.
  const double a = d.x() * d.x() + d.y() * d.y() - slope2 * d.z() * d.z();
  const double b = o.x() * d.x() + o.y() * d.y() + slope2 * below * d.z();
  const double c = o.x() * o.x() + o.y() * o.y() - slope2 * below * below;
  const double discriminant = b * b - a * c;
  if (a > 0.0 && discriminant < 0.0) return {};
  const double q = -(b + std::copysign(std::sqrt(std::max(discriminant, 0.0)),
                                       b));  // avoids cancellation
  Interval inside;
  inside.feature = kSide;
  if (a > 0.0) {  // flatter than the surface: crosses one half, from side to side
    const double t0 = q / a, t1 = q != 0.0 ? c / q : t0;
    inside.enter = std::min(t0, t1);
    inside.exit = std::max(t0, t1);
    if (below - 0.5 * (inside.enter + inside.exit) * d.z() < 0.0)
      return {};  // the half above the apex
  } else {        // steeper: inside the lower half below the intersection
    double crossing;
    if (a < 0.0) {
      const double t0 = q / a, t1 = q != 0.0 ? c / q : t0;
      crossing = d.z() > 0.0 ? std::min(t0, t1) : std::max(t0, t1);
    } else {
      if (!(b * d.z() > 0.0)) return {};  // parallel to the surface and nowhere below it
      crossing = c / q;
    }
    (d.z() > 0.0 ? inside.exit : inside.enter) = crossing;
  }
  const Interval base = slab(o.z(), d.z(), half_length, kBottom, kTop);
  inside.intersect(base.enter, base.exit, base.feature);
  inside.enter += shift;
  inside.exit += shift;
  return inside.hit();
}

// The plane through the origin with that unit normal, visible from both sides; it has no inside.
inline ShapeHit intersect_plane(const Vec3& o, const Vec3& d, const Vec3& normal) {
  const double t = -normal.dot(o) / normal.dot(d);
  return t >= 0.0 && t < kNoHit ? ShapeHit{t, kSide}
                                // NaN: the ray lies in the plane, which is invisible edge-on
                                : ShapeHit{};
}

}  // namespace ruedo::scene
