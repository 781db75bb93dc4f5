// Pictures as heights over the ground.
#pragma once

#include <memory>
#include <string>

#include "ruedo/pose.h"
#include "world/model/height_grid.h"

namespace ruedo::world {

inline constexpr int kMostHeightsEachWay = 8193;
inline constexpr size_t kMostHeightsOfMoving = 1025;  // each way: it collides as its convex hull

// A heightmap from a picture file, one height per pixel; size in metres, its middle at `at`.
// Throws std::runtime_error for a picture that cannot be read.
HeightGrid heightmap(const std::string& picture, const Vec3& size, const Vec3& at = Vec3::Zero());

// The same surface as arrays.
Mesh triangles_of(const HeightGrid& grid);

// The same, shared by all its users: a visual and a collision, or copies of a world.
std::shared_ptr<const HeightGrid> height_map_of(const std::string& picture, const Vec3& size,
                                                const Vec3& at);

}  // namespace ruedo::world
