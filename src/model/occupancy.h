// Occupancy maps: of a world, for navigation stacks; and from the maps that users of ROS, Stage and
// MobileSim have, as walls for a world.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "model/world_model.h"

namespace ruedo::model {

enum class Cell : uint8_t { free, occupied, unknown };

struct OccupancyGrid {
  int width = 0, height = 0;     // cells
  double resolution = 0.05;      // m, of a cell's side
  double x = 0, y = 0, yaw = 0;  // of the corner of the first cell, in the world (m, m, rad)
  std::vector<Cell> cells;       // rows along x, the first row at the smallest y

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

// What of a world a horizontal plane at `height` (m, above z = 0) cuts: robots and what moves along
// a path left out, meshes as their outlines, with a metre of free cells around. Cells lie at
// multiples of `resolution`. Of a part of the world where `within` says so. Throws InputError for a
// map of more than 100 million cells.
OccupancyGrid occupancy_of(const WorldModel& world, double resolution, double height,
                           const Rect* within = nullptr);

// As ROS's map_server reads it: `path` (.yaml), and the picture beside it, a PGM of the same name.
// Throws EnvironmentError when they cannot be written.
void write_map(const OccupancyGrid& grid, const std::string& path);

// A map_server YAML with its picture, of which PNG, PGM, BMP and more are read. Throws InputError.
OccupancyGrid read_map(const std::string& yaml);

// A picture alone (Stage's bitmaps): dark is occupied, its middle is at the origin. Throws
// InputError.
OccupancyGrid read_bitmap(const std::string& path, double resolution);

// A piece of wall that stands on the ground: a box about (x, y), `length` along yaw. Metres, rad.
struct WallPiece {
  double x, y, yaw, length, width;
};

// The occupied cells as few boxes, which share no cell.
std::vector<WallPiece> walls_of(const OccupancyGrid& grid);

// The lines of a map of MobileSim and ARIA (ArMap, millimetres), as walls of that thickness; its
// points where it has no lines. `left_out`: in words, what else it holds, "" for nothing. Throws
// InputError.
std::vector<WallPiece> read_armap(const std::string& path, double thickness, std::string& left_out);

// A world of one static model with these walls, ground and sun, as SDF.
std::string world_of_walls(const std::string& name, const std::vector<WallPiece>& walls,
                           double height);

}  // namespace ruedo::model
