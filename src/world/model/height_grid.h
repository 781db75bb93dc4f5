// A height map: heights over a rectangle, and the surface over them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "world/model/mesh.h"

namespace ruedo::world {

// Each cell between four heights has two triangles, divided along the line from high x and y to low
// x and y. They are computed on demand: a map of 4097 x 4097 has 33 million, and a
// height takes four bytes.
class HeightGrid {
 public:
  // x of the columns, rising; y of the rows, falling, since a picture's first row is at its top; z
  // row by row. All in m, at least 2 x 2.
  HeightGrid(std::vector<float> x, std::vector<float> y, std::vector<float> z);

  size_t columns() const { return x_.size(); }
  size_t rows() const { return y_.size(); }
  float x(size_t column) const { return x_[column]; }
  float y(size_t row) const { return y_[row]; }
  float z(size_t row, size_t column) const { return z_[row * columns() + column]; }
  float lowest() const { return levels_.back().ranges[0].low; }
  float highest() const { return levels_.back().ranges[0].high; }

  size_t vertex_count() const { return z_.size(); }  // row by row
  Eigen::Vector3f vertex(size_t row, size_t column) const {
    return {x_[column], y_[row], z(row, column)};
  }
  Eigen::Vector3f vertex(size_t index) const {
    return vertex(index / columns(), index % columns());
  }

  // Row by row, two of each cell.
  size_t triangle_count() const { return 2 * (columns() - 1) * (rows() - 1); }
  std::array<uint32_t, 3> triangle(size_t index) const {
    const size_t cell = index / 2, row = cell / (columns() - 1), column = cell % (columns() - 1);
    const auto a = static_cast<uint32_t>(row * columns() + column),
               c = static_cast<uint32_t>(a + columns());
    if (index % 2 == 0) return {a, c, a + 1};
    return {a + 1, c, c + 1};
  }

  // Heights of blocks of cells. Those of level 0 have kBlock cells each way, those of a higher
  // level twice as many as the level below; the last level is one block.
  static constexpr size_t kBlock = 4;
  struct Range {
    float low, high;
  };
  struct Level {
    size_t columns, rows;
    std::vector<Range> ranges;  // row by row
    const Range& at(size_t row, size_t column) const { return ranges[row * columns + column]; }
  };
  const std::vector<Level>& levels() const { return levels_; }

  // The cells that a rectangle meets: from `row` and `column` up to, not including, the ends.
  struct Cells {
    size_t row, row_end, column, column_end;
  };
  Cells cells(double x_low, double x_high, double y_low, double y_high) const;

 private:
  std::vector<float> x_, y_, z_;
  std::vector<Level> levels_;
};

// A mesh whose vertices and triangles are those of a grid, in place of arrays. It has no scale.
struct HeightMap final : Mesh {
  std::shared_ptr<const HeightGrid> grid;
  Eigen::Vector2f tiles = Eigen::Vector2f::Ones();  // how often its texture fits in x and y
};
inline constexpr const char* kHeightMapPart = "heights";

// The height map that a mesh is; null: it has arrays.
inline const HeightMap* height_map(const Mesh& mesh) {
  const bool is =
      mesh.triangles.empty() && !mesh.parts.empty() && mesh.parts[0].name == kHeightMapPart;
  return is ? static_cast<const HeightMap*>(&mesh) : nullptr;
}
inline const HeightGrid* grid_of(const Mesh& mesh) {
  const HeightMap* map = height_map(mesh);
  return map ? map->grid.get() : nullptr;
}

// Of either.
inline size_t triangle_count(const Mesh& mesh) {
  const HeightGrid* grid = grid_of(mesh);
  return grid ? grid->triangle_count() : mesh.triangles.size();
}
template <class Visit>  // visit(position)
void for_each_vertex(const Mesh& mesh, Visit visit) {
  if (const HeightGrid* grid = grid_of(mesh)) {
    for (size_t row = 0; row < grid->rows(); ++row)
      for (size_t column = 0; column < grid->columns(); ++column) visit(grid->vertex(row, column));
  } else {
    for (const Eigen::Vector3f& position : mesh.positions) visit(position);
  }
}
template <class Visit>  // visit(the three corners)
void for_each_triangle(const Mesh& mesh, Visit visit) {
  using Corners = std::array<Eigen::Vector3f, 3>;
  if (const HeightGrid* grid = grid_of(mesh)) {
    for (size_t row = 0; row + 1 < grid->rows(); ++row) {
      for (size_t column = 0; column + 1 < grid->columns(); ++column) {
        const Eigen::Vector3f b = grid->vertex(row, column + 1), c = grid->vertex(row + 1, column);
        visit(Corners{grid->vertex(row, column), c, b});
        visit(Corners{b, c, grid->vertex(row + 1, column + 1)});
      }
    }
  } else {
    for (const auto& t : mesh.triangles)
      visit(Corners{mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]});
  }
}

}  // namespace ruedo::world
