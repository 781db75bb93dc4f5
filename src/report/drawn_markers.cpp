#include "report/drawn_markers.h"

#include <algorithm>
#include <numbers>

#include <opencv2/imgproc.hpp>

#include "engine/markers.h"
#include "ruedo/applied_t.hpp"
#include "ruedo/math.h"

namespace ruedo::report {
namespace {

using Facets = std::vector<scene::Facet>;
using Rgba = std::array<float, 4>;

constexpr int kSides = 12;          // of a point
constexpr int kTextHeight_px = 40;  // of a line, as it is drawn before it is put into the world

// The viewer's position, and the directions of the picture's sides.
struct Viewer {
  Vec3 eye, right, up, ahead;
  bool orthographic;

  explicit Viewer(const scene::View& view)
      : eye(view.X_WCamera.translation), orthographic(view.orthographic) {
    const Eigen::Matrix3d R = view.X_WCamera.rotation.toRotationMatrix();
    right = -R.col(1);
    up = R.col(2);
    ahead = R.col(0);
  }
  Vec3 towards(const Vec3& at) const { return orthographic ? Vec3(-ahead) : Vec3(eye - at); }
  // So much nearer, which does not change where it is seen: what lies on a floor is not half in it.
  Vec3 nearer(const Vec3& at, double by_m) const {
    const Vec3 way = towards(at);
    const double away_m = orthographic ? by_m + 1.0 : way.norm();
    return away_m > by_m ? Vec3(at + by_m * way.normalized()) : at;
  }
};

Rgba color_of(const marker_t& marker) {
  return {marker.color[0], marker.color[1], marker.color[2], marker.color[3]};
}

void add_quad(const std::array<Vec3, 4>& corners, const Rgba& rgba, Facets& facets) {
  facets.push_back({{corners[0], corners[1], corners[2]}, rgba});
  facets.push_back({{corners[0], corners[2], corners[3]}, rgba});
}

void add_line(const Vec3& from, const Vec3& to, double width_m, const Viewer& viewer,
              const Rgba& rgba, Facets& facets) {
  Vec3 side = (to - from).cross(viewer.towards(0.5 * (from + to)));
  if (side.norm() < 1e-12) return;  // seen from its end
  side *= 0.5 * width_m / side.norm();
  const Vec3 a = viewer.nearer(from, 0.5 * width_m), b = viewer.nearer(to, 0.5 * width_m);
  add_quad({a - side, a + side, b + side, b - side}, rgba, facets);
}

void add_point(const Vec3& place, double size_m, const Viewer& viewer, const Rgba& rgba,
               Facets& facets) {
  const Vec3 at = viewer.nearer(place, 0.5 * size_m);
  const auto corner = [&](int i) {
    const double angle = 2 * std::numbers::pi * i / kSides;
    return Vec3(at +
                0.5 * size_m * (math::cos(angle) * viewer.right + math::sin(angle) * viewer.up));
  };
  for (int i = 0; i < kSides; ++i) facets.push_back({{at, corner(i), corner(i + 1)}, rgba});
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines(1);
  for (const char c : text) {
    if (c == '\n')
      lines.emplace_back();
    else if ((c & 0xC0) != 0x80)  // one sign for each character
      lines.back() += c >= 32 && c < 127 ? c : '?';
  }
  return lines;
}

// A line of text as a rectangle for each run of pixels, its middle at that place.
void add_text_line(const std::string& text, const Vec3& middle, double height_m,
                   const Viewer& viewer, const Rgba& rgba, Facets& facets) {
  constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX, kStroke = 3;
  constexpr double kScale = 1.0;
  int baseline = 0;
  const cv::Size size = cv::getTextSize(text, kFont, kScale, kStroke, &baseline);
  if (text.empty() || size.width <= 0) return;
  cv::Mat mask = cv::Mat::zeros(kTextHeight_px, size.width + 2 * kStroke, CV_8UC1);
  cv::putText(mask, text, {kStroke, (kTextHeight_px + size.height) / 2}, kFont, kScale, {255},
              kStroke);
  const double pixel_m = height_m / kTextHeight_px;
  const auto at = [&](int column, int row) {
    return Vec3(middle + pixel_m * ((column - 0.5 * mask.cols) * viewer.right +
                                    (0.5 * mask.rows - row) * viewer.up));
  };
  for (int row = 0; row < mask.rows; ++row) {
    const uint8_t* pixels = mask.ptr<uint8_t>(row);
    for (int begin = 0, end = 0; begin < mask.cols; begin = end) {
      while (end < mask.cols && (pixels[end] != 0) == (pixels[begin] != 0)) ++end;
      if (pixels[begin] != 0)
        add_quad({at(begin, row), at(end, row), at(end, row + 1), at(begin, row + 1)}, rgba,
                 facets);
    }
  }
}

void add_text(const marker_t& marker, const Vec3& place, const Viewer& viewer, Facets& facets) {
  const std::vector<std::string> lines = lines_of(marker.text);
  for (size_t i = 0; i < lines.size(); ++i) {
    const double above = 0.5 * (static_cast<double>(lines.size()) - 1) - static_cast<double>(i);
    add_text_line(lines[i], place + above * marker.size * viewer.up, marker.size, viewer,
                  color_of(marker), facets);
  }
}

// A little above the floor that it lies on.
void add_map(const marker_t& marker, const Pose& X_WM, Facets& facets) {
  constexpr double kAbove_m = 0.01;
  for (const engine::CellRun& run : engine::runs_of(marker)) {
    const auto at = [&](int32_t column, int32_t row) {
      return X_WM * Vec3(marker.size * column, marker.size * row, kAbove_m);
    };
    add_quad({at(run.begin, run.row), at(run.end, run.row), at(run.end, run.row + 1),
              at(run.begin, run.row + 1)},
             run.color, facets);
  }
}

void add_marker(const marker_t& marker, const Pose& X_WM, const Viewer& viewer, Facets& facets) {
  if (marker.kind == marker_t::TEXT) return add_text(marker, X_WM.translation, viewer, facets);
  if (marker.kind == marker_t::MAP) return add_map(marker, X_WM, facets);
  std::vector<Vec3> points;
  for (const auto& p : marker.points) points.push_back(X_WM * Vec3(p[0], p[1], p[2]));
  const Rgba rgba = color_of(marker);
  if (marker.kind == marker_t::POINTS) {
    for (const Vec3& point : points) add_point(point, marker.size, viewer, rgba, facets);
    return;
  }
  const size_t step = marker.kind == marker_t::LINES ? 2 : 1;
  for (size_t i = 0; i + 1 < points.size(); i += step)
    add_line(points[i], points[i + 1], marker.size, viewer, rgba, facets);
}

}  // namespace

DrawnMarkers::DrawnMarkers(const log::Index& index, const std::string& path) : reader_(path) {
  for (const log::Index::Channel& channel : index.channels()) {
    if (channel.fingerprint != markers_t::getHash() && channel.fingerprint != applied_t::getHash())
      continue;
    log::Places::Cursor cursor(channel.places);
    while (const log::Place* place = cursor.next())
      places_.push_back({place->time_us, place->offset});
  }
  std::ranges::stable_sort(
      places_, {}, [](const Place& place) { return std::pair{place.time_us, place.offset}; });
}

const DrawnMarkers::Layers& DrawnMarkers::at(SimTime time_us) {
  for (; next_ < places_.size() && places_[next_].time_us <= time_us; ++next_) {
    reader_.seek(places_[next_].offset);
    if (!reader_.next(event_)) continue;
    auto markers = engine::markers_in(event_.data);
    if (!markers) continue;
    if (markers->markers.empty())
      layers_.erase(markers->layer);
    else
      layers_[markers->layer] = std::move(*markers);
  }
  return layers_;
}

void add_facets(const markers_t& markers, const Pose& X_WF, const scene::View& view,
                std::vector<scene::Facet>& facets) {
  const Viewer viewer(view);
  for (const marker_t& marker : markers.markers) {
    const auto& p = marker.position;
    const auto& q = marker.orientation;
    const Pose X_FM = Pose{Quat(q[0], q[1], q[2], q[3]), Vec3(p[0], p[1], p[2])}.normalized();
    add_marker(marker, X_WF * X_FM, viewer, facets);
  }
}

}  // namespace ruedo::report
