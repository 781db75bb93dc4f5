// The static part of what a viewer draws: meshes, pictures, surfaces, lights, and which body
// carries which link.
//
// Built from the world once, and again when the world has changed; served as one JSON text and two
// blobs.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "console/board.h"
#include "world/model/world_model.h"

namespace ruedo::console {

struct Picture {
  std::string type;  // "image/png", ...
  http::Bytes bytes;
};

// The collision shapes known to physics and range finders, in place of visuals.
world::WorldModel collision_shapes(const world::WorldModel& world);

struct SceneData {
  http::Bytes json;
  // for each mesh its vertices (float32 x, y, z, nx, ny, nz, u, v), then its indices (uint32);
  // little endian
  http::Bytes meshes;
  // for each link: int32 kind, int32 body (-1: static), float32 x, y, z, qw, qx, qy, qz of the link
  // in its body, or in the world; little endian
  http::Bytes links;
  std::vector<Picture> pictures;  // in the order of the JSON's textures; empty without textures

  explicit SceneData(const world::WorldModel& world, int version);
};

}  // namespace ruedo::console
