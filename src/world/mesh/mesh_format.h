// The binary form in which the importer passes a mesh to the server, and in which the cache stores
// it.
//
// The reader trusts nothing: it checks counts against the available bytes, indices against counts,
// and numbers for NaN and excessive sizes.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "world/model/mesh.h"

namespace ruedo::world {

// Increment it when the importer's results or this format change: old cache entries are then
// ignored.
constexpr uint32_t kMeshFormatVersion = 3;
// The same for the division into convex pieces.
constexpr uint32_t kPiecesVersion = 1;

struct MeshLimits {
  static constexpr size_t kFileBytes = 256u << 20;  // of a mesh file
  static constexpr uint32_t kVertices = 8'000'000;
  static constexpr uint32_t kTriangles = 8'000'000;
  static constexpr uint32_t kParts = 100'000;
  static constexpr size_t kTextureBytes = 64u << 20;  // of all embedded textures
  static constexpr float kExtent_m = 1e6f;            // largest coordinate
};

// Another file that the mesh file refers to (a material library, a buffer), by its path relative to
// the mesh's folder.
struct MeshDependency {
  std::string path;
  uint64_t hash = 0;  // content_hash of its bytes; 0: it did not exist
};

struct MeshPackage {
  Mesh mesh;  // texture paths as written in the file
  std::vector<MeshDependency> dependencies;
};

// The part of a mesh on which its convex pieces depend, packed.
std::string pack_solid(const Mesh& mesh);

// Two independent 64-bit hashes of the bytes as 32 hexadecimal digits; and one of the two.
std::string content_key(std::string_view bytes);
uint64_t content_hash(std::string_view bytes);

std::string pack_mesh(const MeshPackage& package);
// Throws std::runtime_error saying what is wrong.
MeshPackage unpack_mesh(std::string_view bytes);

// The error in the mesh's numbers and indices; "" without one.
std::string mesh_fault(const Mesh& mesh);

// Whether every edge belongs to exactly two triangles, traversed in opposite directions; equal
// positions count as one.
bool is_closed(const Mesh& mesh);

}  // namespace ruedo::world
