// Kinds and actions by visualization_msgs/Marker.
#include "bridges/ros2/messages/markers.h"

#include <algorithm>
#include <span>
#include <utility>

#include "bridges/ros2/messages/cdr.h"
#include "bridges/ros2/messages/conversions.h"
#include "engine/markers.h"

namespace ruedo::ros2 {
namespace {

enum Type : int32_t {
  kArrow = 0,
  kLineStrip = 4,
  kLineList = 5,
  kCubeList = 6,
  kSphereList = 7,
  kText = 9
};
enum Action : int32_t { kAdd = 0, kDelete = 2 };
constexpr float kFlat = 0.01f;  // a cell's height, as a share of its side

Type type_of(const marker_t& marker) {
  switch (marker.kind) {
    case marker_t::LINES: return kLineList;
    case marker_t::PATH: return kLineStrip;
    case marker_t::POINTS: return kSphereList;
    case marker_t::MAP: return kCubeList;
    default: return kText;
  }
}

void put_xyz(CdrWriter& out, double x, double y, double z) { out.put(x).put(y).put(z); }

// Of lines the width is x, of a text the height is z.
void put_scale(CdrWriter& out, const marker_t& marker) {
  const double size = marker.size;
  switch (type_of(marker)) {
    case kLineStrip:
    case kLineList: return put_xyz(out, size, 0, 0);
    case kText: return put_xyz(out, 0, 0, size);
    case kCubeList: return put_xyz(out, size, size, kFlat * size);
    default: return put_xyz(out, size, size, size);
  }
}

// The middles of the cells that are not clear, and their colours.
void put_cells(CdrWriter& out, const marker_t& map) {
  const std::vector<engine::CellRun> runs = engine::runs_of(map);
  size_t cells = 0;
  for (const engine::CellRun& run : runs) cells += static_cast<size_t>(run.end - run.begin);
  out.put_length(cells);
  for (const engine::CellRun& run : runs) {
    for (int32_t column = run.begin; column < run.end; ++column)
      put_xyz(out, map.size * (column + 0.5), map.size * (run.row + 0.5), 0);
  }
  out.put_length(cells);
  for (const engine::CellRun& run : runs) {
    for (int32_t column = run.begin; column < run.end; ++column)
      out.put_array(std::span<const float>(run.color));
  }
}

void put_points(CdrWriter& out, const marker_t& marker) {
  // A path of one corner has no line
  const bool none = marker.kind == marker_t::PATH && marker.points.size() < 2;
  out.put_length(none ? 0 : marker.points.size());
  if (!none) {
    for (const auto& point : marker.points) put_xyz(out, point[0], point[1], point[2]);
  }
  out.put_length(0);  // colours
}

void put_marker(CdrWriter& out, const marker_t& marker) {
  put_xyz(out, marker.position[0], marker.position[1], marker.position[2]);
  const double* q = marker.orientation;
  out.put(q[1]).put(q[2]).put(q[3]).put(q[0]);
  put_scale(out, marker);
  out.put_array(std::span<const float>(marker.color));
  out.put(int32_t{0}).put(uint32_t{0});  // lifetime: until the next of its name
  out.put(true);                         // goes along with its frame
  if (marker.kind == marker_t::MAP)
    put_cells(out, marker);
  else
    put_points(out, marker);
}

// Fields of other kinds only: texture, its coordinates; then the text; then a mesh.
void put_rest(CdrWriter& out, const std::string& text) {
  out.put("");
  put_header(out, 0, "");
  out.put("").put_length(0);
  out.put_length(0);
  out.put(text);
  out.put("").put("").put_length(0).put(false);
}

}  // namespace

void put_arrow(CdrWriter& out, int64_t utime, const std::string& frame, const std::string& layer,
               int32_t id, const Arrow& arrow) {
  constexpr double kShaft = 0.02, kHead = 0.04;  // m, diameters
  constexpr uint32_t kLifetime_ns = 300'000'000;
  constexpr float kRed[] = {1, 0, 0, 1};
  put_header(out, utime, frame);
  out.put(layer).put(id).put(int32_t{kArrow}).put(int32_t{kAdd});
  put_xyz(out, 0, 0, 0);
  for (const double x : {0.0, 0.0, 0.0, 1.0}) out.put(x);
  put_xyz(out, kShaft, kHead, 0);
  out.put_array(std::span<const float>(kRed));
  out.put(int32_t{0}).put(kLifetime_ns).put(false);
  out.put_length(2);
  for (const double* end : {arrow.from, arrow.to}) put_xyz(out, end[0], end[1], end[2]);
  out.put_length(0);  // colours
  put_rest(out, arrow.text);
}

std::vector<uint8_t> MarkerArrays::message(const markers_t& markers, int64_t utime,
                                           const std::string& frame) {
  const auto before = shown_.find(markers.layer);
  const size_t shown = before == shown_.end() ? 0 : before->second;
  const size_t count = markers.markers.size();
  CdrWriter out;
  out.put_length(std::max(shown, count));
  for (size_t i = 0; i < std::max(shown, count); ++i) {
    static const marker_t kNone = [] {
      marker_t none{};
      none.orientation[0] = 1;
      return none;
    }();
    const bool stays = i < count;
    const marker_t& marker = stays ? markers.markers[i] : kNone;
    put_header(out, utime, frame);
    out.put(markers.layer).put(static_cast<int32_t>(i));
    out.put(int32_t{type_of(marker)}).put(int32_t{stays ? kAdd : kDelete});
    put_marker(out, marker);
    put_rest(out, marker.text);
  }
  if (count > 0)
    shown_[markers.layer] = count;
  else if (shown > 0)
    shown_.erase(before);
  return out.bytes();
}

DrawnTopic::DrawnTopic(std::unique_ptr<Writer> writer, const Names& names)
    : writer_(std::move(writer)), names_(names) {}

void DrawnTopic::take(std::span<const uint8_t> record, int64_t utime) {
  auto markers = engine::markers_in(record);
  if (!markers) return;
  std::erase_if(layers_, [&](const markers_t& layer) { return layer.layer == markers->layer; });
  send(*markers, utime);
  if (markers->markers.empty()) return;
  if (layers_.size() >= kMostLayers) {
    markers_t oldest = std::move(layers_.front());
    layers_.erase(layers_.begin());
    oldest.n = 0;
    oldest.markers.clear();
    send(oldest, utime);
  }
  layers_.push_back(std::move(*markers));
}

void DrawnTopic::look(int64_t utime) {
  const size_t readers = writer_->readers();
  if (readers > readers_) {
    for (const markers_t& layer : layers_) send(layer, utime);
  }
  readers_ = readers;
}

void DrawnTopic::send(const markers_t& markers, int64_t utime) {
  const std::string frame =
      markers.frame.empty() ? "world" : names_.frame(markers.frame, "base_link");
  writer_->write(arrays_.message(markers, utime, frame));
}

}  // namespace ruedo::ros2
