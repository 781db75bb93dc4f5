// Reads <ruedo:crowd> and draws where its people start.
#include "world/sdf/crowd.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <unordered_set>

#include "base/whole.h"
#include "ruedo/random.h"
#include "world/drives/placement.h"
#include "world/read/read_context.h"
#include "world/sdf/sdf_reader.h"

namespace ruedo::world {
namespace {

constexpr int kMostTries = 1000;  // places drawn for one person before there is no room
constexpr double kAround_m = 5;   // margin around areas and goals in which routes are planned
// heights above the floor at which the world is cut: what is there is an obstacle for people
constexpr double kCutAt_m[] = {0.3, 1.2};
constexpr double kCell_m = 0.05;

// "x y", or two corners "x y x y".
Rect rect_of(const Element& element, bool point_allowed) {
  const std::vector<double> v = element.as_numbers(Allowed::any(quantity::kLength));
  if (v.size() == 2 && point_allowed) return {{v[0], v[1]}, {v[0], v[1]}};
  if (v.size() != 4)
    element.fail("'" + element.text + "' is not allowed; allowed are " +
                 (point_allowed ? "x y of a place, or " : "") + "x y x y of two corners");
  const Vec2 a(v[0], v[1]), b(v[2], v[3]);
  return {a.cwiseMin(b), a.cwiseMax(b)};
}

// Circles in the plane, by the cells that they lie in.
class Circles {
 public:
  void add(const Circle& circle) {
    const Cells covered(circle);
    if (covered.count() > kMostCells) return large_.push_back(circle);
    covered.any([&](uint64_t cell) { return cells_[cell].push_back(circle), false; });
  }
  bool meet(const Circle& circle) const {
    const auto meets = [&](const Circle& other) {
      return (other.at - circle.at).norm() < other.radius + circle.radius;
    };
    return std::any_of(large_.begin(), large_.end(), meets) ||
           Cells(circle).any([&](uint64_t cell) {
             const auto there = cells_.find(cell);
             return there != cells_.end() &&
                    std::any_of(there->second.begin(), there->second.end(), meets);
           });
  }

 private:
  static constexpr double kSide_m = 1.0, kMostCells = 64;

  // Those that a circle's square covers.
  struct Cells {
    explicit Cells(const Circle& c)
        : x0(cell_of(c.at.x() - c.radius)),
          x1(cell_of(c.at.x() + c.radius)),
          y0(cell_of(c.at.y() - c.radius)),
          y1(cell_of(c.at.y() + c.radius)) {}
    static int64_t cell_of(double at) { return rounded_down(std::clamp(at / kSide_m, -1e8, 1e8)); }
    double count() const {
      return static_cast<double>(x1 - x0 + 1) * static_cast<double>(y1 - y0 + 1);
    }
    template <class Visit>
    bool any(Visit visit) const {
      for (int64_t y = y0; y <= y1; ++y) {
        for (int64_t x = x0; x <= x1; ++x) {
          if (visit(static_cast<uint64_t>(x) << 32 ^ (static_cast<uint64_t>(y) & 0xffffffffu)))
            return true;
        }
      }
      return false;
    }
    int64_t x0, x1, y0, y1;
  };

  std::unordered_map<uint64_t, std::vector<Circle>> cells_;  // looked up only
  std::vector<Circle> large_;
};

}  // namespace

CrowdDescription read_crowd(const Element& e) {
  e.refuse_unknown({"ruedo:count", "ruedo:area", "ruedo:goal", "ruedo:at_end", "ruedo:speed",
                    "ruedo:radius", "ruedo:height", "ruedo:fluctuation", "ruedo:avoid_robots"},
                   false);
  CrowdDescription crowd;
  crowd.source = e.source;
  crowd.name = dotted(required_name(e));
  if (!e.has("ruedo:area")) e.fail("has no <ruedo:area>");
  crowd.area = rect_of(*e.child("ruedo:area"), false);
  crowd.count = static_cast<int>(e.integer("ruedo:count", 1, Allowed::between(1, 10'000)));
  for (const Element* goal : e.all("ruedo:goal")) crowd.goals.push_back(rect_of(*goal, true));
  const std::string at_end = e.choice("ruedo:at_end", "loop", {"loop", "stop", "again"});
  crowd.at_end = at_end == "stop"    ? CrowdDescription::AtEnd::stop
                 : at_end == "again" ? CrowdDescription::AtEnd::again
                                     : CrowdDescription::AtEnd::loop;
  if (const Element* speed = e.child("ruedo:speed")) {
    const std::vector<double> v = speed->as_numbers(Allowed::between(0, 10));
    if (v.empty() || v.size() > 2 || !(v[0] > 0))
      speed->fail("'" + speed->text +
                  "' is not allowed; allowed are a mean above 0 and a deviation");
    crowd.speed = v[0];
    crowd.speed_deviation = v.size() == 2 ? v[1] : 0.0;
  }
  crowd.radius = e.number("ruedo:radius", crowd.radius, Allowed::between(0.05, 2));
  crowd.height = e.number("ruedo:height", crowd.height, Allowed::between(0.1, 10));
  crowd.fluctuation = e.number("ruedo:fluctuation", crowd.fluctuation, Allowed::between(0, 10));
  crowd.avoids_robots = e.boolean("ruedo:avoid_robots", true);
  return crowd;
}

Link person_link(double radius_m, double height_m, const Source& source) {
  Link link;
  link.name = "link";
  link.source = source;
  link.kinematic = true;
  link.inertial.mass = 75;
  Collision collision;
  collision.name = "body";
  collision.X_LC.translation.z() = height_m / 2;
  collision.geometry.shape = Shape::cylinder;
  collision.geometry.size = {radius_m, height_m, 0};
  collision.source = source;
  Visual visual;
  visual.name = "body";
  visual.X_LV = collision.X_LC;
  visual.geometry = collision.geometry;
  link.collisions.push_back(std::move(collision));
  link.visuals.push_back(std::move(visual));
  return link;
}

FloorPlan walls_for(const WorldModel& world, const CrowdDescription& crowd, double floor_m) {
  Rect within = crowd.area;
  for (const Rect& goal : crowd.goals) {
    within.low = within.low.cwiseMin(goal.low);
    within.high = within.high.cwiseMax(goal.high);
  }
  within.low -= Vec2::Constant(kAround_m);
  within.high += Vec2::Constant(kAround_m);
  WorldModel standing;
  standing.file = world.file;
  for (const ModelInstance& instance : world.models) {
    if (instance.model->is_static && !instance.removed) standing.models.push_back(instance);
  }
  std::vector<Rect> walls;
  const Vec2 size = within.high - within.low;
  const double cell = std::max(kCell_m, std::sqrt(size.x() * size.y() / 4e6));
  for (const double height : kCutAt_m) {
    for (const WallPiece& wall :
         walls_of(occupancy_of(standing, cell, floor_m + height, &within))) {
      const Vec2 half(wall.length / 2, wall.width / 2), at(wall.x, wall.y);
      walls.push_back({at - half, at + half});
    }
  }
  return {std::move(walls), within};
}

std::vector<Vec2> places_of(const CrowdDescription& crowd, const FloorPlan& walls,
                            const std::vector<Circle>& taken, uint64_t seed) {
  Circles circles;
  for (const Circle& circle : taken) circles.add(circle);
  const RandomSource source(seed, crowd.name, "places");
  std::vector<Vec2> places;
  for (int i = 0; i < crowd.count; ++i) {
    bool found = false;
    for (int attempt = 0; attempt < kMostTries && !found; ++attempt) {
      RandomStream stream =
          source.stream(static_cast<uint64_t>(i) * kMostTries + static_cast<uint64_t>(attempt));
      const double x = stream.uniform(), y = stream.uniform();
      const Vec2 at = crowd.area.low + Vec2(x, y).cwiseProduct(crowd.area.high - crowd.area.low);
      FloorPlan::Near near[2];
      found = walls.nearest(at, crowd.radius, near) == 0 && !circles.meet({at, crowd.radius});
      if (found) {
        places.push_back(at);
        circles.add({at, crowd.radius});
      }
    }
    if (!found)
      throw InputError(crowd.source, "<ruedo:crowd>: there is room for " + std::to_string(i) +
                                         " of " + std::to_string(crowd.count) +
                                         " people; a larger <ruedo:area> helps");
  }
  return places;
}

namespace {

// The lowest ground among its corners and its centre: the others may be under something.
double floor_of(const Rect& area, const WorldModel& world) {
  const Room room(world);
  const Vec2 middle = (area.low + area.high) / 2;
  return std::min({room.ground_height(middle.x(), middle.y()),
                   room.ground_height(area.low.x(), area.low.y()),
                   room.ground_height(area.high.x(), area.low.y()),
                   room.ground_height(area.low.x(), area.high.y()),
                   room.ground_height(area.high.x(), area.high.y())});
}

}  // namespace

void add_crowd(const Element& element, WorldModel& world, size_t most_models) {
  const CrowdDescription crowd = read_crowd(element);
  if (world.models.size() + static_cast<size_t>(crowd.count) > most_models)
    element.fail("the world has more than " + std::to_string(most_models) + " models");
  auto person = std::make_shared<Model>();
  person->name = crowd.name;
  person->source = crowd.source;
  person->path = element.clone();
  person->links.push_back(person_link(crowd.radius, crowd.height, crowd.source));
  const double floor = floor_of(crowd.area, world);
  std::vector<Circle> taken;
  for (const ModelInstance& instance : world.models) {
    if (!instance.model->is_static)
      taken.push_back({instance.X_WM.translation.head<2>(), footprint_radius(*instance.model)});
  }
  constexpr uint64_t kBeforeARun = 1;  // a run's own seed draws them again
  const std::vector<Vec2> places =
      places_of(crowd, walls_for(world, crowd, floor), taken, kBeforeARun);
  std::unordered_set<std::string> names;
  for (const ModelInstance& instance : world.models) names.insert(instance.name);
  for (size_t i = 0; i < places.size(); ++i) {
    ModelInstance instance;
    instance.name = crowd.name + "_" + std::to_string(i + 1);
    instance.model = person;
    instance.X_WM.translation = {places[i].x(), places[i].y(), floor};
    if (names.contains(instance.name))
      element.fail("the name '" + instance.name + "' is taken by another model of the world");
    check_channel_names(instance, element.source);
    world.models.push_back(std::move(instance));
  }
}

}  // namespace ruedo::world
