#include "scene/pictures/render_texture.h"

#include <algorithm>
#include <string_view>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "base/input_file.h"
#include "ruedo/errors.h"
#include "world/mesh/codecs.h"
#include "world/mesh/picture.h"
#include "world/mesh/texture_store.h"

namespace ruedo::scene {
namespace {

// Larger pictures are downscaled: they are finer than any camera can see, and slow to sample.
constexpr int kMaxSide = 2048;
constexpr int kMostPixels = 16384;  // width and height; larger pictures are not decoded

cv::Mat to_rgba(cv::Mat image) {
  if (image.depth() == CV_16U) image.convertTo(image, CV_8U, 1.0 / 257.0);
  if (image.depth() == CV_32F) image.convertTo(image, CV_8U, 255.0);
  if (image.depth() != CV_8U) return {};
  cv::Mat rgba;
  switch (image.channels()) {
    case 1: cv::cvtColor(image, rgba, cv::COLOR_GRAY2RGBA); break;
    case 3: cv::cvtColor(image, rgba, cv::COLOR_BGR2RGBA); break;
    case 4: cv::cvtColor(image, rgba, cv::COLOR_BGRA2RGBA); break;
    default: break;
  }
  return rgba;
}

std::vector<uint8_t> read_bytes(const std::string& path) {
  const std::string bytes = read_input(path, world::kMostTextureBytes);
  return {bytes.begin(), bytes.end()};
}

// Removes colour profiles, which are not used here: libpng complains on stderr about those of many
// programs.
void remove_png_profile(std::vector<uint8_t>& bytes) {
  constexpr std::string_view kSignature = "\x89PNG\r\n\x1a\n";
  const auto text = [&](size_t at, size_t length) {
    return std::string_view(reinterpret_cast<const char*>(bytes.data()) + at, length);
  };
  if (bytes.size() < kSignature.size() || text(0, kSignature.size()) != kSignature) return;
  for (size_t at = kSignature.size();
       at + 12 <= bytes.size();) {  // a chunk: length, kind, data, checksum
    const size_t length = static_cast<size_t>(bytes[at]) << 24 |
                          static_cast<size_t>(bytes[at + 1]) << 16 |
                          static_cast<size_t>(bytes[at + 2]) << 8 | bytes[at + 3];
    const std::string_view kind = text(at + 4, 4);
    if (kind == "IDAT" || length > bytes.size() - at - 12) return;
    if (kind == "iCCP") {
      bytes.erase(bytes.begin() + static_cast<std::ptrdiff_t>(at),
                  bytes.begin() + static_cast<std::ptrdiff_t>(at + 12 + length));
      return;
    }
    at += 12 + length;
  }
}

}  // namespace

TexturePixels decode_texture(const world::Texture& texture) {
  TexturePixels out;
  try {
    std::vector<uint8_t> bytes = texture.path.empty() ? texture.embedded : read_bytes(texture.path);
    remove_png_profile(bytes);
    if (bytes.empty() || !world::picture_fault(bytes, kMostPixels).empty()) return out;
    cv::Mat image = world::decode_picture(bytes.data(), bytes.size(), cv::IMREAD_UNCHANGED);
    if (image.empty()) return out;
    const int side = std::max(image.cols, image.rows);
    if (side > kMaxSide) {
      const double factor = static_cast<double>(kMaxSide) / side;
      cv::resize(image, image,
                 cv::Size(std::max(1, static_cast<int>(image.cols * factor)),
                          std::max(1, static_cast<int>(image.rows * factor))),
                 0, 0, cv::INTER_AREA);
    }
    cv::Mat rgba = to_rgba(image);
    if (rgba.empty()) return out;
    cv::flip(rgba, rgba, 0);
    out.width = rgba.cols;
    out.height = rgba.rows;
    out.rgba.assign(rgba.datastart, rgba.dataend);
    for (size_t i = 3; i < out.rgba.size() && !out.holes; i += 4) out.holes = out.rgba[i] < 128;
  } catch (const InputError&) {
  } catch (const cv::Exception&) {
    out = {};
  } catch (const std::bad_alloc&) {
    out = {};
  }
  return out;
}

}  // namespace ruedo::scene
