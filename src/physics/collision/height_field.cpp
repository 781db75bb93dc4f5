#include "physics/collision/height_field.h"

#include <algorithm>

#include <LinearMath/btAabbUtil2.h>

namespace ruedo::physics {

// Of the two triangles of a cell, the first has the sides left, diagonal, top, the second diagonal,
// bottom, right: see world::HeightGrid.
int HeightEdges::neighbour(int triangle, size_t edge) const {
  const int columns = static_cast<int>(grid_->columns()) - 1,
            rows = static_cast<int>(grid_->rows()) - 1;
  const int cell = triangle / 2, row = cell / columns, column = cell % columns;
  if (triangle % 2 == 0) {
    if (edge == 1) return triangle + 1;
    if (edge == 0) return column > 0 ? triangle - 1 : kNone;
    return row > 0 ? triangle - 2 * columns + 1 : kNone;
  }
  if (edge == 0) return triangle - 1;
  if (edge == 1) return row + 1 < rows ? triangle + 2 * columns - 1 : kNone;
  return column + 1 < columns ? triangle + 1 : kNone;
}

bool HeightEdges::any_around(uint32_t vertex, const std::function<bool(uint32_t)>& found) const {
  const auto columns = static_cast<uint32_t>(grid_->columns());
  const uint32_t row = vertex / columns, column = vertex % columns;
  const bool up = row > 0, left = column > 0, right = column + 1 < columns,
             down = row + 1 < grid_->rows();
  return (up && found(vertex - columns)) || (up && right && found(vertex - columns + 1)) ||
         (left && found(vertex - 1)) || (right && found(vertex + 1)) ||
         (down && left && found(vertex + columns - 1)) || (down && found(vertex + columns));
}

HeightField::HeightField(std::shared_ptr<const world::HeightGrid> grid) : edges_(std::move(grid)) {
  const world::HeightGrid& heights = edges_.grid();
  m_shapeType = TERRAIN_SHAPE_PROXYTYPE;
  low_ = {heights.x(0), heights.y(heights.rows() - 1), heights.lowest()};
  high_ = {heights.x(heights.columns() - 1), heights.y(0), heights.highest()};
  setMargin(0.0);
  setUserPointer(static_cast<MeshEdges*>(&edges_));
}

void HeightField::getAabb(const btTransform& X, btVector3& low, btVector3& high) const {
  btTransformAabb(low_, high_, getMargin(), X, low, high);
}

void HeightField::processAllTriangles(btTriangleCallback* callback, const btVector3& low,
                                      const btVector3& high) const {
  const world::HeightGrid& heights = edges_.grid();
  const world::HeightGrid::Cells cells = heights.cells(low.x(), high.x(), low.y(), high.y());
  const size_t columns = heights.columns() - 1;
  const auto corner = [&](size_t row, size_t column) {
    return btVector3(heights.x(column), heights.y(row), heights.z(row, column));
  };
  for (size_t row = cells.row; row < cells.row_end; ++row) {
    for (size_t column = cells.column; column < cells.column_end; ++column) {
      const auto [bottom, top] =
          std::minmax({heights.z(row, column), heights.z(row, column + 1),
                       heights.z(row + 1, column), heights.z(row + 1, column + 1)});
      if (bottom > high.z() || top < low.z()) continue;
      const btVector3 a = corner(row, column), b = corner(row, column + 1),
                      c = corner(row + 1, column), d = corner(row + 1, column + 1);
      const int first = static_cast<int>(2 * (row * columns + column));
      btVector3 upper[] = {a, c, b}, lower[] = {b, c, d};
      callback->processTriangle(upper, 0, first);
      callback->processTriangle(lower, 0, first + 1);
    }
  }
}

}  // namespace ruedo::physics
