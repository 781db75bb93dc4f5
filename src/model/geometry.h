// Shapes: SDF's <geometry>, and the meshes that polylines and heightmaps become.
#pragma once

#include <optional>
#include <string>

#include "model/read_context.h"
#include "model/world_model.h"

namespace ruedo::model {

// Reads <geometry>. nullopt: there is no shape, or a mesh that is missing or broken; the findings
// say which.
std::optional<Geometry> read_geometry(const Element& geometry, const std::string& where,
                                      ReadContext& context);

// Prisms over the polygons (even-odd: a polygon inside another is a hole) from z = 0 to `height`.
// Throws std::runtime_error for polygons that have no area or cross themselves.
Mesh extruded(const std::vector<std::vector<Eigen::Vector2d>>& polygons, double height);

// A grid of heights, one a pixel, from a picture file; size in metres, centred at the origin.
// Throws std::runtime_error for a picture that cannot be read.
Mesh heightmap(const std::string& picture, const Vec3& size);

// A shape's points furthest out, in its own frame: the corners of its bounding box. Planes have
// none.
Eigen::AlignedBox3d bounds(const Geometry& geometry);

}  // namespace ruedo::model
