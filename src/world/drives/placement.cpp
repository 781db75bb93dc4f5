// Heights from vertical lines through static collisions; free space by GJK against nearby
// collisions.
#include "world/drives/placement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <optional>
#include <unordered_map>
#include <vector>

#include "base/text.h"
#include "base/whole.h"
#include "ruedo/math.h"
#include "world/model/bounds.h"
#include "world/model/convex.h"
#include "world/model/height_grid.h"
#include "world/read/read_context.h"

namespace ruedo::world {
namespace {

// up to this height above the lowest surface, a surface counts as ground
constexpr double kStep_m = 0.5;
constexpr double kClearance_m = 0.02;  // how deep a model may sink into bumps of the ground
constexpr double kSteepest = 0.7;      // the steepest ground that models are put on: 35 degrees
constexpr double kBump_m = 0.05;       // how far the ground under a model may differ from a plane
constexpr double kFar_m = 1e5;
constexpr double kCell_m = 2;       // of the grid over what stands in the world
constexpr int64_t kMostCells = 64;  // a thing that covers more is kept in a list of its own

using Box = Eigen::AlignedBox3d;

// The bounding box of a shape at a pose.
Box placed(const Box& box, const Pose& X_WG) {
  Box result;
  if (box.isEmpty()) return result;
  for (int corner = 0; corner < 8; ++corner)
    result.extend(X_WG * box.corner(static_cast<Box::CornerType>(corner)));
  return result;
}

// Where the vertical line through (x, y) meets a triangle.
std::optional<double> height_of(const std::array<Vec3, 3>& t, double x, double y) {
  const Vec3 ab = t[1] - t[0], ac = t[2] - t[0];
  const double area = ab.x() * ac.y() - ab.y() * ac.x();
  if (std::abs(area) < 1e-15) return std::nullopt;  // vertical
  const double dx = x - t[0].x(), dy = y - t[0].y();
  const double u = (dx * ac.y() - dy * ac.x()) / area, v = (ab.x() * dy - ab.y() * dx) / area;
  if (u < -1e-9 || v < -1e-9 || u + v > 1 + 1e-9) return std::nullopt;
  return t[0].z() + u * ab.z() + v * ac.z();
}

// The top of a convex shape at (x, y): the highest z at which a thin vertical needle from far above
// meets it, by bisection.
std::optional<double> top_of(const Convex& shape, const Box& box, double x, double y) {
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

// A rectangle of a grid's cells, both ends included.
struct Cells {
  int64_t x0, x1, y0, y1;

  int64_t count() const { return (x1 - x0 + 1) * (y1 - y0 + 1); }

  template <class Visit>
  void for_each(Visit visit) const {
    for (int64_t y = y0; y <= y1; ++y) {
      for (int64_t x = x0; x <= x1; ++x) visit(x, y);
    }
  }
};

// The triangles of a mesh, by the column of the world in which they are. A height map has them so.
class TriangleGrid {
 public:
  TriangleGrid(const Geometry& g, const Pose& X_WG) : heights_(grid_of(*g.mesh)), X_WG_(X_WG) {
    if (heights_) return;
    std::vector<Vec3> points;
    points.reserve(g.mesh->positions.size());
    for (const auto& p : g.mesh->positions) {
      points.push_back(X_WG * g.scale.cwiseProduct(p.cast<double>()));
      box_.extend(points.back());
    }
    side_ = std::max(1, whole<int>(std::sqrt(static_cast<double>(g.mesh->triangles.size()) / 2)));
    side_ = std::min(side_, 512);
    cells_.resize(static_cast<size_t>(side_) * static_cast<size_t>(side_));
    for (const auto& t : g.mesh->triangles) {
      triangles_.push_back({points[t[0]], points[t[1]], points[t[2]]});
      Box around;
      for (const Vec3& corner : triangles_.back()) around.extend(corner);
      const uint32_t index = static_cast<uint32_t>(triangles_.size() - 1);
      if (const Cells covered = cells_of(around); covered.count() > kMostCells) {
        large_.push_back(index);
      } else {
        covered.for_each([&](int64_t x, int64_t y) { cells_[y * side_ + x].push_back(index); });
      }
    }
  }

  // Visits every triangle whose box may meet that box, some more than once, until `visit` returns
  // true.
  template <class Visit>
  bool any(const Box& box, Visit visit) {
    if (heights_) return any_height(box, visit);
    bool found = false;
    const auto visit_each = [&](const std::vector<uint32_t>& some) {
      for (size_t i = 0; i < some.size() && !found; ++i) found = visit(triangles_[some[i]]);
    };
    visit_each(large_);
    cells_of(box).for_each([&](int64_t x, int64_t y) { visit_each(cells_[y * side_ + x]); });
    return found;
  }

 private:
  template <class Visit>
  bool any_height(const Box& box, Visit visit) {
    const Box box_G = placed(box, X_WG_.inverse());
    const HeightGrid::Cells cells =
        heights_->cells(box_G.min().x(), box_G.max().x(), box_G.min().y(), box_G.max().y());
    for (size_t row = cells.row; row < cells.row_end; ++row) {
      for (size_t column = cells.column; column < cells.column_end; ++column) {
        const auto corner = [&](size_t down, size_t right) -> Vec3 {
          return X_WG_ * Vec3(heights_->vertex(row + down, column + right).cast<double>());
        };
        const Vec3 a = corner(0, 0), b = corner(0, 1), c = corner(1, 0), d = corner(1, 1);
        if (visit(std::array{a, c, b}) || visit(std::array{b, c, d})) return true;
      }
    }
    return false;
  }
  Cells cells_of(const Box& box) const {
    const auto cell = [&](double at, int axis) {
      const double size = std::max(box_.sizes()[axis], 1e-9);
      return whole<int64_t>(std::clamp((at - box_.min()[axis]) / size * side_, 0.0, side_ - 1.0));
    };
    return {cell(box.min().x(), 0), cell(box.max().x(), 0), cell(box.min().y(), 1),
            cell(box.max().y(), 1)};
  }

  const HeightGrid* heights_;  // null: the triangles are below
  Pose X_WG_;
  Box box_;
  int side_ = 1;
  std::vector<std::array<Vec3, 3>> triangles_;
  std::vector<std::vector<uint32_t>> cells_;
  std::vector<uint32_t> large_;  // triangles that cover many cells
};

}  // namespace

struct Room::Index {
  struct Solid {
    const Geometry* geometry;
    Pose X_WG;
    Box box;
    int instance;  // index into instances
    bool is_static;
  };

  std::vector<std::pair<std::string, std::shared_ptr<const Model>>> instances;
  std::vector<Solid> solids;
  std::vector<int> planes, large;                        // indices into solids
  std::unordered_map<uint64_t, std::vector<int>> cells;  // what is found there is sorted
  std::unordered_map<const Geometry*, Box> boxes;        // looked up only
  std::map<int, TriangleGrid> triangles;                 // of the solids requested until now

  static int64_t cell_of(double at) { return rounded_down(std::clamp(at, -1e7, 1e7) / kCell_m); }
  static Cells cells_of(const Box& box) {
    return {cell_of(box.min().x()), cell_of(box.max().x()), cell_of(box.min().y()),
            cell_of(box.max().y())};
  }
  static uint64_t key(int64_t x, int64_t y) {
    return static_cast<uint64_t>(x) << 32 ^ (static_cast<uint64_t>(y) & 0xffffffffu);
  }

  const Box& box_of(const Geometry& g) {
    const auto [at, is_new] = boxes.try_emplace(&g);
    if (is_new) at->second = bounds(g);
    return at->second;
  }

  // The same for a model that may not outlive this index.
  Box known_box_of(const Geometry& g) const {
    const auto at = boxes.find(&g);
    return at == boxes.end() ? bounds(g) : at->second;
  }

  template <class PoseOf>
  void add(const std::string& name, const std::shared_ptr<const Model>& model, PoseOf X_WL) {
    instances.emplace_back(name, model);
    for (const ModelLinkIndex l : model->links.indices()) {
      const Pose X = X_WL(l);
      for (const Collision& c : model->links[l].collisions) {
        const Pose X_WG = X * c.X_LC;
        const int solid = static_cast<int>(solids.size());
        solids.push_back({&c.geometry, X_WG, placed(box_of(c.geometry), X_WG),
                          static_cast<int>(instances.size()) - 1, model->is_static});
        const Box& box = solids.back().box;
        if (c.geometry.shape == Shape::plane) {
          planes.push_back(solid);
        } else if (!box.isEmpty()) {
          if (const Cells covered = cells_of(box); covered.count() > kMostCells) {
            large.push_back(solid);
          } else {
            covered.for_each([&](int64_t x, int64_t y) { cells[key(x, y)].push_back(solid); });
          }
        }
      }
    }
  }

  // The solids whose boxes meet that box, without planes, in the order of the world.
  std::vector<int> near(const Box& box) const {
    std::vector<int> found = large;
    const auto take = [&](const std::vector<int>& some) {
      found.insert(found.end(), some.begin(), some.end());
    };
    if (const Cells covered = cells_of(box); covered.count() > static_cast<int64_t>(cells.size())) {
      for (const auto& cell : cells) take(cell.second);
    } else {
      covered.for_each([&](int64_t x, int64_t y) {
        if (const auto cell = cells.find(key(x, y)); cell != cells.end()) take(cell->second);
      });
    }
    std::erase_if(found, [&](int solid) { return !solids[solid].box.intersects(box); });
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    return found;
  }

  TriangleGrid& triangles_of(int solid) {
    const Solid& s = solids[solid];
    return triangles.try_emplace(solid, *s.geometry, s.X_WG).first->second;
  }

  // Whether a convex thing with that box overlaps a solid.
  bool meets(const Convex& thing, const Box& box, int solid) {
    const Solid& s = solids[solid];
    if (!s.box.intersects(box)) return false;
    if (s.geometry->shape != Shape::mesh) return overlap(thing, {s.geometry, s.X_WG, {}});
    return triangles_of(solid).any(box, [&](const std::array<Vec3, 3>& corners) {
      Box around;
      for (const Vec3& corner : corners) around.extend(corner);
      return around.intersects(box) && overlap(thing, {nullptr, {}, corners});
    });
  }

  // As Room::overlapped, of all models or of the static ones.
  std::string overlapped(const Model& model, const Pose& X_WM, bool of_static) {
    const Pose lifted{X_WM.rotation, X_WM.translation + Vec3(0, 0, kClearance_m)};
    struct Part {
      Convex shape;
      Box box;
    };
    std::vector<Part> parts;
    Box whole;
    for (const Link& link : model.links) {
      for (const Collision& c : link.collisions) {
        if (c.geometry.shape == Shape::plane) continue;
        const Pose X_WG = lifted * link.X_ML * c.X_LC;
        parts.push_back({{&c.geometry, X_WG, {}}, placed(known_box_of(c.geometry), X_WG)});
        whole.extend(parts.back().box);
      }
    }
    if (parts.empty()) return "";
    // Walls meet at corners: static models may overlap each other.
    const auto counts = [&](int solid) {
      const bool is_static = solids[solid].is_static;
      return of_static ? is_static : !(is_static && model.is_static);
    };
    const auto name = [&](int solid) { return instances[solids[solid].instance].first; };
    for (const int plane : planes) {
      const Solid& s = solids[plane];
      const Vec3 n = s.X_WG.rotation * s.geometry->normal;
      for (const Part& part : parts) {
        if (counts(plane) && n.dot(part.shape.support(-n) - s.X_WG.translation) < 0)
          return name(plane);
      }
    }
    for (const int solid : near(whole)) {
      for (const Part& part : parts) {
        if (counts(solid) && meets(part.shape, part.box, solid)) return name(solid);
      }
    }
    return "";
  }
};

Room::Room() : index_(std::make_unique<Index>()) {}
Room::~Room() = default;

Room::Room(const WorldModel& world, const LinkPose& now) : Room() {
  for (const InstanceIndex i : world.models.indices()) {
    const ModelInstance& instance = world.models[i];
    if (instance.removed) continue;
    index_->add(instance.name, instance.model, [&](ModelLinkIndex l) {
      return now ? now(i, l) : instance.X_WM * instance.model->links[l].X_ML;
    });
  }
}

void Room::add(const ModelInstance& instance) {
  index_->add(instance.name, instance.model,
              [&](ModelLinkIndex l) { return instance.X_WM * instance.model->links[l].X_ML; });
}

namespace {

// The lowest surface, and those that can be reached from it in steps.
double walkable(const std::vector<double>& heights) {
  const double lowest = *std::min_element(heights.begin(), heights.end());
  double ground = lowest;
  for (const double z : heights) {
    if (z <= lowest + kStep_m) ground = std::max(ground, z);
  }
  return ground;
}

}  // namespace

std::vector<double> Room::surfaces(double x, double y) const {
  std::vector<double> heights;
  for (const int plane : index_->planes) {
    const Index::Solid& s = index_->solids[plane];
    const Vec3 n = s.X_WG.rotation * s.geometry->normal;
    const Vec3& at = s.X_WG.translation;
    if (s.is_static && n.z() > 1e-6)
      heights.push_back(at.z() - (n.x() * (x - at.x()) + n.y() * (y - at.y())) / n.z());
  }
  const Box line(Vec3(x, y, -kFar_m), Vec3(x, y, kFar_m));
  for (const int solid : index_->near(line)) {
    const Index::Solid& s = index_->solids[solid];
    if (!s.is_static) continue;
    if (s.geometry->shape == Shape::mesh) {
      index_->triangles_of(solid).any(line, [&](const std::array<Vec3, 3>& corners) {
        if (const auto z = height_of(corners, x, y)) heights.push_back(*z);
        return false;
      });
    } else if (const auto z = top_of({s.geometry, s.X_WG, {}}, s.box, x, y)) {
      heights.push_back(*z);
    }
  }
  std::erase_if(heights, [](double z) { return !(std::abs(z) < kFar_m); });
  return heights;
}

double Room::ground_height(double x, double y, std::optional<double> near_z) const {
  const std::vector<double> heights = surfaces(x, y);
  std::vector<double> storey;
  std::copy_if(heights.begin(), heights.end(), std::back_inserter(storey),
               [&](double z) { return near_z && std::abs(z - *near_z) <= kStep_m; });
  if (!storey.empty()) return walkable(storey);
  return heights.empty() ? 0 : walkable(heights);
}

double Room::floor_height(double x, double y, double z) const {
  constexpr double kHips_m = 1.3,
                   kAbove_m = 0.25;  // skins have their origin at this height, or at the floor
  std::vector<double> heights = surfaces(x, y);
  std::erase_if(heights, [&](double at) { return at > z + kAbove_m || at < z - kHips_m; });
  if (!heights.empty()) return walkable(heights);
  return z > 0 && z <= kHips_m ? 0 : z;
}

// The ground under a model at its level pose, as a plane: z = c[0] + c[1] (x - x0) + c[2] (y - y0)
// about (x0, y0). nullopt: it is level, too steep, or not a plane.
std::optional<Pose> Room::on_slope(const Model& model, const Pose& X_WM, double lowest,
                                   std::optional<double> near_z) const {
  Box foot;
  for (const Link& link : model.links) {
    for (const Collision& c : link.collisions)
      foot.extend(placed(index_->known_box_of(c.geometry), link.X_ML * c.X_LC));
  }
  if (foot.isEmpty()) return std::nullopt;
  const Vec3 place(X_WM.translation.x(), X_WM.translation.y(), 0);
  constexpr int kSamples = 3;  // in each direction
  Eigen::Matrix<double, kSamples * kSamples, 3> A;
  Eigen::Matrix<double, kSamples * kSamples, 1> heights;
  for (int i = 0; i < kSamples * kSamples; ++i) {
    const int column = i % kSamples, row = i / kSamples;
    const Vec3 part(column / (kSamples - 1.0), row / (kSamples - 1.0), 0);
    const Vec3 at = X_WM.rotation * Vec3(foot.min() + part.cwiseProduct(foot.sizes()));
    A.row(i) << 1, at.x(), at.y();
    heights[i] = ground_height(place.x() + at.x(), place.y() + at.y(), near_z);
  }
  const Vec3 c = A.colPivHouseholderQr().solve(heights);
  const Eigen::Matrix<double, kSamples * kSamples, 1> bumps = heights - A * c;
  const double slope = math::hypot(c[1], c[2]);
  if (slope < 1e-6 || slope > kSteepest || bumps.cwiseAbs().maxCoeff() > kBump_m)
    return std::nullopt;
  const Vec3 up = Vec3(-c[1], -c[2], 1).normalized(), level_ahead = X_WM.rotation * Vec3::UnitX();
  const Vec3 ahead = (level_ahead + Vec3(0, 0, c[1] * level_ahead.x() + c[2] * level_ahead.y()))
                         .normalized();  // keeps the heading
  Eigen::Matrix3d axes;
  axes << ahead, up.cross(ahead), up;
  return Pose{Quat(axes), place + Vec3(0, 0, c[0]) + up * (bumps.maxCoeff() - lowest)};
}

Pose Room::standing_on(const Model& model, double x, double y, double yaw,
                       std::optional<double> near_z) const {
  Pose X_WM{Quat(Eigen::AngleAxisd(yaw, Vec3::UnitZ())), {x, y, 0}};
  double lowest = std::numeric_limits<double>::infinity();
  for (const Link& link : model.links) {
    for (const Collision& c : link.collisions) {
      if (c.geometry.shape == Shape::plane) continue;
      lowest = std::min(
          lowest, Convex{&c.geometry, X_WM * link.X_ML * c.X_LC, {}}.support(-Vec3::UnitZ()).z());
    }
  }
  // A drive knows better where the ground is than the shape of a wheel, which may be a little too
  // large or too small.
  if (model.drive) lowest = std::min(lowest, model.drive->X_MBase.translation.z());
  if (!std::isfinite(lowest)) lowest = 0;
  X_WM.translation.z() = ground_height(x, y, near_z) - lowest;
  if (index_->overlapped(model, X_WM, true).empty()) return X_WM;
  return on_slope(model, X_WM, lowest, near_z).value_or(X_WM);
}

std::string Room::overlapped(const Model& model, const Pose& X_WM) const {
  return index_->overlapped(model, X_WM, false);
}

double ground_height(const WorldModel& world, double x, double y) {
  return Room(world).ground_height(x, y);
}

Pose standing_on(const WorldModel& world, const Model& model, double x, double y, double yaw,
                 std::optional<double> near_z) {
  return Room(world).standing_on(model, x, y, yaw, near_z);
}

std::string overlapped(const WorldModel& world, const Model& model, const Pose& X_WM,
                       const LinkPose& now) {
  return Room(world, now).overlapped(model, X_WM);
}

void name_stuck_robots(const WorldModel& world, Findings& findings) {
  const auto may_be_stuck = [](const ModelInstance& instance) {
    return instance.is_robot() && !instance.model->is_static;
  };
  if (std::none_of(world.models.begin(), world.models.end(), may_be_stuck)) return;
  Room room;
  for (const ModelInstance& instance : world.models) {
    if (!may_be_stuck(instance)) room.add(instance);
  }
  for (const ModelInstance& instance : world.models) {
    if (!may_be_stuck(instance)) continue;
    if (const std::string other = room.overlapped(*instance.model, instance.X_WM); !other.empty()) {
      const Vec3& at = instance.X_WM.translation;
      findings.error(instance.model->source, "model " + instance.name,
                     "at the start, at " + shown(at.x()) + " " + shown(at.y()) + " " +
                         shown(at.z()) + " m, it stands in '" + other +
                         "', which will push it out; give it a <pose> with room");
    }
    room.add(instance);
  }
}

double footprint_radius(const Model& model) {
  const Pose X_BaseM = model.drive ? model.drive->X_MBase.inverse() : Pose{};
  double radius = 0;
  for (const Link& link : model.links) {
    for (const Collision& c : link.collisions) {
      const Box box = placed(bounds(c.geometry), X_BaseM * link.X_ML * c.X_LC);
      if (box.isEmpty()) continue;
      radius =
          std::max(radius, math::hypot(std::max(std::abs(box.min().x()), std::abs(box.max().x())),
                                       std::max(std::abs(box.min().y()), std::abs(box.max().y()))));
    }
  }
  return radius;
}

}  // namespace ruedo::world
