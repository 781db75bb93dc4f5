#include "bridges/ros2/services/entities.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "world/model/body_layout.h"
#include "world/model/bounds.h"

namespace ruedo::ros2 {
namespace {

using Box = Eigen::AlignedBox3d;

constexpr size_t kLongestFilter = 200;
constexpr size_t kLongestWrittenOut = 500;  // what is repeated so often

// How many copies the C library makes of a part of an expression, at most: + after a group or a
// repeat doubles what it repeats, and {9} makes nine of it.
size_t copies(const std::string& expression) {
  size_t times = 1;
  for (size_t i = 1; i < expression.size() && times <= kLongestWrittenOut; ++i) {
    if (expression[i] == '+' && std::strchr(")+*?}", expression[i - 1])) times *= 2;
    if (expression[i] != '{') continue;
    size_t number = 0, largest = 1;
    for (size_t at = i + 1; at < expression.size() && largest <= kLongestWrittenOut; ++at) {
      const char c = expression[at];
      number = c >= '0' && c <= '9' ? 10 * number + static_cast<size_t>(c - '0') : 0;
      largest = std::max(largest, number);
      if (c == '}') break;
    }
    times *= largest;
  }
  return times;
}

// By separating axes: the normals of both boxes' faces, and those to pairs of their edges.
bool overlap(const Box& a, const Box& b, const Pose& X_AB) {
  const Eigen::Matrix3d R = X_AB.rotation.toRotationMatrix();
  const Vec3 apart = X_AB * b.center() - a.center(), half_a = a.sizes() / 2, half_b = b.sizes() / 2;
  const auto separates = [&](const Vec3& axis) {
    return std::abs(apart.dot(axis)) >
           half_a.dot(axis.cwiseAbs()) + half_b.dot((R.transpose() * axis).cwiseAbs());
  };
  for (int i = 0; i < 3; ++i) {
    if (separates(Vec3::Unit(i)) || separates(R.col(i))) return false;
    for (int j = 0; j < 3; ++j)
      if (separates(Vec3::Unit(i).cross(R.col(j)))) return false;
  }
  return true;
}

// Of what it collides with, or else of what is drawn. None: a plane has no end.
std::optional<Box> box_of(const world::Model& model) {
  Box box;
  bool ends = true;
  const auto add = [&](const Pose& X_MG, const world::Geometry& geometry) {
    const Box own = world::bounds(geometry);
    ends &= geometry.shape != world::Shape::plane;
    for (int corner = 0; corner < 8 && !own.isEmpty(); ++corner)
      box.extend(X_MG * own.corner(static_cast<Box::CornerType>(corner)));
  };
  for (const world::Link& link : model.links)
    for (const world::Collision& each : link.collisions) add(link.X_ML * each.X_LC, each.geometry);
  if (ends && box.isEmpty()) {
    for (const world::Link& link : model.links)
      for (const world::Visual& each : link.visuals) add(link.X_ML * each.X_LV, each.geometry);
  }
  if (!ends) return std::nullopt;
  if (box.isEmpty()) box.extend(model.links[ModelLinkIndex(0)].X_ML.translation);
  return box;
}

bool moves(const world::BodyLayout& layout, InstanceIndex index, const world::Model& model) {
  for (const ModelLinkIndex link : model.links.indices())
    if (layout.links[layout.link_of(index, link)].body.valid()) return true;
  return false;
}

// A crowd's, or an <actor>: its path was made of its script, and stands where the model does.
bool is_person(const world::Model& model) {
  return model.path &&
         (model.path->name == "ruedo:crowd" || model.path->source.str() == model.source.str());
}

}  // namespace

bool TagsFilter::matches(const std::vector<std::string>& own) const {
  const auto has = [&](const std::string& tag) {
    return std::find(own.begin(), own.end(), tag) != own.end();
  };
  return tags.empty() || (mode == all ? std::all_of(tags.begin(), tags.end(), has)
                                      : std::any_of(tags.begin(), tags.end(), has));
}

TagsFilter read_tags(CdrReader& in) {
  TagsFilter filter;
  filter.tags = in.get_texts();
  filter.mode = in.get<uint8_t>();
  return filter;
}

EntityFilter::EntityFilter(CdrReader& in) {
  const std::string text = in.get_text();
  categories_ = in.get_sequence<uint8_t>();
  tags_ = read_tags(in);
  const auto type = in.get<uint8_t>();
  std::vector<Vec3> points(in.get_length(24));
  for (Vec3& point : points)
    for (double& x : point) x = in.get<double>();
  if (!in.good()) return;
  if (tags_.mode > TagsFilter::all) fault_ = {kFailed, "filter_mode is 0 (any) or 1 (all)"};
  take_bounds(type, points);
  take_expression(text);
}

EntityFilter::~EntityFilter() {
  if (compiled_) regfree(&expression_);
}

void EntityFilter::take_expression(const std::string& text) {
  if (text.empty()) return;
  // Repeats of repeats, and references backwards, take time and memory without end.
  if (text.find('\\') != std::string::npos || text.size() > kLongestFilter ||
      text.size() * copies(text) > kLongestWrittenOut) {
    fault_ = {
        kUnsupported,
        "the filter is too dear: it may have 200 characters, 500 with its repeats, and no \\"};
    return;
  }
  compiled_ = text.find('\0') == std::string::npos &&
              regcomp(&expression_, text.c_str(), REG_EXTENDED | REG_NOSUB) == 0;
  if (!compiled_) fault_ = {kFailed, "the filter is not a POSIX extended regular expression"};
}

void EntityFilter::take_bounds(uint8_t type, const std::vector<Vec3>& points) {
  enum : uint8_t { empty = 0, box = 1, sphere = 3 };
  const size_t wanted = type == empty ? 0 : 2;
  if (type != empty && type != box && type != sphere) {
    fault_ = {kUnsupported, "bounds of that type are not supported: there are box and sphere"};
  } else if (points.size() != wanted ||
             !std::all_of(points.begin(), points.end(),
                          [](const Vec3& point) { return point.allFinite(); })) {
    fault_ = {kFailed, "bounds have no points when empty, and two finite ones else"};
  } else if (type == box) {
    box_.emplace(points[0].cwiseMin(points[1]), points[0].cwiseMax(points[1]));
  } else if (type == sphere) {
    sphere_ = {points[0], points[1].x()};
    if (sphere_->radius < 0) fault_ = {kFailed, "the sphere's radius is negative"};
  }
}

bool EntityFilter::matches(const std::string& name, uint8_t category,
                           const std::vector<std::string>& tags) const {
  return (categories_.empty() ||
          std::find(categories_.begin(), categories_.end(), category) != categories_.end()) &&
         tags_.matches(tags) &&
         (!compiled_ || regexec(&expression_, name.c_str(), 0, nullptr, 0) == 0);
}

bool EntityFilter::overlaps(const std::optional<Box>& box, const Pose& X_WM) const {
  if (!box) return true;
  if (box_) return overlap(*box_, *box, X_WM);
  const Vec3 center = X_WM.inverse() * sphere_->center;
  return box->exteriorDistance(center) <= sphere_->radius;
}

void Entities::update(std::shared_ptr<const world::WorldModel> world) {
  world_ = std::move(world);
  std::map<std::string, Entity> before = std::exchange(entities_, {});
  if (!world_) return;
  const world::BodyLayout layout(*world_);
  for (const InstanceIndex i : world_->models.indices()) {
    const world::ModelInstance& instance = world_->models[i];
    if (instance.removed || instance.model->links.empty()) continue;
    const world::Model& model = *instance.model;
    Entity entity;
    entity.is_static = !moves(layout, i, model);
    entity.category = instance.is_robot() ? kRobot
                      : is_person(model)  ? kHuman
                      : entity.is_static  ? kStatic
                                          : kDynamic;
    entity.box = box_of(model);
    entity.X_ML = model.links[ModelLinkIndex(0)].X_ML;
    if (const auto known = before.find(instance.name);
        known != before.end() && known->second.is_said) {
      entity.category = known->second.category;
      entity.description = std::move(known->second.description);
      entity.tags = std::move(known->second.tags);
      entity.is_said = true;
    }
    entities_.emplace(instance.name, std::move(entity));
  }
  if (first_) return;
  first_.emplace();
  for (const auto& [name, entity] : entities_) first_->push_back(name);
}

const Entities::Entity* Entities::find(const std::string& name) const {
  const auto found = entities_.find(name);
  return found == entities_.end() ? nullptr : &found->second;
}

bool Entities::say(const std::string& name, uint8_t category, std::string description,
                   std::vector<std::string> tags) {
  const auto found = entities_.find(name);
  if (found == entities_.end()) return false;
  Entity& entity = found->second;
  entity.category = category;
  entity.description = std::move(description);
  entity.tags = std::move(tags);
  return entity.is_said = true;
}

std::vector<std::string> Entities::matching(const EntityFilter& filter) const {
  std::vector<std::string> names;
  for (const auto& [name, entity] : entities_)
    if (filter.matches(name, entity.category, entity.tags)) names.push_back(name);
  return names;
}

std::vector<std::string> Entities::spawned() const {
  std::vector<std::string> names;
  for (const auto& [name, entity] : entities_)
    if (!std::binary_search(first_->begin(), first_->end(), name)) names.push_back(name);
  return names;
}

}  // namespace ruedo::ros2
