// Occupancy maps: look-up, distances and rays.
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "ruedo/client_map.h"

namespace ruedo::client {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr int8_t kOccupied = 100;

}  // namespace

Map::Map(std::vector<int8_t> cells, size_t columns, double resolution, const Origin& origin)
    : cells_(std::move(cells)), columns_(columns), resolution_(resolution), origin_(origin) {
  if (columns == 0 || cells_.size() % columns != 0)
    throw std::invalid_argument("cells: they must be whole rows of columns cells");
  if (!(resolution > 0.0)) throw std::invalid_argument("resolution: it must be above 0 m");
}

void Map::to_cells(double x, double y, double& column, double& row) const {
  const double across = x - origin_.x, up = y - origin_.y;
  const double cosine = std::cos(origin_.heading), sine = std::sin(origin_.heading);
  column = (cosine * across + sine * up) / resolution_;
  row = (cosine * up - sine * across) / resolution_;
}

bool Map::inside(int64_t column, int64_t row) const {
  return column >= 0 && row >= 0 && column < static_cast<int64_t>(columns_) &&
         row < static_cast<int64_t>(rows());
}

int Map::at(double x, double y) const {
  double column = 0.0, row = 0.0;
  to_cells(x, y, column, row);
  const double columns = static_cast<double>(columns_), rows = static_cast<double>(this->rows());
  if (!(column >= 0.0 && row >= 0.0 && column < columns && row < rows)) return -1;
  return cells_[static_cast<size_t>(row) * columns_ + static_cast<size_t>(column)];
}

std::vector<double> Map::distance_field() const {
  const size_t count = rows();
  std::vector<double> along(cells_.size(), kInfinite), nearest(cells_.size(), kInfinite);
  for (size_t row = 0; row < count; ++row) {
    double* const of_row = &along[row * columns_];
    for (size_t i = 0; i < columns_; ++i) {
      if (cells_[row * columns_ + i] == kOccupied) of_row[i] = 0.0;
      if (i > 0) of_row[i] = std::min(of_row[i], of_row[i - 1] + 1.0);
    }
    for (size_t i = columns_ - 1; i-- > 0;) of_row[i] = std::min(of_row[i], of_row[i + 1] + 1.0);
  }
  for (size_t i = 0; i < columns_; ++i) {
    for (size_t row = 0; row < count; ++row) {
      double& best = nearest[row * columns_ + i];
      for (size_t other = 0; other < count; ++other) {
        const double up = static_cast<double>(row) - static_cast<double>(other);
        const double beside = along[other * columns_ + i];
        best = std::min(best, up * up + beside * beside);
      }
      best = std::sqrt(best) * resolution_;
    }
  }
  return nearest;
}

Map Map::inflated(double radius) const {
  const std::vector<double> away = distance_field();
  std::vector<int8_t> cells = cells_;
  for (size_t i = 0; i < cells.size(); ++i) {
    if (away[i] <= radius + 1e-9) cells[i] = kOccupied;
  }
  return {std::move(cells), columns_, resolution_, origin_};
}

double Map::ray(double x, double y, double angle, double max_range) const {
  double start[2], way[2] = {std::cos(angle - origin_.heading), std::sin(angle - origin_.heading)};
  to_cells(x, y, start[0], start[1]);
  int64_t cell[2], step[2];
  double per_cell[2], to_border[2], gone = 0.0;
  for (int i = 0; i < 2; ++i) {
    cell[i] = static_cast<int64_t>(std::floor(start[i]));
    step[i] = way[i] > 0.0 ? 1 : way[i] < 0.0 ? -1 : 0;
    per_cell[i] = std::abs(1.0 / way[i]);
    const double left = static_cast<double>(cell[i]) + (step[i] > 0 ? 1.0 : 0.0) - start[i];
    to_border[i] = step[i] == 0 ? kInfinite : std::abs(left) * per_cell[i];
  }
  const int64_t sizes[2] = {static_cast<int64_t>(columns_), static_cast<int64_t>(rows())};
  while (gone <= max_range / resolution_) {
    if (inside(cell[0], cell[1]) &&
        cells_[static_cast<size_t>(cell[1]) * columns_ + static_cast<size_t>(cell[0])] == kOccupied)
      return gone * resolution_;
    for (int i = 0; i < 2; ++i) {
      if ((cell[i] < 0 && step[i] <= 0) || (cell[i] >= sizes[i] && step[i] >= 0)) return kInfinite;
    }
    const int axis = to_border[0] <= to_border[1] ? 0 : 1;
    gone = to_border[axis];
    cell[axis] += step[axis];
    to_border[axis] += per_cell[axis];
  }
  return kInfinite;
}

}  // namespace ruedo::client
