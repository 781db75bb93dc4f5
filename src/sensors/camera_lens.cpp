#include "sensors/camera_lens.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <tuple>

#include <opencv2/imgproc.hpp>

#include <fmt/format.h>

#include "base/message_size.h"
#include "base/whole.h"
#include "ruedo/math.h"

namespace ruedo {
namespace {

// The width of a pinhole's picture goes to infinity towards 180 degrees.
constexpr double kMaxHfov = 3.0;
// Maximum size of the ideal picture relative to the lens's.
constexpr double kMaxGrowth = 2.5;
// Pixels of one distorted picture, and of all with lenses of their own in a world: each is found by
// iteration, in about 1 us.
constexpr int64_t kMostDistorted = 12'000'000, kMostDistortedInAll = 2 * kMostDistorted;

int64_t pixels_of(const Lens& lens) { return int64_t{lens.width} * lens.height; }

}  // namespace

Lens::Lens(const Element& camera) {
  width = static_cast<int>(camera.integer("image/width", width, Allowed::between(1, kMostPixels)));
  height =
      static_cast<int>(camera.integer("image/height", height, Allowed::between(1, kMostPixels)));
  hfov = camera.number("horizontal_fov", hfov,
                       Allowed{.min = 0.0, .max = kMaxHfov, .min_excluded = true});
  near_m = camera.number("clip/near", near_m, Allowed::positive(quantity::kRange));
  far_m = camera.number("clip/far", far_m, Allowed::positive(quantity::kRange));
  if (far_m <= near_m) {
    const Element* clip = camera.child("clip");
    (clip ? clip : &camera)
        ->fail(fmt::format("far ({} m) has to be beyond near ({} m)", far_m, near_m));
  }
  const scene::View pinhole = scene::View::pinhole({}, width, height, hfov);
  const Allowed focal = Allowed::positive(quantity::kPixels);
  fx = camera.number("lens/intrinsics/fx", pinhole.fx, focal);
  fy = camera.number("lens/intrinsics/fy", camera.has("lens/intrinsics/fx") ? fx : pinhole.fy,
                     focal);
  cx = camera.number("lens/intrinsics/cx", pinhole.cx, Allowed::any(quantity::kPixels));
  cy = camera.number("lens/intrinsics/cy", pinhole.cy, Allowed::any(quantity::kPixels));
  if (fx != pinhole.fx || cx != pinhole.cx)
    hfov = math::atan((cx + 0.5) / fx) + math::atan((width - 0.5 - cx) / fx);
  if (const Element* d = camera.child("distortion")) {
    const Allowed range = Allowed::between(-10.0, 10.0);
    distortion = {d->number("k1", 0, range), d->number("k2", 0, range), d->number("p1", 0, range),
                  d->number("p2", 0, range), d->number("k3", 0, range)};
    if (pixels_of(*this) > kMostDistorted)
      d->fail("a picture of " + std::to_string(width) + " x " + std::to_string(height) +
              " pixels is not distorted; at most " + std::to_string(kMostDistorted) +
              " pixels are");
  }
}

Eigen::Vector2d Lens::distort(const Eigen::Vector2d& p) const {
  const auto& [k1, k2, p1, p2, k3] = distortion;
  const double x = p.x(), y = p.y(), r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
  return {x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
          y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y};
}

bool Lens::undistort(const Eigen::Vector2d& distorted, Eigen::Vector2d& p) const {
  const auto& [k1, k2, p1, p2, k3] = distortion;
  // Along the ray from the centre outwards, to stay on the branch that starts there: beyond a fold
  // of the lens there is no solution.
  p = Eigen::Vector2d::Zero();
  constexpr int kStages = 8;
  for (int stage = 1; stage <= kStages; ++stage) {
    const Eigen::Vector2d target = distorted * (static_cast<double>(stage) / kStages);
    bool converged = false;
    for (int i = 0; i < 20 && !converged; ++i) {
      const double x = p.x(), y = p.y(), r2 = x * x + y * y;
      const double radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
      // derivative of `radial`, divided by x or y
      const double slope = 2.0 * (k1 + r2 * (2.0 * k2 + 3.0 * k3 * r2));
      Eigen::Matrix2d J;
      J << radial + slope * x * x + 2.0 * p1 * y + 6.0 * p2 * x,
          slope * x * y + 2.0 * p1 * x + 2.0 * p2 * y, slope * x * y + 2.0 * p1 * x + 2.0 * p2 * y,
          radial + slope * y * y + 6.0 * p1 * y + 2.0 * p2 * x;
      if (J.determinant() <= 1e-6 || J.trace() <= 0.0) return false;
      const Eigen::Vector2d error = distort(p) - target;
      p -= J.inverse() * error;
      converged = error.norm() < 1e-10;
    }
    if (!converged) return false;
  }
  return true;
}

std::shared_ptr<const LensMap> LensMap::of(const Lens& lens, const Element& camera,
                                           const world::WorldModel& world) {
  using Key = std::tuple<int, int, std::array<double, 6>, std::array<double, 5>>;
  struct Shared {
    std::weak_ptr<const LensMap> map;
    int64_t pixels = 0;
    std::set<const world::WorldModel*> worlds;  // whose cameras have had it; only compared
  };
  static std::mutex mutex;
  static std::map<Key, Shared> all;
  const std::lock_guard lock(mutex);
  std::erase_if(all, [](const auto& entry) { return entry.second.map.expired(); });
  const Key key{lens.width,
                lens.height,
                {lens.fx, lens.fy, lens.cx, lens.cy, lens.near_m, lens.far_m},
                lens.distortion};
  int64_t pixels = pixels_of(lens);
  for (const auto& [other, shared] : all) {
    if (other != key && shared.worlds.contains(&world)) pixels += shared.pixels;
  }
  if (pixels > kMostDistortedInAll)
    camera.child("distortion")
        ->fail("the pictures of all lenses with distortion have " + std::to_string(pixels) +
               " pixels with this one; at most " + std::to_string(kMostDistortedInAll) +
               " are distorted in a world, those of equal lenses counted once");
  Shared& shared = all[key];
  std::shared_ptr<const LensMap> map = shared.map.lock();
  if (!map) map = std::make_shared<const LensMap>(lens);
  shared.map = map;
  shared.pixels = pixels_of(lens);
  shared.worlds.insert(&world);
  return map;
}

LensMap::LensMap(const Lens& lens) {
  // The position of each pixel of the lens's picture in the ideal picture.
  cv::Mat x(lens.height, lens.width, CV_32F), y(lens.height, lens.width, CV_32F);
  const float nowhere = -1e6f;
  double x_min = 0, x_max = 0, y_min = 0, y_max = 0;
  const double x_limit = kMaxGrowth * 0.5 * lens.width / lens.fx,
               y_limit = kMaxGrowth * 0.5 * lens.height / lens.fy;
  for (int v = 0; v < lens.height; ++v) {
    for (int u = 0; u < lens.width; ++u) {
      Eigen::Vector2d p;
      const bool seen = lens.undistort({(u - lens.cx) / lens.fx, (v - lens.cy) / lens.fy}, p) &&
                        std::abs(p.x()) <= x_limit && std::abs(p.y()) <= y_limit;
      x.at<float>(v, u) = seen ? static_cast<float>(p.x()) : nowhere;
      y.at<float>(v, u) = seen ? static_cast<float>(p.y()) : nowhere;
      if (!seen) continue;
      x_min = std::min(x_min, p.x());
      x_max = std::max(x_max, p.x());
      y_min = std::min(y_min, p.y());
      y_max = std::max(y_max, p.y());
    }
  }
  // The ideal picture covers all of them, with a margin of two pixels for interpolation.
  ideal_.fx = lens.fx;
  ideal_.fy = lens.fy;
  ideal_.cx = std::ceil(-x_min * lens.fx) + 2.0;
  ideal_.cy = std::ceil(-y_min * lens.fy) + 2.0;
  ideal_.width = rounded_up<int>(ideal_.cx + x_max * lens.fx) + 3;
  ideal_.height = rounded_up<int>(ideal_.cy + y_max * lens.fy) + 3;
  ideal_.near_m = lens.near_m;
  ideal_.far_m = lens.far_m;
  x = x * lens.fx + ideal_.cx;
  y = y * lens.fy + ideal_.cy;
  cv::convertMaps(x, y, fixed_, fraction_, CV_16SC2);
  cv::Mat unused;
  cv::convertMaps(x, y, nearest_, unused, CV_16SC2, true);
}

void LensMap::blend(const cv::Mat& from, cv::Mat& to) const {
  cv::remap(from, to, fixed_, fraction_, cv::INTER_LINEAR, cv::BORDER_CONSTANT, cv::Scalar::all(0));
}

void LensMap::pick(const cv::Mat& from, cv::Mat& to, double nothing) const {
  cv::remap(from, to, nearest_, cv::Mat(), cv::INTER_NEAREST, cv::BORDER_CONSTANT,
            cv::Scalar::all(nothing));
}

}  // namespace ruedo
