// Rectangles indexed by blocks of 2 m; Dijkstra's shortest paths over cells of 0.15 m, larger on
// large floors.
#include "world/maps/floor_plan.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>

#include "base/whole.h"

namespace ruedo::world {
namespace {

constexpr double kBlock_m = 2.0;
constexpr double kMostBlocks = 1e6;     // of one floor; on larger ones a block is larger
constexpr double kMostCells = 100'000;  // cells of one floor, for path planning
constexpr int kLookAhead = 40;  // cells of the path among which the next waypoint is looked for
constexpr int kAtLeast = 3;     // ... and at least so many, even beside a wall that hides the rest
constexpr double kSqueezes = 0.9;    // of a person's radius: the closest they can pass a wall
constexpr double kBesideWall = 3.0;  // cost factor of paths closer to walls than people like
constexpr float kNoWay = std::numeric_limits<float>::infinity();

int block_of(double at, double from, double block_m, int most) {
  return std::clamp(rounded_down<int>(std::clamp((at - from) / block_m, -1.0, 1e6)), 0, most - 1);
}

// The point on a rectangle's edge that is nearest to a point inside it.
Vec2 edge_of(const Rect& wall, const Vec2& p) {
  const double gaps[] = {p.x() - wall.low.x(), wall.high.x() - p.x(), p.y() - wall.low.y(),
                         wall.high.y() - p.y()};
  const auto least = std::min_element(std::begin(gaps), std::end(gaps)) - std::begin(gaps);
  if (least == 0) return {wall.low.x(), p.y()};
  if (least == 1) return {wall.high.x(), p.y()};
  return {p.x(), least == 2 ? wall.low.y() : wall.high.y()};
}

// Liang and Barsky's test: whether the segment from a to b meets a rectangle.
bool meets(const Rect& wall, const Vec2& a, const Vec2& b) {
  double enter = 0.0, leave = 1.0;
  for (int axis = 0; axis < 2; ++axis) {
    const double way = b[axis] - a[axis];
    if (way == 0.0) {
      if (a[axis] <= wall.low[axis] || a[axis] >= wall.high[axis]) return false;
      continue;
    }
    double first = (wall.low[axis] - a[axis]) / way, second = (wall.high[axis] - a[axis]) / way;
    if (first > second) std::swap(first, second);
    enter = std::max(enter, first);
    leave = std::min(leave, second);
  }
  return enter < leave;
}

}  // namespace

FloorPlan::FloorPlan(std::vector<Rect> walls, const Rect& within)
    : walls_(std::move(walls)), within_(within) {
  const Vec2 size = within.high - within.low;
  cell_m_ = std::max(cell_m_, std::sqrt(size.x() * size.y() / kMostCells));
  columns_ = std::max(1, rounded_up<int>(size.x() / cell_m_));
  rows_ = std::max(1, rounded_up<int>(size.y() / cell_m_));
  block_m_ = std::max(kBlock_m, std::sqrt(size.x() * size.y() / kMostBlocks));
  blocks_x_ = std::max(1, rounded_up<int>(size.x() / block_m_));
  blocks_y_ = std::max(1, rounded_up<int>(size.y() / block_m_));
  of_block_.resize(static_cast<size_t>(blocks_x_) * static_cast<size_t>(blocks_y_));
  for (size_t wall = 0; wall < walls_.size(); ++wall) {
    const Rect& r = walls_[wall];
    const int x1 = block_of(r.high.x(), within.low.x(), block_m_, blocks_x_),
              y1 = block_of(r.high.y(), within.low.y(), block_m_, blocks_y_);
    for (int y = block_of(r.low.y(), within.low.y(), block_m_, blocks_y_); y <= y1; ++y) {
      for (int x = block_of(r.low.x(), within.low.x(), block_m_, blocks_x_); x <= x1; ++x)
        of_block_[y * blocks_x_ + x].push_back(static_cast<int>(wall));
    }
  }
}

// Some walls come up more than once.
template <class Visit>
void FloorPlan::for_each_near(const Vec2& low, const Vec2& high, Visit visit) const {
  if (walls_.empty()) return;
  const int x1 = block_of(high.x(), within_.low.x(), block_m_, blocks_x_),
            y1 = block_of(high.y(), within_.low.y(), block_m_, blocks_y_);
  for (int y = block_of(low.y(), within_.low.y(), block_m_, blocks_y_); y <= y1; ++y) {
    for (int x = block_of(low.x(), within_.low.x(), block_m_, blocks_x_); x <= x1; ++x) {
      for (const int wall : of_block_[y * blocks_x_ + x]) visit(walls_[wall]);
    }
  }
}

int FloorPlan::nearest(const Vec2& p, double reach, Near (&near)[2]) const {
  const Vec2 around = Vec2::Constant(reach);
  double least = reach;
  int count = 0;
  for_each_near(p - around, p + around, [&](const Rect& wall) {
    const Vec2 q = wall.nearest(p);
    const double distance = (p - q).norm();
    if (distance >= least && !(count == 0 && distance == 0.0)) return;
    least = distance;
    near[0] = distance > 0.0 ? Near{q, false} : Near{edge_of(wall, p), true};
    count = 1;
  });
  if (count == 0 || near[0].inside) return count;
  const Vec2 towards = near[0].point - p;
  least = reach;
  for_each_near(p - around, p + around, [&](const Rect& wall) {
    const Vec2 q = wall.nearest(p), way = q - p;
    const double distance = way.norm();
    if (distance >= least || way.dot(towards) >= 0.0) return;
    least = distance;
    near[1] = {q, false};
    count = 2;
  });
  return count;
}

bool FloorPlan::is_free(const Vec2& a, const Vec2& b, double clearance) const {
  const Vec2 around = Vec2::Constant(clearance);
  bool free = true;
  for_each_near(a.cwiseMin(b) - around, a.cwiseMax(b) + around, [&](const Rect& wall) {
    free = free && !meets({wall.low - around, wall.high + around}, a, b);
  });
  return free;
}

int FloorPlan::column(double x) const {
  return std::clamp(rounded_down<int>(std::clamp((x - within_.low.x()) / cell_m_, -1.0, 1e6)), 0,
                    columns_ - 1);
}
int FloorPlan::row(double y) const {
  return std::clamp(rounded_down<int>(std::clamp((y - within_.low.y()) / cell_m_, -1.0, 1e6)), 0,
                    rows_ - 1);
}
Vec2 FloorPlan::middle(int cell) const {
  return within_.low + cell_m_ * Vec2(cell % columns_ + 0.5, cell / columns_ + 0.5);
}

Route FloorPlan::route_to(const Rect& goal, double radius, double clearance) const {
  Route route;
  const size_t cells = static_cast<size_t>(columns_) * static_cast<size_t>(rows_);
  route.left.assign(cells, kNoWay);
  if (walls_.empty()) return route;  // the goal is visible from everywhere
  std::vector<double> cost(cells, 1.0);
  for (size_t i = 0; i < cells; ++i) {
    const Vec2 at = middle(static_cast<int>(i));
    Near near[2];
    if (nearest(at, clearance, near) == 0) continue;
    const bool blocked = near[0].inside || (near[0].point - at).norm() < kSqueezes * radius;
    cost[i] = blocked ? kNoWay : kBesideWall;
  }
  using Entry = std::pair<float, int>;  // ties go to the lower cell
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> open;
  for (int r = row(goal.low.y()); r <= row(goal.high.y()); ++r) {
    for (int c = column(goal.low.x()); c <= column(goal.high.x()); ++c) {
      const int cell = r * columns_ + c;
      const Vec2 m = middle(cell);
      route.left[cell] = static_cast<float>((m - goal.nearest(m)).norm());
      open.emplace(route.left[cell], cell);
    }
  }
  while (!open.empty()) {
    const auto [left, cell] = open.top();
    open.pop();
    if (left > route.left[cell]) continue;
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const int c = cell % columns_ + dx, r = cell / columns_ + dy;
        if ((dx == 0 && dy == 0) || c < 0 || r < 0 || c >= columns_ || r >= rows_) continue;
        const auto to = static_cast<size_t>(r * columns_ + c);
        const auto way = static_cast<float>(
            left + cost[to] * cell_m_ * std::sqrt(static_cast<double>(dx * dx + dy * dy)));
        if (!(way < route.left[to])) continue;
        route.left[to] = way;
        open.emplace(way, static_cast<int>(to));
      }
    }
  }
  return route;
}

Vec2 FloorPlan::next(const Route& route, const Rect& goal, const Vec2& p, double clearance) const {
  const Vec2 target = goal.nearest(p);
  // Between walls closer than `clearance` on both sides: the centre of a narrow door.
  if (walls_.empty() || is_free(p, target, 0.8 * clearance)) return target;
  int cell = row(p.y()) * columns_ + column(p.x());
  Vec2 seen = p;
  for (int i = 0; i < kLookAhead; ++i) {
    int best = cell;
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const int c = cell % columns_ + dx, r = cell / columns_ + dy;
        if (c < 0 || r < 0 || c >= columns_ || r >= rows_) continue;
        const int to = r * columns_ + c;
        if (route.left[to] < route.left[best]) best = to;
      }
    }
    if (best == cell) break;
    cell = best;
    const Vec2 at = middle(cell);
    if (i >= kAtLeast && !is_free(p, at, 0.8 * clearance)) break;
    seen = at;
  }
  return seen;
}

}  // namespace ruedo::world
