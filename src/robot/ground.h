// What a robot stands on: the level planes of a world, and the lowest points of a robot's wheels.
#pragma once

#include <optional>
#include <vector>

#include "world/model/body_layout.h"

namespace ruedo::robot {

// A static plane whose normal points straight up.
struct LevelPlane {
  double height;  // m, world
  double friction;
};
std::vector<LevelPlane> level_planes(const world::WorldModel& world,
                                     const world::BodyLayout& layout);

// The plane nearest to that height.
std::optional<LevelPlane> nearest_plane(const std::vector<LevelPlane>& planes, double height);

// The lowest friction among the shapes of a robot's wheels; 1 if there are none.
double friction_of_wheels(const world::WorldModel& world, const world::BodyLayout& layout,
                          RobotIndex robot);

// Height of the lowest point of a shape at X_FC, along z of F.
double lowest_point(const world::Geometry& geometry, const Pose& X_FC);

// Height of the lowest point of a robot's wheels, along z of base_link, from its origin. Wheels
// without collision shapes reach down by the drive's wheel radius.
double lowest_of_wheels(const world::WorldModel& world, const world::BodyLayout& layout,
                        RobotIndex robot);

}  // namespace ruedo::robot
