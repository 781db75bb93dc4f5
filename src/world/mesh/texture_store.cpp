#include "world/mesh/texture_store.h"

#include "base/input_file.h"
#include "world/mesh/picture.h"

namespace ruedo::world {
namespace {

int64_t pixels_in(const std::string& path) {
  try {
    return picture_pixels(read_input(path, kMostTextureBytes));
  } catch (const InputError&) {
    return 0;
  }
}

}  // namespace

std::shared_ptr<const Texture> TextureStore::take(const std::string& path) {
  const auto [at, is_new] = files_.try_emplace(path);
  if (is_new && has_room(pixels_in(path), path))
    at->second = std::make_shared<Texture>(Texture{path, {}});
  return at->second;
}

std::shared_ptr<const Texture> TextureStore::take(const std::shared_ptr<const Texture>& embedded,
                                                  const std::string& owner) {
  return has_room(picture_pixels(embedded->embedded), owner) ? embedded : nullptr;
}

bool TextureStore::has_room(int64_t pixels, const std::string& file) {
  if (pixels_ + pixels > kMostTexturePixels) {
    findings_.unsupported({file, 0}, "",
                          "the textures have more than " + std::to_string(kMostTexturePixels) +
                              " pixels in all with this one; the plain colour is shown instead");
    return false;
  }
  pixels_ += pixels;
  return true;
}

}  // namespace ruedo::world
