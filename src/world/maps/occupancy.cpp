// Cuts a world at a height, and turns grids into walls.
#include "world/maps/occupancy.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "base/progress.h"
#include "base/text.h"
#include "base/whole.h"
#include "ruedo/math.h"
#include "world/model/bounds.h"
#include "world/model/convex.h"
#include "world/model/height_grid.h"
#include "world/read/read_context.h"

namespace ruedo::world {
namespace {

constexpr double kMargin_m = 1;
constexpr double kMostCells = 1e8;
constexpr double kShrunk = 1e-3;  // of a cell, at each side: touching a cell does not occupy it

using Box = Eigen::AlignedBox3d;

// One convex thing that the plane may cut: a shape, or a triangle of a mesh.
struct Piece {
  Convex shape;
  Box box;
};

Box placed(const Box& box, const Pose& X_WG) {
  Box result;
  for (int corner = 0; corner < 8; ++corner)
    result.extend(X_WG * box.corner(static_cast<Box::CornerType>(corner)));
  return result;
}

class Cut {
 public:
  Cut(const WorldModel& world, double height) : height_(height) {
    for (const ModelInstance& instance : world.models) {
      if (instance.removed || instance.is_robot() || instance.model->path) continue;
      for (const Link& link : instance.model->links) {
        for (const Collision& c : link.collisions)
          add(c.geometry, instance.X_WM * link.X_ML * c.X_LC);
      }
    }
  }

  Box bounds() const { return bounds_; }

  void draw(OccupancyGrid& grid) const {
    Progress progress("drawing the map",
                      static_cast<int64_t>(shapes_.size() + triangles_.size() + planes_.size()));
    int64_t done = 0;
    for (const auto& [shape, box] : shapes_) {
      mark(shape, box, grid);
      progress.to(++done);
    }
    for (const auto& t : triangles_) {
      Box box;
      for (const Vec3& corner : t) box.extend(corner);
      mark({nullptr, {}, t}, box, grid);
      progress.to(++done);
    }
    for (const auto& plane : planes_) {
      for_each_cell(bounds_of(grid), grid, [&](Cell& cell, const std::array<Vec3, 4>& square) {
        for (const Vec3& corner : square) {
          if (plane.first.dot(corner - plane.second) < 0) cell = Cell::occupied;
        }
      });
    }
  }

 private:
  void add(const Geometry& g, const Pose& X_WG) {
    if (g.shape == Shape::plane) {
      planes_.emplace_back(X_WG.rotation * g.normal, X_WG.translation);
      return;
    }
    const Box box = placed(world::bounds(g), X_WG);
    if (box.isEmpty() || height_ < box.min().z() || height_ > box.max().z()) return;
    bounds_.extend(box);
    if (g.shape != Shape::mesh) {
      shapes_.push_back({{&g, X_WG, {}}, box});
      return;
    }
    for_each_triangle(*g.mesh, [&](const std::array<Eigen::Vector3f, 3>& own) {
      std::array<Vec3, 3> corners;
      for (size_t k = 0; k < 3; ++k)
        corners[k] = X_WG * g.scale.cwiseProduct(own[k].cast<double>());
      const auto [low, high] = std::minmax({corners[0].z(), corners[1].z(), corners[2].z()});
      if (low <= height_ && height_ <= high) triangles_.push_back(corners);
    });
  }

  Box bounds_of(const OccupancyGrid& grid) const {
    return {Vec3(grid.x, grid.y, height_), Vec3(grid.x + grid.width * grid.resolution,
                                                grid.y + grid.height * grid.resolution, height_)};
  }

  template <class Visit>
  void for_each_cell(const Box& box, OccupancyGrid& grid, Visit visit) const {
    const auto index = [&](double at, double from, int most) {
      return rounded_down<int>(std::clamp((at - from) / grid.resolution, 0.0, most - 1.0));
    };
    const double gap = kShrunk * grid.resolution, side = grid.resolution - gap;
    const int column1 = index(box.max().x(), grid.x, grid.width),
              row1 = index(box.max().y(), grid.y, grid.height);
    for (int row = index(box.min().y(), grid.y, grid.height); row <= row1; ++row) {
      for (int column = index(box.min().x(), grid.x, grid.width); column <= column1; ++column) {
        Cell& cell = grid.at(column, row);
        if (cell == Cell::occupied) continue;
        const double x = grid.x + column * grid.resolution, y = grid.y + row * grid.resolution;
        visit(cell, std::array<Vec3, 4>{
                        Vec3(x + gap, y + gap, height_), Vec3(x + side, y + gap, height_),
                        Vec3(x + gap, y + side, height_), Vec3(x + side, y + side, height_)});
      }
    }
  }

  void mark(const Convex& shape, const Box& box, OccupancyGrid& grid) const {
    for_each_cell(box, grid, [&](Cell& cell, const std::array<Vec3, 4>& square) {
      if (overlap(shape, {nullptr, {}, square})) cell = Cell::occupied;
    });
  }

  double height_;
  Box bounds_;
  std::vector<Piece> shapes_;
  std::vector<std::array<Vec3, 3>> triangles_;
  std::vector<std::pair<Vec3, Vec3>> planes_;  // normal, point
};

}  // namespace

OccupancyGrid occupancy_of(const WorldModel& world, double resolution, double height,
                           const Rect* within) {
  const Cut cut(world, height);
  Box box = cut.bounds();
  if (within) {
    box.extend(Vec3(within->low.x(), within->low.y(), height));
    box.extend(Vec3(within->high.x(), within->high.y(), height));
    box = box.intersection(Box(Vec3(within->low.x(), within->low.y(), box.min().z()),
                               Vec3(within->high.x(), within->high.y(), box.max().z())));
  }
  if (box.isEmpty()) box.extend(Vec3::Zero());
  OccupancyGrid grid;
  grid.resolution = resolution;
  // Aligned to whole cells from the world's origin, so that maps of one world line up.
  const double x0 = std::floor((box.min().x() - kMargin_m) / resolution),
               x1 = std::ceil((box.max().x() + kMargin_m) / resolution);
  const double y0 = std::floor((box.min().y() - kMargin_m) / resolution),
               y1 = std::ceil((box.max().y() + kMargin_m) / resolution);
  if (!((x1 - x0) * (y1 - y0) <= kMostCells)) {
    throw InputError({world.file, 0},
                     "a map of " + shown(x1 - x0) + " x " + shown(y1 - y0) +
                         " cells; allowed are 100 million: a larger --resolution helps");
  }
  grid.width = static_cast<int>(x1 - x0);
  grid.height = static_cast<int>(y1 - y0);
  grid.x = x0 * resolution;
  grid.y = y0 * resolution;
  grid.cells.assign(static_cast<size_t>(grid.width) * static_cast<size_t>(grid.height), Cell::free);
  cut.draw(grid);
  return grid;
}

void mark_outside(const WorldModel& world, OccupancyGrid& grid) {
  std::vector<std::pair<int, int>> next;
  const auto mark = [&](int column, int row) {
    if (column < 0 || row < 0 || column >= grid.width || row >= grid.height) return;
    Cell& cell = grid.at(column, row);
    if (std::exchange(cell, cell == Cell::free ? Cell::unknown : cell) == Cell::free)
      next.emplace_back(column, row);
  };
  const std::vector<Cell> before = grid.cells;
  for (int column = 0; column < grid.width; ++column)
    for (const int row : {0, grid.height - 1}) mark(column, row);
  for (int row = 0; row < grid.height; ++row)
    for (const int column : {0, grid.width - 1}) mark(column, row);
  while (!next.empty()) {
    const auto [column, row] = next.back();
    next.pop_back();
    mark(column - 1, row);
    mark(column + 1, row);
    mark(column, row - 1);
    mark(column, row + 1);
  }
  bool inside = false, outside = false;
  for (const ModelInstance& robot : world.models) {
    if (robot.removed || !robot.is_robot()) continue;
    const double column = std::floor((robot.X_WM.translation.x() - grid.x) / grid.resolution),
                 row = std::floor((robot.X_WM.translation.y() - grid.y) / grid.resolution);
    if (!(column >= 0 && row >= 0 && column < grid.width && row < grid.height)) continue;
    const Cell cell = grid.at(rounded_down<int>(column), rounded_down<int>(row));
    inside |= cell == Cell::free;
    outside |= cell == Cell::unknown;
  }
  if (outside || !inside) grid.cells = before;
}

std::vector<WallPiece> walls_of(const OccupancyGrid& grid) {
  std::vector<WallPiece> walls;
  std::vector<bool> done(grid.cells.size());
  const auto open = [&](int column, int row) {
    return grid.at(column, row) == Cell::occupied &&
           !done[static_cast<size_t>(row) * static_cast<size_t>(grid.width) +
                 static_cast<size_t>(column)];
  };
  const double cosine = math::cos(grid.yaw), sine = math::sin(grid.yaw);
  Progress progress("finding walls", grid.height);
  for (int row = 0; row < grid.height; ++row) {
    progress.to(row);
    for (int column = 0; column < grid.width; ++column) {
      if (!open(column, row)) continue;
      int right = column, top = row;
      while (right + 1 < grid.width && open(right + 1, row)) ++right;
      const auto row_is_open = [&](int r) {
        for (int c = column; c <= right; ++c) {
          if (!open(c, r)) return false;
        }
        return true;
      };
      while (top + 1 < grid.height && row_is_open(top + 1)) ++top;
      for (int r = row; r <= top; ++r) {
        for (int c = column; c <= right; ++c)
          done[static_cast<size_t>(r) * static_cast<size_t>(grid.width) + static_cast<size_t>(c)] =
              true;
      }
      if (walls.size() == kMostWalls) {
        throw std::runtime_error("the map has more than " + std::to_string(kMostWalls) +
                                 " walls; a coarser picture, or one without speckles, has fewer");
      }
      const double x = (column + right + 1) * grid.resolution / 2,
                   y = (row + top + 1) * grid.resolution / 2;
      walls.push_back({grid.x + cosine * x - sine * y, grid.y + sine * x + cosine * y, grid.yaw,
                       (right - column + 1) * grid.resolution, (top - row + 1) * grid.resolution});
    }
  }
  return walls;
}

std::string world_of_walls(const std::string& name, const std::vector<WallPiece>& walls,
                           double height) {
  // Rounded to a micrometre: 0.15000000000000002 is no more exact.
  const auto number = [](double v) { return shown(std::round(v * 1e6) / 1e6 + 0.0); };
  std::string plain;
  for (const char c : name) plain += c == '<' || c == '&' || c == '"' ? '_' : c;
  std::string sdf =
      "<?xml version=\"1.0\"?>\n<sdf version=\"1.9\">\n  <world name=\"" + plain +
      "\">\n    <include><uri>model://sun</uri></include>\n    "
      "<include><uri>model://ground_plane</uri></include>\n"
      "    <model name=\"walls\">\n      <static>true</static>\n      <link name=\"link\">\n";
  for (size_t i = 0; i < walls.size(); ++i) {
    const WallPiece& w = walls[i];
    const std::string inside = "<pose>" + number(w.x) + " " + number(w.y) + " " +
                               number(height / 2) + " 0 0 " + number(w.yaw) +
                               "</pose><geometry><box><size>" + number(w.length) + " " +
                               number(w.width) + " " + number(height) + "</size></box></geometry>";
    const std::string label = "wall_" + std::to_string(i + 1);
    sdf += "        <collision name=\"" + label + "\">" + inside +
           "</collision>\n        <visual name=\"" + label + "\">" + inside +
           "<material><ambient>0.8 0.78 0.72 1</ambient><diffuse>0.8 0.78 0.72 "
           "1</diffuse></material></visual>\n";
  }
  return sdf + "      </link>\n    </model>\n  </world>\n</sdf>\n";
}

}  // namespace ruedo::world
