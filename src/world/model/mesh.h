// Triangle meshes and their materials, from a mesh file, a polyline or a heightmap.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "ruedo/index.h"

namespace ruedo::world {

using Rgba = std::array<float, 4>;

// A picture that has not been decoded: a file, or bytes embedded in a mesh file.
struct Texture {
  std::string path;               // empty when embedded
  std::vector<uint8_t> embedded;  // an encoded image (png, jpeg, ...)
};

// Colours in [0, 1], linear as SDF's renderers have them; a texture multiplies the diffuse colour.
struct Material {
  Rgba ambient{0.7f, 0.7f, 0.7f, 1.0f};
  Rgba diffuse{0.7f, 0.7f, 0.7f, 1.0f};
  Rgba specular{0.0f, 0.0f, 0.0f, 1.0f};
  Rgba emissive{0.0f, 0.0f, 0.0f, 1.0f};
  float shininess = 16.0f;
  std::shared_ptr<const Texture> texture;  // null: none
  bool double_sided = false;
};

using MaterialIndex = Index<struct MaterialKind>;  // into Mesh::materials

// Immutable once loaded, and shared by all users of the file. Metres, z up, x forward: the mesh
// file's unit and up axis have been applied, SDF's <scale> has not.
struct Mesh {
  struct Part {  // triangles [first, first + count) of one material, of one submesh
    std::string name;
    uint32_t first_triangle = 0;
    uint32_t triangle_count = 0;
    MaterialIndex material;  // none: plain
  };

  std::string name;  // the file, for messages
  std::vector<Eigen::Vector3f> positions;
  std::vector<Eigen::Vector3f> normals;            // one per position, or empty (flat shading)
  std::vector<Eigen::Vector2f> uvs;                // one per position, or empty; v counts up
  std::vector<std::array<uint32_t, 3>> triangles;  // counter-clockwise seen from outside
  std::vector<Part> parts;
  IndexedVector<MaterialIndex, Material> materials;
  bool closed = false;  // every edge belongs to two triangles, so that the mesh has an inside
};

}  // namespace ruedo::world
