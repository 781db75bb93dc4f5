// How far a model reaches in each direction, by its shapes' support functions.
#include "world/model/footprint.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numbers>

#include "ruedo/math.h"
#include "world/model/convex.h"

namespace ruedo::world {
namespace {

constexpr int kSides = 8, kPerSide = 8, kDirections = kSides * kPerSide;
constexpr double kNothing = -std::numeric_limits<double>::infinity();
constexpr double kSame_m = 1e-6;

Eigen::Vector2d toward(int k, int of) {
  const double angle = 2 * std::numbers::pi * k / of;
  return {math::cos(angle), math::sin(angle)};
}

double area(const std::vector<Eigen::Vector2d>& corners) {
  double sum = 0;
  for (size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector2d &a = corners[i], &b = corners[(i + 1) % corners.size()];
    sum += (a.x() * b.y() - a.y() * b.x()) / 2;
  }
  return sum;
}

}  // namespace

Footprint footprint(const Model& model) {
  const Pose X_BaseM = model.drive ? model.drive->X_MBase.inverse() : Pose{};
  std::array<double, kDirections> reach;
  reach.fill(kNothing);
  Footprint found;
  for (const Link& link : model.links) {
    for (const Collision& c : link.collisions) {
      if (c.geometry.shape == Shape::plane) continue;
      const Convex shape{&c.geometry, X_BaseM * link.X_ML * c.X_LC, {}};
      for (int k = 0; k < kDirections; ++k) {
        const Eigen::Vector2d d = toward(k, kDirections);
        const Eigen::Vector2d p = shape.support(Vec3(d.x(), d.y(), 0)).head<2>();
        reach[static_cast<size_t>(k)] = std::max(reach[static_cast<size_t>(k)], p.dot(d));
        found.radius = std::max(found.radius, p.norm());
      }
    }
  }
  if (reach[0] == kNothing) return found;
  for (size_t k = 0; k < kSides; ++k) {  // where side k meets the next
    const double here = reach[k * kPerSide], next = reach[(k + 1) % kSides * kPerSide];
    const double turn = 2 * std::numbers::pi / kSides;
    const Eigen::Vector2d d = toward(static_cast<int>(k), kSides), along(-d.y(), d.x());
    const Eigen::Vector2d corner =
        here * d + (next - here * math::cos(turn)) / math::sin(turn) * along;
    const bool is_new =
        found.corners.empty() || ((corner - found.corners.back()).norm() > kSame_m &&
                                  (corner - found.corners.front()).norm() > kSame_m);
    if (is_new) found.corners.push_back(corner);
  }
  found.is_round = std::numbers::pi * found.radius * found.radius <= area(found.corners);
  return found;
}

}  // namespace ruedo::world
