// Obstacles for people on a floor, seen from above, as rectangles; the walls nearest to a point,
// and paths around them.
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "world/maps/occupancy.h"

namespace ruedo::world {

using Vec2 = Eigen::Vector2d;

// Shortest paths to a goal, over cells.
struct Route {
  std::vector<float> left;  // remaining path length from each cell, m; infinity without a path
};

class FloorPlan {
 public:
  FloorPlan() = default;
  // Paths are planned inside `within`.
  FloorPlan(std::vector<Rect> walls, const Rect& within);

  // The nearest points of the nearest wall, and of the nearest wall on the opposite side: at most
  // two points, within `reach`. Inside a wall the point is on its nearest edge, and `inside` is
  // true.
  struct Near {
    Vec2 point;
    bool inside;
  };
  int nearest(const Vec2& p, double reach, Near (&near)[2]) const;

  // Whether no wall comes closer than that to the segment from a to b.
  bool is_free(const Vec2& a, const Vec2& b, double clearance) const;

  // For people of that radius, who keep `clearance` from walls if they can.
  Route route_to(const Rect& goal, double radius, double clearance) const;
  // The next target from p: a point on the path that is visible from p; p itself without a path.
  Vec2 next(const Route& route, const Rect& goal, const Vec2& p, double clearance) const;

 private:
  int column(double x) const;
  int row(double y) const;
  Vec2 middle(int cell) const;
  template <class Visit>
  void for_each_near(const Vec2& low, const Vec2& high, Visit visit) const;

  std::vector<Rect> walls_;
  Rect within_;
  int columns_ = 0, rows_ = 0;
  double cell_m_ = 0.15, block_m_ = 0.0;
  std::vector<std::vector<int>> of_block_;  // the walls near each block of cells
  int blocks_x_ = 0, blocks_y_ = 0;
};

}  // namespace ruedo::world
