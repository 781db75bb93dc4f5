// <ruedo:fleet> in <world>: many instances of one model, in a grid, on a ring or at random, each on
// the ground and clear of other things. Positions depend on the file alone, not on the run's seed.
#include <cmath>
#include <numbers>
#include <unordered_map>
#include <unordered_set>

#include "base/text.h"
#include "base/whole.h"
#include "ruedo/math.h"
#include "ruedo/random.h"
#include "world/drives/placement.h"
#include "world/sdf/sdf_reader.h"

namespace ruedo::world {
namespace {

// positions drawn for one robot before it counts as having no room
constexpr int kMostTries = 1000;
constexpr double kGap_m = 0.2;  // between neighbours, unless the file asks for more

struct Place {
  double x, y, yaw;
};

Eigen::Vector2d two_numbers(const Element& element, double least) {
  const std::vector<double> v = element.as_numbers(Allowed::any(quantity::kLength));
  if (v.size() != 2 || !(v[0] > least && v[1] > least)) {
    element.fail("'" + element.text + "' is not allowed; allowed are two numbers" +
                 (std::isfinite(least) ? " above 0" : ""));
  }
  return {v[0], v[1]};
}

// The values of the elements, before anything is placed.
struct Fleet {
  const Element& element;
  std::string name, arrangement;
  int64_t count;
  Eigen::Vector2d center = Eigen::Vector2d::Zero();
  double heading, spacing;

  Fleet(const Element& e, const Model& model) : element(e), name(required_name(e)) {
    const std::string* written = e.attribute("arrangement");
    arrangement = written ? *written : "grid";
    if (arrangement != "grid" && arrangement != "ring" && arrangement != "random") {
      e.fail("arrangement '" + arrangement + "' is not allowed; allowed are grid, ring and random");
    }
    if (!e.has("ruedo:count")) e.fail("has no <ruedo:count>");
    count = e.integer("ruedo:count", 1, Allowed::between(1, 100'000));
    if (const Element* c = e.child("ruedo:center"))
      center = two_numbers(*c, -std::numeric_limits<double>::infinity());
    heading = e.number("ruedo:heading", 0, Allowed::any(quantity::kAngle));
    spacing = e.number("ruedo:spacing", 2 * footprint_radius(model) + kGap_m,
                       Allowed::positive(quantity::kLength));
    const auto only_for = [&](const char* child, const char* kind) {
      if (e.has(child) && arrangement != kind)
        e.child(child)->fail(std::string("is for arrangement=\"") + kind + "\"");
    };
    only_for("ruedo:columns", "grid");
    only_for("ruedo:radius", "ring");
    only_for("ruedo:size", "random");
    only_for("ruedo:seed", "random");
  }

  Place in_grid(int64_t i) const {
    const int64_t columns =
        element.integer("ruedo:columns", rounded_up(std::sqrt(static_cast<double>(count))),
                        Allowed::between(1, 100'000));
    const int64_t rows = (count + columns - 1) / columns;
    const auto offset = [&](int64_t at, int64_t of) {
      return (static_cast<double>(at) - static_cast<double>(of - 1) / 2) * spacing;
    };
    return {center.x() + offset(i % columns, std::min(columns, count)),
            center.y() + offset(i / columns, rows), heading};
  }

  // Neighbours are `spacing` apart in a straight line; robots look outwards.
  Place on_ring(int64_t i) const {
    const double turn = 2 * std::numbers::pi / static_cast<double>(count);
    const double smallest = count > 1 ? spacing / (2 * math::sin(turn / 2)) : 0;
    const double radius = element.number("ruedo:radius", smallest,
                                         Allowed::not_negative(quantity::kLength)),
                 angle = turn * static_cast<double>(i);
    return {center.x() + radius * math::cos(angle), center.y() + radius * math::sin(angle),
            heading + angle};
  }
};

// Draws positions in a rectangle, none closer than `spacing` to one already accepted.
class RandomPlaces {
 public:
  explicit RandomPlaces(const Fleet& fleet)
      : fleet_(fleet),
        source_(static_cast<uint64_t>(
                    fleet.element.integer("ruedo:seed", 1, Allowed::between(0, 0x1p63))),
                fleet.name, "fleet") {
    size_ =
        Eigen::Vector2d::Constant(2 * fleet.spacing * std::sqrt(static_cast<double>(fleet.count)));
    if (const Element* s = fleet.element.child("ruedo:size")) size_ = two_numbers(*s, 0);
  }

  std::optional<Place> draw(int64_t robot, uint64_t attempt) const {
    RandomStream stream = source_.stream(static_cast<uint64_t>(robot) * kMostTries + attempt);
    const double x = fleet_.center.x() + (stream.uniform() - 0.5) * size_.x();
    const double y = fleet_.center.y() + (stream.uniform() - 0.5) * size_.y();
    const double yaw = fleet_.element.has("ruedo:heading")
                           ? fleet_.heading
                           : (2 * stream.uniform() - 1) * std::numbers::pi;
    for (int64_t i = cell(x) - 1; i <= cell(x) + 1; ++i) {
      for (int64_t j = cell(y) - 1; j <= cell(y) + 1; ++j) {
        const auto near = kept_.find(key(i, j));
        if (near == kept_.end()) continue;
        for (const Eigen::Vector2d& other : near->second) {
          if ((other - Eigen::Vector2d(x, y)).norm() < fleet_.spacing) return std::nullopt;
        }
      }
    }
    return Place{x, y, yaw};
  }
  void keep(const Place& place) {
    kept_[key(cell(place.x), cell(place.y))].emplace_back(place.x, place.y);
  }
  std::string size() const { return shown(size_.x()) + " x " + shown(size_.y()) + " m"; }

 private:
  int64_t cell(double at) const { return rounded_down(std::clamp(at / fleet_.spacing, -1e9, 1e9)); }
  static uint64_t key(int64_t x, int64_t y) {
    return static_cast<uint64_t>(x) << 32 ^ (static_cast<uint64_t>(y) & 0xffffffffu);
  }

  const Fleet& fleet_;
  RandomSource source_;
  Eigen::Vector2d size_;
  std::unordered_map<uint64_t, std::vector<Eigen::Vector2d>>
      kept_;  // only looked up, never iterated: its order is not defined
};

}  // namespace

void SdfReader::read_fleet(const Element& element, WorldModel& world, size_t most_models) {
  element.refuse_unknown(
      {"include", "ruedo:count", "ruedo:center", "ruedo:heading", "ruedo:spacing", "ruedo:columns",
       "ruedo:radius", "ruedo:size", "ruedo:seed"},
      false);
  const auto includes = element.all("include");
  if (includes.size() != 1)
    element.fail("has " + std::to_string(includes.size()) +
                 " <include>; it needs one, of the model that is placed");
  for (const char* child : {"name", "pose", "placement_frame"}) {
    if (includes[0]->has(child))
      includes[0]->child(child)->fail("is not allowed here; the fleet names and places its robots");
  }
  const auto included = include(*includes[0], "world/ruedo:fleet");
  if (!included) return;  // not found, which has been reported
  if (!included->model) includes[0]->fail("is not a model; a fleet is of models");
  const auto model = included->model->model;
  const Fleet fleet(element, *model);
  if (world.models.size() + static_cast<size_t>(fleet.count) > most_models) {
    element.fail("the world has more than " + std::to_string(most_models) + " models");
  }

  Room room(world);
  std::unordered_set<std::string> taken;
  for (const ModelInstance& instance : world.models) taken.insert(instance.name);
  RandomPlaces random(fleet);
  for (int64_t i = 0; i < fleet.count; ++i) {
    ModelInstance instance;
    instance.name = dotted(fleet.name) + "_" + std::to_string(i + 1);
    instance.model = model;
    if (taken.count(instance.name))
      element.fail("the name '" + instance.name + "' is taken by another model of the world");
    if (fleet.arrangement == "random") {
      bool found = false;
      for (uint64_t attempt = 0; attempt < kMostTries && !found; ++attempt) {
        const auto place = random.draw(i, attempt);
        if (!place) continue;
        instance.X_WM = room.standing_on(*model, place->x, place->y, place->yaw);
        found = room.overlapped(*model, instance.X_WM).empty();
        if (found) random.keep(*place);
      }
      if (!found) {
        element.fail("there is room for " + std::to_string(i) + " of " +
                     std::to_string(fleet.count) + " robots in " + random.size() +
                     "; a larger <ruedo:size> or a smaller <ruedo:spacing> helps");
      }
    } else {
      const Place place = fleet.arrangement == "grid" ? fleet.in_grid(i) : fleet.on_ring(i);
      instance.X_WM = room.standing_on(*model, place.x, place.y, place.yaw);
      if (const std::string other = room.overlapped(*model, instance.X_WM); !other.empty()) {
        element.fail("there is no room for '" + instance.name + "' at " + shown(place.x) + " " +
                     shown(place.y) + ": it would stand in '" + other + "'");
      }
    }
    check_channel_names(instance, element.source);
    room.add(instance);
    world.models.push_back(std::move(instance));
  }
}

}  // namespace ruedo::world
