// A ray descends from the whole map to the blocks, and from these to the cells, whose box it meets,
// the nearer first, and ends behind its nearest hit. The boxes are those of the map's own frame;
// the triangles are tested in frame F, as those of a mesh.
#include "scene/rays/ray_grid.h"

#include <algorithm>
#include <bit>

namespace ruedo::scene {

using world::HeightGrid;

struct RayGrid::Walk {
  const Vec3& o_F;
  const Shear& shear;
  Vec3 o, d;  // in the map's frame
  double t_max;
  double margin;  // boxes are enlarged by it: rounding
  bool rows_fall, columns_fall;
  ShapeHit hit{kNoHit, std::numeric_limits<int>::max()};

  // Whether the ray passes a box before its nearest hit, and where.
  bool meets(Box box, double& enter, double& exit) const {
    box.grow(margin);
    enter = 0.0;
    exit = std::min(t_max, hit.t) + margin;
    return box.clip(o, d, enter, exit);
  }
  bool narrow_to_y(double low, double high, double& from, double& to) const {
    low -= margin;
    high += margin;
    if (d.y() == 0.0) return o.y() >= low && o.y() <= high;
    const double a = (low - o.y()) / d.y(), b = (high - o.y()) / d.y();
    from = std::max(from, std::min(a, b));
    to = std::min(to, std::max(a, b));
    return from <= to;
  }
  // The coordinates that the ray passes on its way.
  std::pair<double, double> passed(int axis, double from, double to) const {
    const auto [low, high] = std::minmax({o[axis] + from * d[axis], o[axis] + to * d[axis]});
    return {low - margin, high + margin};
  }
  // Keeps the nearer hit; among equals that of the lower triangle.
  void offer(double t, int triangle) {
    if (t == kNoHit || t > t_max) return;
    if (t < hit.t || (t == hit.t && triangle < hit.feature)) hit = {t, triangle};
  }
};

RayGrid::RayGrid(std::shared_ptr<const HeightGrid> grid, const Pose& X_FG)
    : grid_(std::move(grid)),
      rotation_(X_FG.rotation.toRotationMatrix()),
      translation_(X_FG.translation) {
  const Box own =
      box_of(0, grid_->rows() - 1, 0, grid_->columns() - 1, {grid_->lowest(), grid_->highest()});
  for (int i = 0; i < 8; ++i) {
    const Vec3 corner((i & 1 ? own.lower : own.upper).x(), (i & 2 ? own.lower : own.upper).y(),
                      (i & 4 ? own.lower : own.upper).z());
    box_.add(rotation_ * corner + translation_);
  }
  box_.grow(box_.margin());
  reach_ = std::max({box_.lower.cwiseAbs().maxCoeff(), box_.upper.cwiseAbs().maxCoeff(),
                     own.lower.cwiseAbs().maxCoeff(), own.upper.cwiseAbs().maxCoeff()});
}

Box RayGrid::box_of(size_t row, size_t row_end, size_t column, size_t column_end,
                    const HeightGrid::Range& heights) const {
  return {Vec3(grid_->x(column), grid_->y(row_end), heights.low),
          Vec3(grid_->x(column_end), grid_->y(row), heights.high)};
}

std::array<Vec3, 4> RayGrid::cell(size_t row, size_t column) const {
  std::array<Vec3, 4> corners;
  for (size_t i = 0; i < 4; ++i)
    corners[i] =
        rotation_ * grid_->vertex(row + i / 2, column + i % 2).cast<double>() + translation_;
  return corners;
}

void RayGrid::test_cell(size_t row, size_t column, Walk& walk) const {
  const auto [a, b, c, d] = cell(row, column);
  const int first = static_cast<int>(2 * (row * (grid_->columns() - 1) + column));
  walk.offer(SeenTriangle(a, c, b, walk.o_F, walk.shear).hit(walk.shear), first);
  walk.offer(SeenTriangle(b, c, d, walk.o_F, walk.shear).hit(walk.shear), first + 1);
}

// Of a block of the finest level, whose box the ray passes in [enter, exit]: row by row, the cells
// within the part of the ray over the row.
void RayGrid::walk_cells(size_t block_row, size_t block_column, double enter, double exit,
                         Walk& walk) const {
  constexpr size_t kBlock = HeightGrid::kBlock;
  const HeightGrid& grid = *grid_;
  const size_t row0 = block_row * kBlock, column0 = block_column * kBlock,
               row_end = std::min(row0 + kBlock, grid.rows() - 1),
               column_end = std::min(column0 + kBlock, grid.columns() - 1);
  for (size_t row = row0; row < row_end; ++row) {
    double from = enter, to = exit;
    if (!walk.narrow_to_y(grid.y(row + 1), grid.y(row), from, to)) continue;
    const auto [x_low, x_high] = walk.passed(0, from, to);
    const auto [z_low, z_high] = walk.passed(2, from, to);
    for (size_t column = column0; column < column_end; ++column) {
      if (grid.x(column + 1) < x_low || grid.x(column) > x_high) continue;
      const auto [low, high] = std::minmax({grid.z(row, column), grid.z(row, column + 1),
                                            grid.z(row + 1, column), grid.z(row + 1, column + 1)});
      if (high >= z_low && low <= z_high) test_cell(row, column, walk);
    }
  }
}

void RayGrid::walk_block(size_t level, size_t row, size_t column, Walk& walk) const {
  const HeightGrid::Level& blocks = grid_->levels()[level];
  const size_t cells = HeightGrid::kBlock << level;
  const Box box =
      box_of(row * cells, std::min((row + 1) * cells, grid_->rows() - 1), column * cells,
             std::min((column + 1) * cells, grid_->columns() - 1), blocks.at(row, column));
  double enter, exit;
  if (!walk.meets(box, enter, exit)) return;
  if (level == 0) return walk_cells(row, column, enter, exit, walk);
  const HeightGrid::Level& below = grid_->levels()[level - 1];
  for (size_t i = 0; i < 4; ++i) {
    const size_t r = 2 * row + ((i / 2 == 1) != walk.rows_fall),
                 c = 2 * column + ((i % 2 == 1) != walk.columns_fall);
    if (r < below.rows && c < below.columns) walk_block(level - 1, r, c, walk);
  }
}

void RayGrid::intersect(unsigned lanes, const FrameRays& rays, const double* t_max,
                        ShapeHit* hits) const {
  for (unsigned rest = lanes; rest != 0; rest &= rest - 1) {
    const int lane = std::countr_zero(rest);
    const Vec3 &o = rays.o[lane], &d = rays.d[lane];
    Walk walk{o,
              rays.shear[lane],
              rotation_.transpose() * (o - translation_),
              rotation_.transpose() * d,
              t_max[lane],
              1e-9 + 1e-13 * std::max(reach_, o.cwiseAbs().maxCoeff()),
              false,
              false};
    walk.rows_fall = walk.d.y() > 0.0;  // y falls with the row
    walk.columns_fall = walk.d.x() < 0.0;
    walk_block(grid_->levels().size() - 1, 0, 0, walk);
    hits[lane] = walk.hit;
  }
}

Vec3 RayGrid::normal(int triangle) const {
  const size_t index = static_cast<size_t>(triangle) / 2, columns = grid_->columns() - 1;
  const auto [a, b, c, d] = cell(index / columns, index % columns);
  return triangle % 2 == 0 ? (c - a).cross(b - a).normalized() : (c - b).cross(d - b).normalized();
}

}  // namespace ruedo::scene
