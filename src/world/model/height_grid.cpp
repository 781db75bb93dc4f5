#include "world/model/height_grid.h"

#include <algorithm>
#include <functional>
#include <limits>

namespace ruedo::world {
namespace {

constexpr HeightGrid::Range kNone{std::numeric_limits<float>::infinity(),
                                  -std::numeric_limits<float>::infinity()};

void add(HeightGrid::Range& range, const HeightGrid::Range& other) {
  range.low = std::min(range.low, other.low);
  range.high = std::max(range.high, other.high);
}

HeightGrid::Level level_of(size_t rows, size_t columns) {
  return {columns, rows, std::vector<HeightGrid::Range>(rows * columns, kNone)};
}

}  // namespace

HeightGrid::HeightGrid(std::vector<float> x, std::vector<float> y, std::vector<float> z)
    : x_(std::move(x)), y_(std::move(y)), z_(std::move(z)) {
  const auto blocks = [](size_t heights) { return (heights - 2) / kBlock + 1; };
  levels_.push_back(level_of(blocks(rows()), blocks(columns())));
  Level& finest = levels_.back();
  for (size_t row = 0; row < finest.rows; ++row) {
    const size_t first_row = row * kBlock, last_row = std::min(first_row + kBlock, rows() - 1);
    for (size_t column = 0; column < finest.columns; ++column) {
      const size_t first = column * kBlock, last = std::min(first + kBlock, columns() - 1);
      Range& range = finest.ranges[row * finest.columns + column];
      for (size_t i = first_row; i <= last_row; ++i) {
        const float* heights = &z_[i * columns()];
        for (size_t k = first; k <= last; ++k) add(range, {heights[k], heights[k]});
      }
    }
  }
  while (levels_.back().ranges.size() > 1) {
    const Level& below = levels_.back();
    Level level = level_of((below.rows + 1) / 2, (below.columns + 1) / 2);
    for (size_t row = 0; row < below.rows; ++row) {
      for (size_t column = 0; column < below.columns; ++column)
        add(level.ranges[row / 2 * level.columns + column / 2], below.at(row, column));
    }
    levels_.push_back(std::move(level));
  }
}

HeightGrid::Cells HeightGrid::cells(double x_low, double x_high, double y_low,
                                    double y_high) const {
  // Of the heights, the last before the rectangle and the first behind it; ends are within.
  const auto between = [](const std::vector<float>& at, double from, double to, auto before) {
    const auto first = std::lower_bound(at.begin(), at.end(), from, before);
    const auto end = std::upper_bound(at.begin(), at.end(), to, before);
    const size_t cells = at.size() - 1;
    const auto low = static_cast<size_t>(first - at.begin()),
               high = static_cast<size_t>(end - at.begin());
    return std::pair(std::min(low > 0 ? low - 1 : 0, cells), std::min(high, cells));
  };
  const auto [column, column_end] = between(x_, x_low, x_high, std::less<double>());
  const auto [row, row_end] = between(y_, y_high, y_low, std::greater<double>());
  return {row, row_end, column, column_end};
}

}  // namespace ruedo::world
