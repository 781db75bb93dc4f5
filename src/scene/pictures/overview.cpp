// Roofs are cut off by shapes and triangles: whatever reaches below the height is kept whole, and
// whatever can move: a body above the floor will fall.
#include "scene/pictures/overview.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "world/model/bounds.h"
#include "world/model/height_grid.h"

namespace ruedo::scene {
namespace {

constexpr double kPerson_m = 1.8;
constexpr double kCovered = 0.5;       // of the world's area
constexpr double kShown_m = 2.0;       // how much of the walls stays visible above the floor
constexpr double kCounted = 0.95;      // of the volume of all models
constexpr double kNearby = 10.0;       // what makes it larger by less is shown, too,
constexpr double kNearby_m = 30.0;     // and whatever makes it no larger than this
constexpr double kFlat = 0.02;         // height by width of what is a floor
constexpr double kLargestFloor = 4.0;  // by the size of what stands on it
constexpr double kThinnest_m = 0.01;   // a sheet has a volume, too

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
          visit(instance, visual, instance.X_WM * link.X_ML * visual.X_LV);
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
  if (g.shape != world::Shape::mesh || world::grid_of(*g.mesh)) {
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
    if (!box.isEmpty() && box.max().z() > height && visual.geometry.shape == world::Shape::mesh &&
        !world::grid_of(*visual.geometry.mesh))
      visual.geometry.mesh = cut(visual.geometry, X_WV, height);
    kept.push_back(std::move(visual));
  }
  link.visuals = std::move(kept);
}

// A visual, as the overview counts it.
struct Item {
  Box box;
  double volume = 0.0;  // m^3
  bool robots = false;  // a part of one

  bool is_flat() const {
    return box.sizes().z() < kFlat * std::max(box.sizes().x(), box.sizes().y());
  }
};

double size(const Box& box) { return box.sizes().maxCoeff(); }

std::vector<Item> items_of(const world::WorldModel& world) {
  std::vector<Item> items;
  for_each_visual(world, [&](const world::ModelInstance& instance, const world::Visual& visual,
                             const Pose& X_WV) {
    const Box box = placed(visual.geometry, X_WV);
    if (box.isEmpty()) return;
    items.push_back(
        {box, box.sizes().cwiseMax(kThinnest_m).prod(), instance.model->drive.has_value()});
  });
  return items;
}

// The middle by volume, along each axis.
Vec3 middle_of(std::vector<Item> items) {
  Vec3 middle = Vec3::Zero();
  double whole = 0.0;
  for (const Item& item : items) whole += item.volume;
  for (int axis = 0; axis < 3; ++axis) {
    std::sort(items.begin(), items.end(), [axis](const Item& a, const Item& b) {
      return a.box.center()[axis] < b.box.center()[axis];
    });
    double before = 0.0;
    for (const Item& item : items) {
      middle[axis] = item.box.center()[axis];
      if ((before += item.volume) >= 0.5 * whole) break;
    }
  }
  return middle;
}

// From the middle outwards until nearly all is in; then what is near to that.
Box box_of(std::vector<Item> items) {
  Box box;
  double left = 0.0;
  for (const Item& item : items) left += (1.0 - kCounted) * item.volume;
  const Vec3 middle = middle_of(items);
  const auto reach = [&](const Item& item) {
    return std::max((item.box.max() - middle).cwiseAbs().maxCoeff(),
                    (item.box.min() - middle).cwiseAbs().maxCoeff());
  };
  std::stable_sort(items.begin(), items.end(),
                   [&](const Item& a, const Item& b) { return reach(a) > reach(b); });
  size_t first = 0;  // that counts
  while (first < items.size() && (left -= items[first].volume) >= 0.0) ++first;
  for (size_t i = 0; i < items.size(); ++i) {
    if (i >= first || items[i].robots) box.extend(items[i].box);
  }
  const double most = std::max(kNearby * size(box), kNearby_m);
  for (size_t i = first; i-- > 0;) {
    if (const Box with = box.merged(items[i].box); size(with) <= most) box = with;
  }
  return box;
}

// Floors count as far as they are not much larger than the rest.
Box shown_of(const std::vector<Item>& items) {
  std::vector<Item> standing, flat;
  for (const Item& item : items) (item.is_flat() ? flat : standing).push_back(item);
  const bool only_robots =
      std::all_of(standing.begin(), standing.end(), [](const Item& item) { return item.robots; });
  if (only_robots) return box_of(items);
  Box box = box_of(std::move(standing));
  const double most = kLargestFloor * size(box);
  for (const Item& item : flat) {
    if (const Box with = box.merged(item.box); size(with) <= most) box = with;
  }
  return box;
}

// Shapes without an end.
std::optional<double> height_of_ground(const world::WorldModel& world) {
  for (const world::ModelInstance& instance : world.models) {
    if (instance.removed) continue;
    for (const world::Link& link : instance.model->links) {
      for (const world::Visual& visual : link.visuals) {
        if (visual.geometry.shape == world::Shape::plane)
          return (instance.X_WM * link.X_ML * visual.X_LV).translation.z();
      }
    }
  }
  return std::nullopt;
}

// Where the first robot stands; else the ground; else 0, where nearly every world has its floor.
double floor_of(const world::WorldModel& world, const Box& shown) {
  for (const world::ModelInstance& instance : world.models) {
    if (!instance.removed && instance.model->drive) return instance.X_WM.translation.z();
  }
  return height_of_ground(world).value_or(std::clamp(0.0, shown.min().z(), shown.max().z()));
}

std::optional<double> ceiling_of(const world::WorldModel& world, const Box& shown, double floor) {
  const double whole = shown.sizes().x() * shown.sizes().y();
  Area area;
  for_each_visual(world, [&](const world::ModelInstance& instance, const world::Visual& visual,
                             const Pose& X_WV) {
    const Box box = placed(visual.geometry, X_WV);
    if (!instance.model->is_static || box.isEmpty() || !shown.intersects(box)) return;
    const Area own = area_of(visual, X_WV, floor + kPerson_m);
    area.above += own.above;
    area.below += own.below;
  });
  if (height_of_ground(world)) area.below += whole;
  // A mountain hides nothing: it has no floor below it.
  if (area.above < kCovered * whole || area.below < kCovered * whole) return std::nullopt;
  return floor + kShown_m;
}

}  // namespace

Overview overview(const world::WorldModel& world) {
  const Box shown = shown_of(items_of(world));
  if (shown.isEmpty()) return {{Vec3(-3, -3, 0), Vec3(3, 3, 1)}, 0.0, std::nullopt};
  Overview result{{shown.min(), shown.max()}, floor_of(world, shown), {}};
  result.ceiling = ceiling_of(world, shown, result.floor);
  return result;
}

std::shared_ptr<const world::WorldModel> without_what_is_above(const world::WorldModel& world,
                                                               double height_m) {
  auto open = std::make_shared<world::WorldModel>(world);
  for (world::ModelInstance& instance : open->models) {
    if (!instance.model->is_static) continue;
    auto own = std::make_shared<world::Model>(*instance.model);
    for (world::Link& link : own->links) cut(link, instance.X_WM * link.X_ML, height_m);
    instance.model = std::move(own);
  }
  return open;
}

}  // namespace ruedo::scene
