#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "core.h"
#include "ruedo/client_markers.h"
#include "ruedo/markers_t.hpp"
#include "samples/world_info.h"

namespace ruedo::client {
namespace {

constexpr size_t kMostBytes = 65536, kMostName = 63, kMostText = 1000, kMostMarkers = 1000;
constexpr double kMostSize_m = 1000.0;

void require(bool good, const std::string& otherwise) {
  if (!good) throw std::invalid_argument(otherwise);
}

template <class Values>
bool all_finite(const Values& values) {
  return std::all_of(values.begin(), values.end(),
                     [](double value) { return std::isfinite(value); });
}

Marker made(int8_t kind, const Color& color, double size) {
  require(std::all_of(color.begin(), color.end(),
                      [](float part) { return part >= 0.0f && part <= 1.0f; }),
          "a color has four numbers from 0 to 1");
  require(size > 0.0 && size <= kMostSize_m,
          "size is " + std::to_string(size) + ": it must be above 0 m, and 1000 m at most");
  Marker marker;
  marker.kind = kind;
  marker.color = color;
  marker.size = size;
  return marker;
}

Marker with_points(int8_t kind, markers::Points points, const Color& color, double size) {
  Marker marker = made(kind, color, size);
  for (const auto& point : points) require(all_finite(point), "a point has three finite numbers");
  marker.points = std::move(points);
  return marker;
}

void place_at(Marker& marker, const std::array<double, 3>& place, double heading) {
  require(all_finite(place) && std::isfinite(heading), "a place has finite numbers");
  marker.position = place;
  marker.orientation = {std::cos(heading / 2), 0.0, 0.0, std::sin(heading / 2)};
}

marker_t message_of(const Marker& marker) {
  marker_t message{};
  message.kind = marker.kind;
  std::copy(marker.position.begin(), marker.position.end(), message.position);
  std::copy(marker.orientation.begin(), marker.orientation.end(), message.orientation);
  std::copy(marker.color.begin(), marker.color.end(), message.color);
  message.size = static_cast<float>(marker.size);
  message.text = marker.text;
  message.n = static_cast<int32_t>(marker.points.size());
  for (const auto& point : marker.points)
    message.points.push_back(
        {static_cast<float>(point[0]), static_cast<float>(point[1]), static_cast<float>(point[2])});
  message.columns = marker.columns;
  message.ncells = static_cast<int32_t>(marker.cells.size());
  message.cells = marker.cells;
  return message;
}

std::string markers_channel(Core& core) {
  const auto info = core.info();
  for (const ChannelInfo& channel : info->channel_list) {
    if (channel.input && channel.type == "markers_t") return channel.name;
  }
  throw NotSupported("this server does not accept markers");
}

}  // namespace

namespace markers {

Marker lines(Points points, const Color& color, double width) {
  require(points.size() % 2 == 0, "lines have two ends each; " + std::to_string(points.size()) +
                                      " points do not make pairs");
  return with_points(marker_t::LINES, std::move(points), color, width);
}

Marker path(Points points, const Color& color, double width) {
  return with_points(marker_t::PATH, std::move(points), color, width);
}

Marker points(Points points, const Color& color, double size) {
  return with_points(marker_t::POINTS, std::move(points), color, size);
}

Marker text(std::string text, const std::array<double, 3>& place, const Color& color,
            double height) {
  require(text.size() <= kMostText, "a text has at most 1000 bytes");
  Marker marker = made(marker_t::TEXT, color, height);
  place_at(marker, place, 0.0);
  marker.text = std::move(text);
  return marker;
}

Marker map(std::vector<uint8_t> cells, int32_t columns, double resolution,
           const std::array<double, 3>& place, double heading, const Color& color) {
  require(columns >= 1 && !cells.empty() && cells.size() % static_cast<size_t>(columns) == 0,
          std::to_string(cells.size()) + " cells do not fill rows of " + std::to_string(columns));
  require(std::all_of(cells.begin(), cells.end(),
                      [](uint8_t cell) { return cell <= 100 || cell == 255; }),
          "a cell is 0 to 100, or 255 where it is unknown");
  Marker marker = made(marker_t::MAP, color, resolution);
  place_at(marker, place, heading);
  marker.columns = columns;
  marker.cells = std::move(cells);
  return marker;
}

}  // namespace markers

void Simulation::markers(const std::string& layer, const std::vector<Marker>& markers,
                         const std::string& frame) const {
  require(!layer.empty() && layer.size() <= kMostName, "a layer is a name of 1 to 63 bytes");
  require(markers.size() <= kMostMarkers, "a layer has at most 1000 markers");
  const std::shared_ptr<Core> core = this->core();
  core->check_open();
  markers_t message{};
  message.utime = core->utime();
  message.layer = layer;
  message.frame = frame;
  message.n = static_cast<int32_t>(markers.size());
  for (const Marker& marker : markers) message.markers.push_back(message_of(marker));
  require(static_cast<size_t>(message.getEncodedSize()) <= kMostBytes,
          "a layer has at most 65536 bytes: use several");
  core->bus().publish(markers_channel(*core), message);
}

}  // namespace ruedo::client
