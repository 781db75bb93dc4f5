// Decides by shapes and triangles: whatever reaches below the height is kept whole.
#include "scene/cut_away.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "world/read/geometry.h"

namespace ruedo::scene {
namespace {

constexpr double kPerson_m = 1.8;
constexpr double kCovered = 0.5;  // of the world's area
constexpr double kShown_m = 2.0;  // how much of the walls stays visible above the lowest thing

using Box = Eigen::AlignedBox3d;

Box placed(const world::Geometry& geometry, const Pose& X_WG) {
  Box result;
  const Box box = world::bounds(geometry);
  if (box.isEmpty()) return result;
  for (int corner = 0; corner < 8; ++corner)
    result.extend(X_WG * box.corner(static_cast<Box::CornerType>(corner)));
  return result;
}

template <class Visit>
void for_each_visual(const world::WorldModel& world, Visit visit) {
  for (const world::ModelInstance& instance : world.models) {
    if (instance.removed) continue;
    for (const world::Link& link : instance.model->links) {
      for (const world::Visual& visual : link.visuals) {
        if (visual.geometry.shape != world::Shape::plane)
          visit(visual, instance.X_WM * link.X_ML * visual.X_LV);
      }
    }
  }
}

Vec3 corner_of(const world::Geometry& g, const Pose& X_WG, uint32_t index) {
  return X_WG * g.scale.cwiseProduct(g.mesh->positions[index].cast<double>());
}

// Areas in m^2, seen from above: of what lies entirely above that height, and of the rest.
struct Area {
  double above = 0.0, below = 0.0;
};

Area area_of(const world::Visual& visual, const Pose& X_WV, double height) {
  Area area;
  const Box box = placed(visual.geometry, X_WV);
  if (box.isEmpty()) return area;
  const world::Geometry& g = visual.geometry;
  if (g.shape != world::Shape::mesh) {
    (box.min().z() > height ? area.above : area.below) = box.sizes().x() * box.sizes().y();
    return area;
  }
  const double sides = g.mesh->closed ? 2.0 : 1.0;
  for (const auto& t : g.mesh->triangles) {
    const Vec3 a = corner_of(g, X_WV, t[0]), b = corner_of(g, X_WV, t[1]),
               c = corner_of(g, X_WV, t[2]);
    (std::min({a.z(), b.z(), c.z()}) > height ? area.above : area.below) +=
        std::abs((b - a).cross(c - a).z()) / 2 / sides;
  }
  return area;
}

std::shared_ptr<const world::Mesh> cut(const world::Geometry& g, const Pose& X_WG, double height) {
  auto mesh = std::make_shared<world::Mesh>(*g.mesh);
  mesh->triangles.clear();
  mesh->closed = false;
  for (world::Mesh::Part& part : mesh->parts) {
    const uint32_t first = part.first_triangle, count = part.triangle_count;
    part.first_triangle = static_cast<uint32_t>(mesh->triangles.size());
    for (uint32_t i = first; i < first + count; ++i) {
      const auto& t = g.mesh->triangles[i];
      const bool above = std::all_of(t.begin(), t.end(), [&](uint32_t corner) {
        return corner_of(g, X_WG, corner).z() > height;
      });
      if (!above) mesh->triangles.push_back(t);
    }
    part.triangle_count = static_cast<uint32_t>(mesh->triangles.size()) - part.first_triangle;
  }
  return mesh;
}

void cut(world::Link& link, const Pose& X_WL, double height) {
  std::vector<world::Visual> kept;
  for (world::Visual& visual : link.visuals) {
    const Pose X_WV = X_WL * visual.X_LV;
    const Box box = placed(visual.geometry, X_WV);
    if (!box.isEmpty() && box.min().z() > height) continue;
    if (!box.isEmpty() && box.max().z() > height && visual.geometry.shape == world::Shape::mesh)
      visual.geometry.mesh = cut(visual.geometry, X_WV, height);
    kept.push_back(std::move(visual));
  }
  link.visuals = std::move(kept);
}

}  // namespace

namespace {

bool has_ground_plane(const world::WorldModel& world) {
  return std::any_of(world.models.begin(), world.models.end(), [](const auto& instance) {
    const std::vector<world::Link>& links = instance.model->links;
    return std::any_of(links.begin(), links.end(), [](const world::Link& link) {
      return std::any_of(link.visuals.begin(), link.visuals.end(), [](const world::Visual& visual) {
        return visual.geometry.shape == world::Shape::plane;
      });
    });
  });
}

}  // namespace

std::optional<double> height_of_ceiling(const world::WorldModel& world) {
  Box bounds;
  for_each_visual(world, [&](const world::Visual& visual, const Pose& X_WV) {
    bounds.extend(placed(visual.geometry, X_WV));
  });
  if (bounds.isEmpty()) return std::nullopt;
  const double floor = bounds.min().z(), whole = bounds.sizes().x() * bounds.sizes().y();
  Area area;
  for_each_visual(world, [&](const world::Visual& visual, const Pose& X_WV) {
    const Area own = area_of(visual, X_WV, floor + kPerson_m);
    area.above += own.above;
    area.below += own.below;
  });
  if (has_ground_plane(world)) area.below += whole;
  // A mountain hides nothing: there is no floor below it.
  if (area.above < kCovered * whole || area.below < kCovered * whole) return std::nullopt;
  return floor + kShown_m;
}

std::shared_ptr<const world::WorldModel> without_what_is_above(const world::WorldModel& world,
                                                               double height_m) {
  auto open = std::make_shared<world::WorldModel>(world);
  for (world::ModelInstance& instance : open->models) {
    auto own = std::make_shared<world::Model>(*instance.model);
    for (world::Link& link : own->links) cut(link, instance.X_WM * link.X_ML, height_m);
    instance.model = std::move(own);
  }
  return open;
}

}  // namespace ruedo::scene
