// The lower of two friction coefficients counts, as in ODE and Gazebo; two compliant surfaces act
// as springs in series.
#include "physics/bodies/surfaces.h"

#include <algorithm>
#include <cmath>

#include "physics/bodies/rigid_bodies.h"
#include "ruedo/math.h"

namespace ruedo::physics {

namespace {

// A contact stiffer than this (N/m) is rigid: under a robot it would be compressed by less than a
// micrometre at 1 ms.
constexpr double kRigid = 1e8;
// Torsional friction of a round patch, relative to its radius times the load (Hertzian pressure).
constexpr double kPatch = 3.0 * M_PI / 16.0;

// The direction of `friction`, in the world; not yet projected.
Vec3 direction_of(const ShapeSurface& surface, const btCollisionObject& object,
                  const Vec3& normal) {
  const auto in_world = [&](const Vec3& v) {
    return from_bt(object.getWorldTransform().getBasis() * to_bt(v));
  };
  if (surface.along_I != Vec3::Zero()) return in_world(surface.along_I);
  if (surface.axle_I == Vec3::Zero() || surface.friction == surface.friction2) return Vec3::Zero();
  const Vec3 axle = in_world(surface.axle_I), ahead = axle.cross(normal);
  if (ahead.norm() <= 1e-3) return Vec3::Zero();  // a wheel lying on its side has no such direction
  if (surface.roller_rad == 0.0) return ahead;
  return math::cos(surface.roller_rad) * ahead.normalized() + math::sin(surface.roller_rad) * axle;
}

double torsional_lever(const ShapeSurface& surface, double depth_m) {
  const double patch = surface.patch_radius_m > 0.0
                           ? surface.patch_radius_m
                           : std::sqrt(surface.surface_radius_m * std::max(depth_m, 0.0));
  return kPatch * surface.torsional * patch;
}

double in_series(double k1, double k2) {
  return k1 > 0.0 && k2 > 0.0 ? k1 * k2 / (k1 + k2) : std::max(k1, k2);
}

// force: direction of the contact force on the shape.
bool gives_way(const ShapeSurface& surface, const Vec3& force) {
  constexpr double kFromBelow = 0.7;
  return surface.borne_along == Vec3::Zero() || surface.borne_along.dot(force) > kFromBelow;
}

// The solver divides by squared coefficients: values too small to measure count as none.
double felt(double coefficient) {
  constexpr double kLeast = 1e-9;
  return coefficient < kLeast ? 0.0 : coefficient;
}

}  // namespace

ShapeSurface surface_of(const world::Surface& surface, const Quat& R_IC) {
  ShapeSurface s;
  s.friction = felt(surface.friction);
  s.along_I = surface.friction_direction == Vec3::Zero() ? Vec3(Vec3::Zero())
                                                         : Vec3(R_IC * surface.friction_direction);
  s.friction2 = felt(surface.friction2);
  s.slip = surface.slip;
  s.slip2 = surface.slip2;
  s.torsional = felt(surface.torsional);
  s.patch_radius_m = surface.patch_radius;
  s.surface_radius_m = surface.surface_radius;
  s.rolling_m = felt(surface.rolling);
  s.restitution = surface.restitution;
  if (surface.stiffness > 0.0 && surface.stiffness < kRigid) {
    s.stiffness = surface.stiffness;
    s.damping = surface.damping;
  }
  return s;
}

ContactSurface Surfaces::at(const btCollisionObject& a, const btCollisionObject& b,
                            const btManifoldPoint& point) const {
  const ShapeSurface& of_a = shape_of(info_of(a), point.m_index0).surface;
  const ShapeSurface& of_b = shape_of(info_of(b), point.m_index1).surface;
  const Vec3 normal = from_bt(point.m_normalWorldOnB);
  ContactSurface both;
  const Vec3 along_a = direction_of(of_a, a, normal), along_b = direction_of(of_b, b, normal);
  const bool directed_a = along_a != Vec3::Zero(), directed_b = along_b != Vec3::Zero();
  // Without a direction both coefficients are equal.
  const double a2 = directed_a ? of_a.friction2 : of_a.friction,
               b2 = directed_b ? of_b.friction2 : of_b.friction;
  both.friction = std::min(of_a.friction, of_b.friction);
  both.friction2 = std::min(a2, b2);
  both.along = directed_a ? along_a : along_b;
  both.slip = of_a.slip + of_b.slip;
  both.slip2 = of_a.slip2 + of_b.slip2;
  const double depth = -point.getDistance();
  const double lever_a = torsional_lever(of_a, depth), lever_b = torsional_lever(of_b, depth);
  both.spinning = std::max(lever_a, lever_b);
  both.rolling = std::max(of_a.rolling_m, of_b.rolling_m);
  both.restitution = of_a.restitution * of_b.restitution;
  const bool a_gives = gives_way(of_a, normal), b_gives = gives_way(of_b, -normal);
  both.stiffness = in_series(a_gives ? of_a.stiffness : 0.0, b_gives ? of_b.stiffness : 0.0);
  if (both.stiffness > 0.0)
    both.damping = (a_gives ? of_a.damping : 0.0) + (b_gives ? of_b.damping : 0.0);
  return both;
}

}  // namespace ruedo::physics
