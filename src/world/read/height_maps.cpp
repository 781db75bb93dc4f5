#include "world/read/height_maps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <mutex>
#include <stdexcept>
#include <tuple>

#include "base/input_file.h"
#include "world/mesh/codecs.h"
#include "world/mesh/picture.h"

namespace ruedo::world {
namespace {

// Elevations from the lowest (0) to the highest (1). Unmeasured places are the lowest.
cv::Mat normalized(const cv::Mat& elevation) {
  constexpr float kNoData = -9000.0f;  // m; beyond the deepest sea, by custom
  cv::Mat heights;
  elevation.convertTo(heights, CV_32F);
  float lowest = std::numeric_limits<float>::infinity(), highest = -lowest;
  const auto known = [](float z) { return std::isfinite(z) && z > kNoData && z < -kNoData; };
  for (auto at = heights.begin<float>(); at != heights.end<float>(); ++at) {
    if (!known(*at)) continue;
    lowest = std::min(lowest, *at);
    highest = std::max(highest, *at);
  }
  if (lowest > highest) throw std::runtime_error("it holds no elevation");
  for (auto at = heights.begin<float>(); at != heights.end<float>(); ++at)
    *at = known(*at) && highest > lowest ? (*at - lowest) / (highest - lowest) : 0.0f;
  return heights;
}

// The picture's numbers, in one channel.
cv::Mat decoded(const std::string& picture) {
  const std::string bytes = read_input(picture, 512 << 20);
  if (const std::string fault = picture_fault(bytes, kMostHeightsEachWay); !fault.empty())
    throw std::runtime_error(fault);
  cv::Mat grey;
  try {
    grey = decode_picture(bytes.data(), bytes.size(), cv::IMREAD_GRAYSCALE | cv::IMREAD_ANYDEPTH);
  } catch (const cv::Exception&) {
    throw std::runtime_error("the picture is broken");
  }
  if (grey.empty())
    throw std::runtime_error("it is not a picture that can be read (pgm, png, jpeg, bmp, tiff)");
  if (grey.depth() == CV_16S || grey.depth() == CV_32F || grey.depth() == CV_64F)
    grey = normalized(grey);
  else if (grey.depth() != CV_8U && grey.depth() != CV_16U)
    throw std::runtime_error("its pixels are neither of 8 or 16 bits nor floating-point numbers");
  if (std::min(grey.cols, grey.rows) < 2 || std::max(grey.cols, grey.rows) > kMostHeightsEachWay) {
    throw std::runtime_error("it has " + std::to_string(grey.cols) + " x " +
                             std::to_string(grey.rows) + " pixels; allowed are 2 to " +
                             std::to_string(kMostHeightsEachWay) + " each way");
  }
  return grey;
}

template <class Number>
void add_heights(const cv::Mat& grey, double white, double high, double at, std::vector<float>& z) {
  for (int row = 0; row < grey.rows; ++row) {
    const Number* numbers = grey.ptr<Number>(row);
    for (int column = 0; column < grey.cols; ++column)
      z.push_back(static_cast<float>(numbers[column] / white * high) + static_cast<float>(at));
  }
}

// The coordinates of that many heights over `size` about `at`. Falling: the picture's first row is
// the one with the largest y.
std::vector<float> coordinates(int count, double size, double at, bool falling) {
  std::vector<float> numbers;
  for (int i = 0; i < count; ++i) {
    const double part = static_cast<double>(i) / (count - 1), rising = falling ? 1.0 - part : part;
    numbers.push_back(static_cast<float>((rising - 0.5) * size) + static_cast<float>(at));
  }
  return numbers;
}

}  // namespace

HeightGrid heightmap(const std::string& picture, const Vec3& size, const Vec3& at) {
  const cv::Mat grey = decoded(picture);
  std::vector<float> z;
  z.reserve(grey.total());
  switch (grey.depth()) {
    case CV_8U: add_heights<uint8_t>(grey, 255.0, size.z(), at.z(), z); break;
    case CV_16U: add_heights<uint16_t>(grey, 65535.0, size.z(), at.z(), z); break;
    default: add_heights<float>(grey, 1.0, size.z(), at.z(), z);
  }
  return {coordinates(grey.cols, size.x(), at.x(), false),
          coordinates(grey.rows, size.y(), at.y(), true), std::move(z)};
}

Mesh triangles_of(const HeightGrid& grid) {
  Mesh mesh;
  for (size_t i = 0; i < grid.vertex_count(); ++i) mesh.positions.push_back(grid.vertex(i));
  for (size_t i = 0; i < grid.triangle_count(); ++i) mesh.triangles.push_back(grid.triangle(i));
  mesh.parts.push_back({"heightmap", 0, static_cast<uint32_t>(mesh.triangles.size()), {}});
  return mesh;
}

std::shared_ptr<const HeightGrid> height_map_of(const std::string& picture, const Vec3& size,
                                                const Vec3& at) {
  using Key = std::tuple<std::string, std::filesystem::file_time_type, std::uintmax_t,
                         std::array<double, 6>>;
  static std::mutex mutex;
  static std::map<Key, std::weak_ptr<const HeightGrid>> known;
  std::error_code error;  // read_input() says what is wrong
  const Key key{picture,
                std::filesystem::last_write_time(picture, error),
                std::filesystem::file_size(picture, error),
                {size.x(), size.y(), size.z(), at.x(), at.y(), at.z()}};
  const std::lock_guard lock(mutex);
  std::erase_if(known, [](const auto& entry) { return entry.second.expired(); });
  auto& entry = known[key];
  auto grid = entry.lock();
  if (!grid) entry = grid = std::make_shared<const HeightGrid>(heightmap(picture, size, at));
  return grid;
}

}  // namespace ruedo::world
