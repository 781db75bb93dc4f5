// What of a world is in the way of people on a floor, seen from above: rectangles, the nearest
// walls of a place, and the ways around them.
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "model/occupancy.h"

namespace ruedo::model {

using Vec2 = Eigen::Vector2d;

// Shortest ways to a goal, over cells.
struct Route {
  std::vector<float> left;  // m to go from each cell; infinity: there is no way
};

class FloorPlan {
 public:
  FloorPlan() = default;
  // Ways are looked for in `within`.
  FloorPlan(std::vector<Rect> walls, const Rect& within);

  // From the nearest wall, and from the nearest of those that lie on its other side: at most two
  // points, within `reach`. In a wall the point is its nearest edge, and `inside` is true.
  struct Near {
    Vec2 point;
    bool inside;
  };
  int nearest(const Vec2& p, double reach, Near (&near)[2]) const;

  // No wall is nearer to the way from a to b than that.
  bool is_free(const Vec2& a, const Vec2& b, double clearance) const;

  // For people of that radius, who keep `clearance` from walls where they can.
  Route route_to(const Rect& goal, double radius, double clearance) const;
  // Where to head for from p: a place that is seen from there, on the way; p itself where there is
  // no way.
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
  double cell_m_ = 0.15;
  std::vector<std::vector<int>> of_block_;  // walls near each block of cells
  int blocks_x_ = 0, blocks_y_ = 0;
};

}  // namespace ruedo::model
