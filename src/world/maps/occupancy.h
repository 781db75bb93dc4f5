// Occupancy maps: made from a world, for navigation stacks; and read from the maps of ROS, Stage
// and MobileSim users, as walls for a world.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "world/model/world_model.h"

namespace ruedo::world {

enum class Cell : uint8_t { free, occupied, unknown };

struct OccupancyGrid {
  int width = 0, height = 0;     // cells
  double resolution = 0.05;      // m, side length of a cell
  double x = 0, y = 0, yaw = 0;  // the corner of the first cell, in the world (m, m, rad)
  std::vector<Cell> cells;       // rows along x; the first row has the smallest y

  Cell& at(int column, int row) {
    return cells[static_cast<size_t>(row) * static_cast<size_t>(width) +
                 static_cast<size_t>(column)];
  }
  Cell at(int column, int row) const {
    return cells[static_cast<size_t>(row) * static_cast<size_t>(width) +
                 static_cast<size_t>(column)];
  }
};

struct Rect {
  Eigen::Vector2d low = Eigen::Vector2d::Zero(), high = Eigen::Vector2d::Zero();  // m

  Eigen::Vector2d nearest(const Eigen::Vector2d& p) const { return p.cwiseMax(low).cwiseMin(high); }
  bool has(const Eigen::Vector2d& p) const { return nearest(p) == p; }
};

// The section of a world at `height` (m, above z = 0). Leaves out robots and models that move
// along a path, cuts meshes along their outlines, and adds a margin of one metre. Cells lie at
// multiples of `resolution`. Restricted to `within` if given. Throws InputError for a map of more
// than 100 million cells.
OccupancyGrid occupancy_of(const WorldModel& world, double resolution, double height,
                           const Rect* within = nullptr);

// Marks as unknown what lies outside of the walls: the free cells from the map's edge on, unless a
// robot stands among them, or none in the map at all.
void mark_outside(const WorldModel& world, OccupancyGrid& grid);

// Writes ROS map_server files: `path` (.yaml), and a PGM of the same name beside it. Throws
// EnvironmentError if they cannot be written.
void write_map(const OccupancyGrid& grid, const std::string& path);

// Of a map: a checkerboard would need one for every other cell.
inline constexpr size_t kMostWalls = 100'000;
inline constexpr double kSmallestCell_m = 0.0001, kLargestCell_m = 1000;

// Reads a map_server YAML and its picture (PNG, PGM, BMP and others), which lies in the YAML's
// folder or below, or anywhere with allow_absolute. Findings: keys that map_server does not have.
// Throws InputError.
OccupancyGrid read_map(const std::string& yaml, Findings& findings, bool allow_absolute = false);

// Reads a picture alone (Stage's bitmaps): dark is occupied, and its centre is at the origin.
// Throws InputError.
OccupancyGrid read_bitmap(const std::string& path, double resolution);
// The same with cells such that it is so wide (m).
OccupancyGrid read_bitmap_of_width(const std::string& path, double width);

// A piece of wall on the ground: a box centred at (x, y), `length` along yaw. Metres, rad.
struct WallPiece {
  double x, y, yaw, length, width;
};

// The occupied cells as few boxes, without overlap. Throws std::runtime_error for more than
// kMostWalls.
std::vector<WallPiece> walls_of(const OccupancyGrid& grid);

// The lines of a MobileSim or ARIA map (ArMap, millimetres) as walls of that thickness; its points
// if it has no lines. `left_out` lists what else it holds; "": nothing. Throws InputError.
std::vector<WallPiece> read_armap(const std::string& path, double thickness, std::string& left_out);

// An SDF world with these walls as one static model, a ground and a sun.
std::string world_of_walls(const std::string& name, const std::vector<WallPiece>& walls,
                           double height);

}  // namespace ruedo::world
