// Drawings of a program in the world, which the web console and logs show: the markers that
// Simulation::markers() takes.
//
// Points are in m; a color is red, green, blue, alpha, each from 0 to 1.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace ruedo::client {

using Color = std::array<float, 4>;
inline constexpr Color kBlue{0.25f, 0.7f, 1.0f, 1.0f};

// Made by the functions below; its fields are marker_t's.
struct Marker {
  int8_t kind = 0;
  std::array<double, 3> position{};
  std::array<double, 4> orientation{1.0, 0.0, 0.0, 0.0};
  Color color = kBlue;
  double size = 0.0;
  std::string text;
  std::vector<std::array<double, 3>> points;
  int32_t columns = 0;
  std::vector<uint8_t> cells;
};

// All throw std::invalid_argument for what the server would refuse.
namespace markers {

using Points = std::vector<std::array<double, 3>>;

// Points 0 and 1, points 2 and 3, ... are the ends of a line each. width: m.
Marker lines(Points points, const Color& color = kBlue, double width = 0.03);
// One line from point to point.
Marker path(Points points, const Color& color = kBlue, double width = 0.03);
// size: m.
Marker points(Points points, const Color& color = kBlue, double size = 0.05);
// A text that faces the viewer; height: of a line, m.
Marker text(std::string text, const std::array<double, 3>& place, const Color& color = kBlue,
            double height = 0.2);
// An occupancy grid: rows of cells along x from 0 (free) to 100 (occupied), 255 unknown; the first
// is at `place`, turned by the heading (rad). resolution: m, a cell's side.
Marker map(std::vector<uint8_t> cells, int32_t columns, double resolution,
           const std::array<double, 3>& place = {}, double heading = 0.0,
           const Color& color = kBlue);

}  // namespace markers
}  // namespace ruedo::client
