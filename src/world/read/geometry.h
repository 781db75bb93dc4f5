// Shapes: SDF's <geometry>, and the meshes made from polylines.
#pragma once

#include <optional>
#include <string>

#include "world/model/world_model.h"
#include "world/read/read_context.h"

namespace ruedo::world {

// The use of a shape. A mesh that collides and moves is divided into convex pieces, as its
// `optimization` says.
enum class ShapeUse { seen, collides, collides_moving };

// Reads <geometry>. nullopt: without a shape, or its mesh is missing or broken; the findings say
// which. Throws TooLarge for a heightmap that collides and cannot be used: it is the ground.
std::optional<Geometry> read_geometry(const Element& geometry, const std::string& where,
                                      ReadContext& context, ShapeUse use);

// Prisms over the polygons (even-odd: a polygon inside another is a hole) from z = 0 to `height`.
// Throws std::runtime_error for polygons without area or with crossing edges.
Mesh extruded(const std::vector<std::vector<Eigen::Vector2d>>& polygons, double height);

}  // namespace ruedo::world
