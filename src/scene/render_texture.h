// Decodes the pictures that materials name.
#pragma once

#include <cstdint>
#include <vector>

#include "model/mesh.h"

namespace ruedo::scene {

struct TexturePixels {
  int width = 0, height = 0;  // 0: missing, broken or of a kind that cannot be read
  bool holes = false;         // parts of it are transparent: drawn as cut out
  std::vector<uint8_t> rgba;  // rows from the bottom, as OpenGL counts
};

// Never throws: a texture that cannot be had is empty, and its surface gets its plain colour.
TexturePixels decode_texture(const model::Texture& texture);

}  // namespace ruedo::scene
