// Writes the benchmark's world as SDF, so that every simulator of the comparison gets the same
// walls and robots.
#include "bench/bench_world.h"

#include <cmath>

#include <fmt/format.h>

#include "base/whole.h"

namespace ruedo::bench {
namespace {

constexpr double kWallThickness_m = 0.2;
constexpr double kWallHeight_m = 1.0;
constexpr double kDoor_m = 1.2;
constexpr double kCircleRadius_m = 1.0;

class Walls {
 public:
  // A wall from (x0, y0) to (x1, y1), along one of the axes.
  void add(double x0, double y0, double x1, double y1) {
    const double length_x = std::abs(x1 - x0) + (y0 == y1 ? 0.0 : kWallThickness_m);
    const double length_y = std::abs(y1 - y0) + (x0 == x1 ? 0.0 : kWallThickness_m);
    const std::string geometry =
        fmt::format("<geometry><box><size>{:.3f} {:.3f} {:.3f}</size></box></geometry>", length_x,
                    length_y, kWallHeight_m);
    const std::string pose = fmt::format("<pose>{:.3f} {:.3f} {:.3f} 0 0 0</pose>", (x0 + x1) / 2,
                                         (y0 + y1) / 2, kWallHeight_m / 2);
    sdf_ += fmt::format(
        "        <collision name=\"c{0}\">{1}{2}</collision>\n        <visual "
        "name=\"v{0}\">{1}{2}</visual>\n",
        count_++, pose, geometry);
  }
  const std::string& sdf() const { return sdf_; }

 private:
  std::string sdf_;
  int count_ = 0;
};

}  // namespace

int rooms_on_a_side(int robots) {
  if (robots <= 16) return 4;
  int side = whole<int>(std::sqrt(static_cast<double>(robots)));
  while (side * side < robots) ++side;
  return side;
}

std::string bench_world(int robots) {
  const int side = rooms_on_a_side(robots);
  const double size = side * kRoomSize_m;
  const double half_wall = (kRoomSize_m - kDoor_m) / 2;

  Walls walls;
  walls.add(0, 0, size, 0);
  walls.add(0, size, size, size);
  walls.add(0, 0, 0, size);
  walls.add(size, 0, size, size);
  for (int line = 1; line < side; ++line) {
    const double across = line * kRoomSize_m;
    for (int room = 0; room < side; ++room) {
      const double from = room * kRoomSize_m;
      const double to = from + kRoomSize_m;
      walls.add(across, from, across, from + half_wall);
      walls.add(across, to - half_wall, across, to);
      walls.add(from, across, from + half_wall, across);
      walls.add(to - half_wall, across, to, across);
    }
  }

  std::string sdf = fmt::format(
      "<?xml version=\"1.0\"?>\n"
      "<sdf version=\"1.9\">\n"
      "  <world name=\"rooms_{}\">\n"
      "    <physics type=\"bullet\"><max_step_size>0.005</max_step_size></physics>\n"
      "    <include><uri>model://ground_plane</uri></include>\n"
      "    <model name=\"walls\">\n"
      "      <static>true</static>\n"
      "      <link name=\"link\">\n{}"
      "      </link>\n"
      "    </model>\n",
      robots, walls.sdf());
  for (int robot = 0; robot < robots; ++robot) {
    const int column = robot % side, row = robot / side;
    const double x = (column + 0.5) * kRoomSize_m + kCircleRadius_m;
    const double y = (row + 0.5) * kRoomSize_m;
    sdf += fmt::format(
        "    <include><uri>model://p3at</uri><name>r{}</name><pose>{:.3f} {:.3f} 0 0 0 "
        "1.5707963267948966</pose></include>\n",
        robot, x, y);
  }
  return sdf + "  </world>\n</sdf>\n";
}

}  // namespace ruedo::bench
