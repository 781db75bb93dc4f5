#include "report/render_view.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <vector>

#include "ruedo/errors.h"
#include "ruedo/math.h"

namespace ruedo::report {
namespace {

constexpr int kMaxSide = 8192;
constexpr Size kDefaultSize{1280, 960};
constexpr double kHfov = 0.9;        // rad
constexpr double kPlacedHfov = 1.2;  // rad, of an eye whose place is given
constexpr double kIsoYaw = 1.1;      // rad, or a quarter, half, ... turn more
constexpr double kMargin = 1.06;     // around what is framed

std::vector<double> numbers(const std::string& text) {
  std::vector<double> values;
  const char* at = text.data();
  const char* end = at + text.size();
  while (at < end) {
    double value = 0.0;
    const auto [next, error] = std::from_chars(at, end, value);
    if (error != std::errc() || !std::isfinite(value) || (next != end && *next != ',')) return {};
    values.push_back(value);
    at = next == end ? end : next + 1;
  }
  return values;
}

scene::View from_above(Size size, const scene::Bounds& bounds) {
  const Vec3 extent = kMargin * (bounds.high - bounds.low).cwiseMax(0.5),
             middle = 0.5 * (bounds.low + bounds.high);
  if (size.width == 0) {
    // The world's own proportions, within reason.
    const double ratio = std::clamp(extent.y() / extent.x(), 0.4, 1.5);
    size = {kDefaultSize.width, static_cast<int>(kDefaultSize.width * ratio)};
  }
  scene::View view = scene::View::pinhole(
      Pose::from_xyz_rpy({middle.x(), middle.y(), bounds.high.z() + 1.0}, {0, M_PI / 2, M_PI / 2}),
      size.width, size.height, kHfov);
  view.orthographic = true;
  view.fx = view.fy = std::min(size.width / extent.x(), size.height / extent.y());
  view.near_m = 0.5;
  view.far_m = extent.z() + 20.0;
  return view;
}

scene::View at_an_angle(Size size, const scene::Bounds& bounds, const Vec3& sunlight) {
  if (size.width == 0) size = kDefaultSize;
  const Vec3 middle = 0.5 * (bounds.low + bounds.high);
  // Down at 43 degrees, and across the axes: of four directions the one that goes best with the
  // light.
  double yaw = kIsoYaw, best = -2.0;
  for (int quarter = 0; quarter < 4; ++quarter) {
    const double candidate = kIsoYaw + quarter * M_PI / 2;
    const double along = math::cos(candidate - math::atan2(sunlight.y(), sunlight.x()));
    if (along > best + 1e-9) {
      best = along;
      yaw = candidate;
    }
  }
  const Quat rotation = Pose::from_xyz_rpy(Vec3::Zero(), {0, 0.75, yaw}).rotation;
  scene::View view = scene::View::pinhole({rotation, middle}, size.width, size.height, kHfov);
  // As near as all corners of the bounds allow.
  const double tan_h = 0.5 * size.width / view.fx / kMargin,
               tan_v = 0.5 * size.height / view.fy / kMargin;
  double distance = 0.1;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 p((corner & 1) != 0 ? bounds.high.x() : bounds.low.x(),
                 (corner & 2) != 0 ? bounds.high.y() : bounds.low.y(),
                 (corner & 4) != 0 ? bounds.high.z() : bounds.low.z());
    const Vec3 q = rotation.conjugate() * (p - middle);  // ahead, left, up
    distance =
        std::max({distance, std::abs(q.y()) / tan_h - q.x(), std::abs(q.z()) / tan_v - q.x()});
  }
  view.X_WCamera.translation = middle - rotation * Vec3(distance, 0, 0);
  view.near_m = 0.02 * distance;
  view.far_m = 20.0 * distance + 500.0;
  return view;
}

}  // namespace

std::optional<double> parse_number(const std::string& text) {
  const std::vector<double> values = numbers(text);
  return values.size() == 1 && text.find(',') == std::string::npos ? std::optional(values[0])
                                                                   : std::nullopt;
}

Size parse_size(const std::string& text) {
  Size size;
  const char* end = text.data() + text.size();
  const auto [x, error] = std::from_chars(text.data(), end, size.width);
  if (error == std::errc() && x != end && *x == 'x') {
    const auto [last, error2] = std::from_chars(x + 1, end, size.height);
    if (error2 == std::errc() && last == end && size.width >= 1 && size.height >= 1 &&
        size.width <= kMaxSide && size.height <= kMaxSide) {
      return size;
    }
  }
  throw InputError({}, "--size " + text + ": allowed is WIDTHxHEIGHT in pixels, each from 1 to " +
                           std::to_string(kMaxSide));
}

scene::View parse_view(const std::string& text, Size size, const scene::Bounds& bounds,
                       const Vec3& sunlight) {
  if (text == "top") return from_above(size, bounds);
  if (text == "iso") return at_an_angle(size, bounds, sunlight);
  const std::vector<double> v = numbers(text);
  if (v.size() != 6)
    throw InputError({},
                     "--view " + text + ": allowed are top, iso and x,y,z,roll,pitch,yaw (m, rad)");
  if (size.width == 0) size = kDefaultSize;
  scene::View view =
      scene::View::pinhole(Pose::from_xyz_rpy({v[0], v[1], v[2]}, {v[3], v[4], v[5]}), size.width,
                           size.height, kPlacedHfov);
  view.near_m = 0.02;
  view.far_m = 1000.0;
  return view;
}

}  // namespace ruedo::report
