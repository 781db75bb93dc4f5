#include "engine/markers.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "base/utf8.h"
#include "ruedo/applied_t.hpp"
#include "ruedo/decode.h"
#include "ruedo/schema.h"

namespace ruedo::engine {
namespace {

constexpr size_t kMostName = 63, kMostText = 1000;  // bytes
constexpr size_t kMostMarkers = 1000;
constexpr float kMostSize_m = 1000.0f;
constexpr double kMostAway_m = 1e6;
constexpr uint8_t kMostCell = 100, kUnknown = 255;

bool is_utf8(const std::string& text) { return printable(text) == text; }

bool is_within(double value, double least, double most) { return value >= least && value <= most; }

// For any kind.
std::string check_place(const marker_t& marker) {
  for (const double value : marker.position) {
    if (!is_within(value, -kMostAway_m, kMostAway_m))
      return fmt::format("position {} is not within {:g} m", value, kMostAway_m);
  }
  double norm = 0.0;
  for (const double value : marker.orientation) norm += value * value;
  if (!is_within(norm, 0.9, 1.1)) return "orientation is not a unit quaternion w, x, y, z";
  for (const float value : marker.color) {
    if (!is_within(value, 0.0, 1.0)) return fmt::format("color {} is not from 0 to 1", value);
  }
  if (!(marker.size > 0.0f && marker.size <= kMostSize_m))
    return fmt::format("size {} m is not above 0 and at most {:g} m", marker.size, kMostSize_m);
  for (const auto& point : marker.points) {
    for (const float value : point) {
      if (!is_within(value, -kMostAway_m, kMostAway_m))
        return fmt::format("point {} is not within {:g} m", value, kMostAway_m);
    }
  }
  return "";
}

std::string check_map(const marker_t& marker) {
  if (marker.columns < 1 || marker.ncells < 1 || marker.ncells % marker.columns != 0)
    return fmt::format("{} cells do not fill rows of {} columns", marker.ncells, marker.columns);
  const auto wrong = std::find_if(marker.cells.begin(), marker.cells.end(), [](uint8_t cell) {
    return cell > kMostCell && cell != kUnknown;
  });
  return wrong == marker.cells.end()
             ? ""
             : fmt::format("cell {} is not from 0 to {}, or {}", *wrong, kMostCell, kUnknown);
}

std::string check_kind(const marker_t& marker) {
  switch (marker.kind) {
    case marker_t::LINES:
      return marker.n % 2 == 0 ? "" : fmt::format("{} points do not make pairs", marker.n);
    case marker_t::PATH:
    case marker_t::POINTS: return "";
    case marker_t::TEXT:
      if (marker.text.size() > kMostText)
        return fmt::format("text has {} bytes, {} are allowed", marker.text.size(), kMostText);
      return is_utf8(marker.text) ? "" : "text is not UTF-8";
    case marker_t::MAP: return check_map(marker);
    default: return fmt::format("there is no kind {}", marker.kind);
  }
}

}  // namespace

std::string check_markers(const markers_t& markers) {
  if (markers.layer.empty() || markers.layer.size() > kMostName || !is_utf8(markers.layer))
    return fmt::format("layer is a name of 1 to {} bytes, UTF-8", kMostName);
  if (markers.frame.size() > kMostName || !is_utf8(markers.frame))
    return fmt::format("frame is a robot's name of at most {} bytes, UTF-8", kMostName);
  if (markers.markers.size() > kMostMarkers)
    return fmt::format("{} markers, {} are allowed", markers.markers.size(), kMostMarkers);
  for (size_t i = 0; i < markers.markers.size(); ++i) {
    std::string why = check_place(markers.markers[i]);
    if (why.empty()) why = check_kind(markers.markers[i]);
    if (!why.empty()) return fmt::format("marker {}: {}", i, why);
  }
  return "";
}

std::optional<markers_t> markers_in(std::span<const uint8_t> message) {
  applied_t applied;
  const bool is_applied = fingerprint_of(message) == applied_t::getHash();
  if (is_applied) {
    if (decode_checked(message.data(), message.size(), applied) != DecodeFault::none)
      return std::nullopt;
    message = applied.data;
  }
  markers_t markers;
  if (fingerprint_of(message) != markers_t::getHash() ||
      decode_checked(message.data(), message.size(), markers) != DecodeFault::none ||
      !check_markers(markers).empty())
    return std::nullopt;
  return markers;
}

std::array<float, 4> cell_color(uint8_t cell, const float* color) {
  if (cell == kUnknown) return {0.5f, 0.5f, 0.5f, color[3] / 4};
  return {color[0], color[1], color[2], color[3] * static_cast<float>(cell) / kMostCell};
}

std::vector<CellRun> runs_of(const marker_t& map) {
  std::vector<CellRun> runs;
  const int32_t rows = map.columns > 0 ? map.ncells / map.columns : 0;
  for (int32_t row = 0; row < rows; ++row) {
    const uint8_t* cells = map.cells.data() + static_cast<ptrdiff_t>(row) * map.columns;
    for (int32_t begin = 0, end = 0; begin < map.columns; begin = end) {
      while (end < map.columns && cells[end] == cells[begin]) ++end;
      if (cells[begin] != 0) runs.push_back({row, begin, end, cell_color(cells[begin], map.color)});
    }
  }
  return runs;
}

}  // namespace ruedo::engine
