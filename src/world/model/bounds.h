// Bounding boxes of shapes.
#pragma once

#include <Eigen/Geometry>

#include "world/model/world_model.h"

namespace ruedo::world {

// The corners of a shape's bounding box, in the shape's frame. Planes have none.
Eigen::AlignedBox3d bounds(const Geometry& geometry);

}  // namespace ruedo::world
