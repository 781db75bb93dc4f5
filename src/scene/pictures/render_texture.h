// Decodes the pictures named by materials.
#pragma once

#include <cstdint>
#include <vector>

#include "world/model/mesh.h"

namespace ruedo::scene {

struct TexturePixels {
  int width = 0, height = 0;  // 0: missing, broken or of a kind that cannot be read
  bool holes = false;         // partly transparent: drawn as a cutout
  std::vector<uint8_t> rgba;  // rows from the bottom, as in OpenGL
};

// Never throws: a texture that cannot be loaded is empty, and its surface keeps its plain colour.
TexturePixels decode_texture(const world::Texture& texture);

}  // namespace ruedo::scene
