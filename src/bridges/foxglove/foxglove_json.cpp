#include "bridges/foxglove/foxglove_json.h"

#include <algorithm>
#include <initializer_list>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "bridges/foxglove/message_json.h"
#include "engine/markers.h"

namespace ruedo::foxglove {

void write_time(JsonWriter& json, const char* name, uint64_t time_ns) {
  json.name(name)
      .open('{')
      .member("sec", static_cast<int64_t>(time_ns / 1'000'000'000))
      .member("nsec", static_cast<int64_t>(time_ns % 1'000'000'000))
      .close('}');
}

void write_xyz(JsonWriter& json, const char* name, double x, double y, double z) {
  json.name(name)
      .open('{')
      .name("x")
      .raw(json_number(x))
      .name("y")
      .raw(json_number(y))
      .name("z")
      .raw(json_number(z))
      .close('}');
}

void write_rotation(JsonWriter& json, const char* name, double w, double x, double y, double z) {
  json.name(name)
      .open('{')
      .name("x")
      .raw(json_number(x))
      .name("y")
      .raw(json_number(y))
      .name("z")
      .raw(json_number(z))
      .name("w")
      .raw(json_number(w))
      .close('}');
}

void write_pose(JsonWriter& json, const Pose& X) {
  const Quat& q = X.rotation;
  json.name("pose").open('{');
  write_xyz(json, "position", X.translation.x(), X.translation.y(), X.translation.z());
  write_rotation(json, "orientation", q.w(), q.x(), q.y(), q.z());
  json.close('}');
}

void write_point(JsonWriter& json, const Vec3& at) {
  json.raw(fmt::format(R"({{"x": {:.7g}, "y": {:.7g}, "z": {:.7g}}})", at.x(), at.y(), at.z()));
}

void write_color(JsonWriter& json, const float* rgba) {
  json.raw(fmt::format(R"({{"r": {:.4g}, "g": {:.4g}, "b": {:.4g}, "a": {:.4g}}})", rgba[0],
                       rgba[1], rgba[2], rgba[3]));
}

namespace {

Pose pose_of(const marker_t& marker) {
  const auto& p = marker.position;
  const auto& q = marker.orientation;
  return {Quat(q[0], q[1], q[2], q[3]), Vec3(p[0], p[1], p[2])};
}

Vec3 point_of(const std::vector<float>& point) { return {point[0], point[1], point[2]}; }

template <class Points>
void write_points(JsonWriter& json, const Points& points) {
  json.name("points").open('[');
  for (const auto& point : points) write_point(json, point_of(point));
  json.close(']');
}

void write_colored(JsonWriter& json, const marker_t& marker) {
  json.name("color");
  write_color(json, marker.color);
}

void write_lines(JsonWriter& json, const marker_t& marker) {
  constexpr int kStrip = 0, kList = 2;
  json.open('{').member("type", marker.kind == marker_t::PATH ? kStrip : kList);
  write_pose(json, pose_of(marker));
  json.name("thickness").raw(json_number(marker.size)).member("scale_invariant", false);
  write_points(json, marker.points);
  write_colored(json, marker);
  json.name("colors").open('[').close(']').name("indices").open('[').close(']').close('}');
}

// Foxglove has no points: balls of their size.
void write_balls(JsonWriter& json, const marker_t& marker) {
  const Pose X = pose_of(marker);
  for (const auto& point : marker.points) {
    json.open('{');
    write_pose(json, {X.rotation, X * point_of(point)});
    write_xyz(json, "size", marker.size, marker.size, marker.size);
    write_colored(json, marker);
    json.close('}');
  }
}

void write_text(JsonWriter& json, const marker_t& marker) {
  json.open('{');
  write_pose(json, pose_of(marker));
  json.member("billboard", true).name("font_size").raw(json_number(marker.size));
  json.member("scale_invariant", false);
  write_colored(json, marker);
  json.member("text", marker.text).close('}');
}

// A rectangle for each run of cells that look alike.
void write_map(JsonWriter& json, const marker_t& marker) {
  const std::vector<engine::CellRun> runs = engine::runs_of(marker);
  json.open('{');
  write_pose(json, pose_of(marker));
  json.name("points").open('[');
  for (const engine::CellRun& run : runs) {
    for (const auto& [x, y] : {std::pair{run.begin, run.row},
                               {run.end, run.row},
                               {run.end, run.row + 1},
                               {run.begin, run.row + 1}})
      write_point(json, marker.size * Vec3(x, y, 0));
  }
  json.close(']');
  write_colored(json, marker);
  json.name("colors").open('[');
  for (const engine::CellRun& run : runs) {
    for (int corner = 0; corner < 4; ++corner) write_color(json, run.color.data());
  }
  json.close(']').name("indices").open('[');
  for (size_t i = 0; i < runs.size(); ++i) {
    for (const size_t corner : {0, 1, 2, 0, 2, 3}) json.value(static_cast<int64_t>(4 * i + corner));
  }
  json.close(']').close('}');
}

// A list of the entity: the markers that become its primitives.
void write_list(JsonWriter& json, const markers_t& markers, const char* name,
                std::initializer_list<int8_t> kinds, void (*write)(JsonWriter&, const marker_t&)) {
  json.name(name).open('[');
  for (const marker_t& marker : markers.markers) {
    if (std::ranges::find(kinds, marker.kind) != kinds.end()) write(json, marker);
  }
  json.close(']');
}

}  // namespace

std::string markers_json(const markers_t& markers, uint64_t time_ns) {
  constexpr int kThisOne = 0;
  JsonWriter json;
  json.open('{').name("deletions").open('[');
  if (markers.markers.empty()) {
    json.open('{');
    write_time(json, "timestamp", time_ns);
    json.member("type", kThisOne).member("id", markers.layer).close('}');
  }
  json.close(']').name("entities").open('[');
  if (!markers.markers.empty()) {
    json.open('{');
    write_time(json, "timestamp", time_ns);
    json.member("frame_id", markers.frame.empty() ? std::string("world") : markers.frame);
    json.member("id", markers.layer);
    write_time(json, "lifetime", 0);
    json.member("frame_locked", true);
    write_list(json, markers, "lines", {marker_t::LINES, marker_t::PATH}, write_lines);
    write_list(json, markers, "spheres", {marker_t::POINTS}, write_balls);
    write_list(json, markers, "texts", {marker_t::TEXT}, write_text);
    write_list(json, markers, "triangles", {marker_t::MAP}, write_map);
    json.close('}');
  }
  json.close(']').close('}');
  return json.text();
}

}  // namespace ruedo::foxglove
