// The area of the ground below a model, for planners that move it as a polygon or a circle.
#pragma once

#include <vector>

#include "world/model/world_model.h"

namespace ruedo::world {

struct Footprint {
  // The smallest octagon around it with sides along x, along y and at 45 degrees between, seen from
  // the model's base (m), counterclockwise, without corners that coincide: exact for a box.
  std::vector<Eigen::Vector2d> corners;
  double radius = 0.0;    // m, of the smallest circle about the base
  bool is_round = false;  // that circle is smaller than the octagon
};

// Of the model's collisions, seen from above; empty without any.
Footprint footprint(const Model& model);

}  // namespace ruedo::world
