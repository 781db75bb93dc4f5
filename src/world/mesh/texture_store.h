// The pictures that the materials of a world name: each is there once, and together they have at
// most kMostTexturePixels, since each takes time to decode and memory to draw.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>

#include "ruedo/errors.h"
#include "world/model/mesh.h"

namespace ruedo::world {

inline constexpr int64_t kMostTexturePixels = 500'000'000;
inline constexpr size_t kMostTextureBytes = 256u << 20;  // of a larger file nothing is read

class TextureStore {
 public:
  explicit TextureStore(Findings& findings) : findings_(findings) {}

  // The picture in a file, by its path; null, and a finding, if the others leave no room for it.
  // A file that is not a picture costs nothing; the renderer reports it.
  std::shared_ptr<const Texture> take(const std::string& path);
  // The same for a picture that is embedded in the mesh file `owner`.
  std::shared_ptr<const Texture> take(const std::shared_ptr<const Texture>& embedded,
                                      const std::string& owner);

 private:
  bool has_room(int64_t pixels, const std::string& file);

  Findings& findings_;
  std::map<std::string, std::shared_ptr<const Texture>> files_;
  int64_t pixels_ = 0;
};

}  // namespace ruedo::world
