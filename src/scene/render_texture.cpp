#include "scene/render_texture.h"

#include <algorithm>
#include <filesystem>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace ruedo::scene {
namespace {

// Larger pictures are reduced: finer than any camera sees, and slow to draw from.
constexpr int kMaxSide = 2048;

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

}  // namespace

TexturePixels decode_texture(const model::Texture& texture) {
  TexturePixels out;
  std::error_code error;
  if (!texture.path.empty() && !std::filesystem::is_regular_file(texture.path, error)) return out;
  try {
    cv::Mat image = texture.path.empty() ? cv::imdecode(texture.embedded, cv::IMREAD_UNCHANGED)
                                         : cv::imread(texture.path, cv::IMREAD_UNCHANGED);
    if (image.empty()) return out;
    const int side = std::max(image.cols, image.rows);
    if (side > kMaxSide) {
      const double factor = static_cast<double>(kMaxSide) / side;
      cv::resize(image, image, cv::Size(std::max(1, static_cast<int>(image.cols * factor)),
                                        std::max(1, static_cast<int>(image.rows * factor))), 0, 0, cv::INTER_AREA);
    }
    cv::Mat rgba = to_rgba(image);
    if (rgba.empty()) return out;
    cv::flip(rgba, rgba, 0);
    out.width = rgba.cols;
    out.height = rgba.rows;
    out.rgba.assign(rgba.datastart, rgba.dataend);
    for (size_t i = 3; i < out.rgba.size() && !out.holes; i += 4) out.holes = out.rgba[i] < 128;
  } catch (const cv::Exception&) {
    out = {};
  } catch (const std::bad_alloc&) {
    out = {};
  }
  return out;
}

}  // namespace ruedo::scene
