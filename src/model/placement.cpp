// Heights by vertical lines through the static collisions, room by GJK against every collision of the world.
#include "model/placement.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "model/convex.h"
#include "model/geometry.h"

namespace ruedo::model {
namespace {

constexpr double kStep_m = 0.5;         // what counts as ground above the lowest surface
constexpr double kClearance_m = 0.02;   // what a model may sink into bumps of the ground
constexpr double kFar_m = 1e5;

// The corners of a shape's bounding box in the world.
Eigen::AlignedBox3d world_box(const Geometry& g, const Pose& X_WG) {
  const Eigen::AlignedBox3d box = bounds(g);
  Eigen::AlignedBox3d result;
  if (box.isEmpty()) return result;
  for (int corner = 0; corner < 8; ++corner) {
    result.extend(X_WG * box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner)));
  }
  return result;
}

std::array<Vec3, 3> triangle_of(const Geometry& g, const Pose& X_WG, size_t index) {
  std::array<Vec3, 3> corners;
  for (size_t k = 0; k < 3; ++k) {
    corners[k] = X_WG * g.scale.cwiseProduct(g.mesh->positions[g.mesh->triangles[index][k]].cast<double>());
  }
  return corners;
}

// Where the vertical line through (x, y) meets a triangle.
std::optional<double> height_of(const std::array<Vec3, 3>& t, double x, double y) {
  const Vec3 ab = t[1] - t[0], ac = t[2] - t[0];
  const double area = ab.x() * ac.y() - ab.y() * ac.x();
  if (std::abs(area) < 1e-15) return std::nullopt;    // vertical
  const double dx = x - t[0].x(), dy = y - t[0].y();
  const double u = (dx * ac.y() - dy * ac.x()) / area, v = (ab.x() * dy - ab.y() * dx) / area;
  if (u < -1e-9 || v < -1e-9 || u + v > 1 + 1e-9) return std::nullopt;
  return t[0].z() + u * ab.z() + v * ac.z();
}

// The top of a convex shape over (x, y): the highest z at which a thin vertical needle from far above meets it, by
// halving.
std::optional<double> top_of(const Geometry& g, const Pose& X_WG, double x, double y) {
  const Eigen::AlignedBox3d box = world_box(g, X_WG);
  if (x < box.min().x() || x > box.max().x() || y < box.min().y() || y > box.max().y()) return std::nullopt;
  const Convex shape{&g, X_WG, {}};
  const auto meets_above = [&](double z) {
    const Vec3 needle[2] = {{x, y, z}, {x, y, box.max().z() + 1}};
    return overlap(shape, {nullptr, {}, needle});
  };
  double low = box.min().z() - 1e-6, high = box.max().z() + 1e-6;
  if (!meets_above(low)) return std::nullopt;
  for (int i = 0; i < 60 && high - low > 1e-9; ++i) {
    const double middle = (low + high) / 2;
    (meets_above(middle) ? low : high) = middle;
  }
  return low;
}

template <class Visit>
void for_each_collision(const Model& model, const Pose& X_WM, Visit visit) {
  for (const Link& link : model.links) {
    for (const Collision& c : link.collisions) visit(c.geometry, X_WM * link.X_ML * c.X_LC);
  }
}

}  // namespace

double ground_height(const WorldModel& world, double x, double y) {
  std::vector<double> heights;
  for (const ModelInstance& instance : world.models) {
    if (!instance.model->is_static) continue;
    for_each_collision(*instance.model, instance.X_WM, [&](const Geometry& g, const Pose& X_WG) {
      if (g.shape == Shape::plane) {
        const Vec3 n = X_WG.rotation * g.normal;
        if (n.z() > 1e-6) {
          const Vec3& at = X_WG.translation;
          heights.push_back(at.z() - (n.x() * (x - at.x()) + n.y() * (y - at.y())) / n.z());
        }
      } else if (g.shape == Shape::mesh) {
        const Eigen::AlignedBox3d box = world_box(g, X_WG);
        if (x < box.min().x() || x > box.max().x() || y < box.min().y() || y > box.max().y()) return;
        for (size_t t = 0; t < g.mesh->triangles.size(); ++t) {
          if (const auto z = height_of(triangle_of(g, X_WG, t), x, y)) heights.push_back(*z);
        }
      } else if (const auto z = top_of(g, X_WG, x, y)) {
        heights.push_back(*z);
      }
    });
  }
  std::erase_if(heights, [](double z) { return !(std::abs(z) < kFar_m); });
  if (heights.empty()) return 0;
  const double lowest = *std::min_element(heights.begin(), heights.end());
  double ground = lowest;
  for (const double z : heights) {
    if (z <= lowest + kStep_m) ground = std::max(ground, z);
  }
  return ground;
}

Pose standing_on(const WorldModel& world, const Model& model, double x, double y, double yaw) {
  Pose X_WM{Quat(Eigen::AngleAxisd(yaw, Vec3::UnitZ())), {x, y, 0}};
  double lowest = std::numeric_limits<double>::infinity();
  for_each_collision(model, X_WM, [&](const Geometry& g, const Pose& X_WG) {
    if (g.shape == Shape::plane) return;
    lowest = std::min(lowest, Convex{&g, X_WG, {}}.support(-Vec3::UnitZ()).z());
  });
  // A drive says better where the ground is than a wheel's shape, which may be a little larger or smaller.
  if (model.drive) lowest = std::min(lowest, model.drive->X_MBase.translation.z());
  X_WM.translation.z() = ground_height(world, x, y) - (std::isfinite(lowest) ? lowest : 0.0);
  return X_WM;
}

std::string overlapped(const WorldModel& world, const Model& model, const Pose& X_WM) {
  const Pose lifted{X_WM.rotation, X_WM.translation + Vec3(0, 0, kClearance_m)};
  struct Part {
    const Geometry* geometry;
    Pose X_WG;
    Eigen::AlignedBox3d box;
  };
  std::vector<Part> parts;
  Eigen::AlignedBox3d whole;
  for_each_collision(model, lifted, [&](const Geometry& g, const Pose& X_WG) {
    if (g.shape == Shape::plane) return;
    parts.push_back({&g, X_WG, world_box(g, X_WG)});
    whole.extend(parts.back().box);
  });
  if (parts.empty()) return "";
  for (const ModelInstance& instance : world.models) {
    bool hit = false;
    for_each_collision(*instance.model, instance.X_WM, [&](const Geometry& g, const Pose& X_WG) {
      if (hit) return;
      if (g.shape == Shape::plane) {
        const Vec3 n = X_WG.rotation * g.normal;
        for (const Part& part : parts) {
          hit |= n.dot(Convex{part.geometry, part.X_WG, {}}.support(-n) - X_WG.translation) < 0;
        }
        return;
      }
      const Eigen::AlignedBox3d box = world_box(g, X_WG);
      if (!box.intersects(whole)) return;
      for (const Part& part : parts) {
        if (hit || !box.intersects(part.box)) continue;
        const Convex mine{part.geometry, part.X_WG, {}};
        if (g.shape != Shape::mesh) {
          hit = overlap(mine, {&g, X_WG, {}});
          continue;
        }
        for (size_t t = 0; t < g.mesh->triangles.size() && !hit; ++t) {
          const std::array<Vec3, 3> corners = triangle_of(g, X_WG, t);
          Eigen::AlignedBox3d around;
          for (const Vec3& corner : corners) around.extend(corner);
          if (around.intersects(part.box)) hit = overlap(mine, {nullptr, {}, corners});
        }
      }
    });
    if (hit) return instance.name;
  }
  return "";
}

}  // namespace ruedo::model
