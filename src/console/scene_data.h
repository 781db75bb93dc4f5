// The still part of what a viewer draws: meshes, pictures, surfaces, lights, and which body carries
// which link.
//
// Made from the world once, and again when the world has changed; served as one JSON text and two
// blobs.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "console/board.h"
#include "model/world_model.h"

namespace ruedo::console {

struct Picture {
  std::string type;  // "image/png", ...
  Bytes bytes;
};

// The world with what physics and range finders know of it in place of what it looks like.
model::WorldModel collision_shapes(const model::WorldModel& world);

struct SceneData {
  // Of each link: int32 kind, int32 body (-1: does not move), float32 x, y, z, qw, qx, qy, qz of
  // the link in its body, or in the world; little endian.
  static constexpr size_t kLinkSize = 36;

  std::string json;
  Bytes meshes;  // of each mesh its vertices (float32 x, y, z, nx, ny, nz, u, v), then its indices
                 // (uint32); little endian
  Bytes links;
  std::vector<Picture>
      pictures;  // in the order of the JSON's textures; without bytes where there is none

  explicit SceneData(const model::WorldModel& world, int version);
};

}  // namespace ruedo::console
