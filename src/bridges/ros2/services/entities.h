// The models of a world as the entities of simulation_interfaces: names, categories, bounds, what
// clients say about them, and the filters of queries.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <regex.h>
#include <Eigen/Geometry>

#include "bridges/ros2/messages/cdr.h"
#include "bridges/ros2/services/results.h"
#include "ruedo/pose.h"
#include "world/model/world_model.h"

namespace ruedo::ros2 {

enum Category : uint8_t { kRobot = 1, kHuman = 2, kDynamic = 4, kStatic = 5 };

// simulation_interfaces/msg/TagsFilter
struct TagsFilter {
  enum Mode : uint8_t { any = 0, all = 1 };
  std::vector<std::string> tags;
  uint8_t mode = any;

  bool matches(const std::vector<std::string>& own) const;
};

TagsFilter read_tags(CdrReader& in);

// simulation_interfaces/msg/EntityFilters: of a name, a POSIX extended regular expression that
// matches it as a whole or in part; of categories and tags; of what overlaps with a box or a
// sphere.
class EntityFilter {
 public:
  explicit EntityFilter(CdrReader& in);
  ~EntityFilter();
  EntityFilter(const EntityFilter&) = delete;
  EntityFilter& operator=(const EntityFilter&) = delete;

  const Result& fault() const { return fault_; }  // kOk: it can be used
  bool matches(const std::string& name, uint8_t category,
               const std::vector<std::string>& tags) const;
  bool has_bounds() const { return box_ || sphere_; }
  // box: of the entity, in its model's frame; none: unbounded.
  bool overlaps(const std::optional<Eigen::AlignedBox3d>& box, const Pose& X_WM) const;

 private:
  void take_expression(const std::string& text);
  void take_bounds(uint8_t type, const std::vector<Vec3>& points);

  Result fault_;
  bool compiled_ = false;  // no expression: all names
  regex_t expression_{};
  std::vector<uint8_t> categories_;
  TagsFilter tags_;
  std::optional<Eigen::AlignedBox3d> box_;
  struct Sphere {
    Vec3 center;
    double radius;  // m
  };
  std::optional<Sphere> sphere_;
};

// Not thread-safe.
class Entities {
 public:
  struct Entity {
    uint8_t category;
    std::string description;
    std::vector<std::string> tags;
    std::optional<Eigen::AlignedBox3d> box;  // in the model's frame, its joints as at the start;
                                             // none: unbounded
    Pose X_ML;                               // of its canonical link
    bool is_static = false;
    bool is_said = false;  // category, description and tags are a client's
  };

  // The entities from now on; null: none.
  void update(std::shared_ptr<const world::WorldModel> world);
  const world::WorldModel* world() const { return world_.get(); }

  // Null: unknown.
  const Entity* find(const std::string& name) const;
  // Category, description and tags for as long as the entity exists; false without one.
  bool say(const std::string& name, uint8_t category, std::string description,
           std::vector<std::string> tags);
  std::vector<std::string> matching(const EntityFilter& filter) const;
  // The names of those that were not there at the first update.
  std::vector<std::string> spawned() const;

 private:
  std::shared_ptr<const world::WorldModel> world_;
  std::map<std::string, Entity> entities_;
  std::optional<std::vector<std::string>> first_;  // sorted
};

}  // namespace ruedo::ros2
