// Shapes: SDF's <geometry>, and the meshes made from polylines and heightmaps.
#pragma once

#include <optional>
#include <string>

#include "world/model/world_model.h"
#include "world/read/read_context.h"

namespace ruedo::world {

// Reads <geometry>. nullopt: there is no shape, or its mesh is missing or broken; the findings say
// which. collides_moving: a mesh is divided into convex pieces, as its `optimization` says.
std::optional<Geometry> read_geometry(const Element& geometry, const std::string& where,
                                      ReadContext& context, bool collides_moving);

// Prisms over the polygons (even-odd: a polygon inside another is a hole) from z = 0 to `height`.
// Throws std::runtime_error for polygons without area or with crossing edges.
Mesh extruded(const std::vector<std::vector<Eigen::Vector2d>>& polygons, double height);

// A heightmap from a picture file, one height per pixel; size in metres, centred at the origin.
// Throws std::runtime_error for a picture that cannot be read.
Mesh heightmap(const std::string& picture, const Vec3& size);

}  // namespace ruedo::world
