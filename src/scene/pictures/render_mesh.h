// Triangles as uploaded by the renderer: tessellated unit primitives, and mesh files cut into
// pieces that are culled individually.
#pragma once

#include <cstdint>
#include <vector>

#include "ruedo/pose.h"
#include "world/model/mesh.h"

namespace ruedo::scene {

struct RenderVertex {
  Eigen::Vector3f position;  // m, or of a unit primitive
  Eigen::Vector3f normal;    // unit
  Eigen::Vector2f uv;        // v counts up
};

struct RenderMesh {
  // A run of triangles of one material, small enough to be culled by its bounding sphere.
  struct Piece {
    uint32_t first_index = 0, index_count = 0;
    world::MaterialIndex material;  // of the world::Mesh
    Vec3 centre = Vec3::Zero();     // of the bounding sphere
    double radius = 0.0;
    Vec3 low = Vec3::Zero(), high = Vec3::Zero();  // bounding box
  };
  std::vector<RenderVertex> vertices;
  std::vector<uint32_t> indices;  // three a triangle, counter-clockwise seen from outside
  std::vector<Piece> pieces;
};

// Primitives, all centred at the origin, standing along z; with texture coordinates.
RenderMesh box_mesh();    // edges 1
RenderMesh plane_mesh();  // 1 x 1 in xy, normal z
RenderMesh sphere_mesh(
    int segments);  // radius 1; `segments` around, half of them from pole to pole
RenderMesh cylinder_mesh(int segments);  // radius 1, length 1
RenderMesh cone_mesh(int segments);      // radius 1, length 1, apex up
RenderMesh capsule_mesh(double radius, double length,
                        int segments);  // length of the cylindrical part

// The triangles of a mesh file; flat normals if it has none. Triangles with invalid vertex indices
// are dropped.
RenderMesh file_mesh(const world::Mesh& mesh);

}  // namespace ruedo::scene
