// Divides closed triangle meshes into convex pieces by planes.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace ruedo::world {

// The hull of some corners, with its surface: counter-clockwise seen from outside.
struct ConvexPiece {
  std::vector<Eigen::Vector3d> corners;
  std::vector<std::array<uint32_t, 3>> triangles;
};

// Convex pieces of a mesh, at most `most` (1 or more). Empty if the mesh has at most `most`
// connected parts, and their convex hulls at most 5 % more volume; or if parts of it are not
// closed, or there are more than 200 parts or 200 000 triangles.
//
// Where `most` allows, the pieces together have at most 4 % more volume than the mesh. The piece
// that exceeds its part of the mesh the most is cut in two, by the plane after which the two hulls
// exceed the least: planes through the mesh's concave edges, and across the piece. Hulls that are
// as good as one are joined in the end. The concept is that of CoACD (Wei, Liu, Ling and Su,
// "Approximate convex decomposition for 3D meshes with collision-aware concavity and tree search",
// 2022) and V-HACD (Mamou), with the excess of volume as the measure, and without voxels or trees
// of plans. The result depends on nothing but the mesh.
std::vector<ConvexPiece> convex_pieces(std::span<const Eigen::Vector3d> positions,
                                       std::span<const std::array<uint32_t, 3>> triangles,
                                       size_t most);

}  // namespace ruedo::world
