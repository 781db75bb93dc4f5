// The ground of robots: the level planes of a world, and the lowest points of a robot's wheels.
#pragma once

#include <optional>
#include <vector>

#include "world/model/body_layout.h"

namespace ruedo::world {

// A static plane whose normal points straight up.
struct LevelPlane {
  double height;  // m, world
  double friction;
  LinkIndex link;
};
std::vector<LevelPlane> level_planes(const WorldModel& world, const BodyLayout& layout);

// The plane nearest to that height; of a world without allocating.
std::optional<LevelPlane> nearest_plane(const std::vector<LevelPlane>& planes, double height);
std::optional<LevelPlane> nearest_plane(const WorldModel& world, const BodyLayout& layout,
                                        double height);

// The lowest friction among the shapes of a robot's wheels; 1 without one.
double friction_of_wheels(const WorldModel& world, const BodyLayout& layout, RobotIndex robot);

// Height of the lowest point of a shape at X_FC, along z of F.
double lowest_point(const Geometry& geometry, const Pose& X_FC);

// Height of the lowest point of a robot's wheels, along z of base_link, from its origin. Wheels
// without collision shapes reach down by the drive's wheel radius; where all are suspended, the
// robot's lowest shape counts.
double lowest_of_wheels(const WorldModel& world, const BodyLayout& layout, RobotIndex robot);

}  // namespace ruedo::world
