/// @file
// Occupancy maps of Ruedo's client for C++. ruedo/client.h includes it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace ruedo::client {

/// An occupancy map: cells by rows, the southernmost first; 0 free, 100 occupied, -1 unknown.
class Map {
 public:
  /// The pose of the map in the world.
  struct Origin {
    double x = 0.0;        ///< m, of the south-western corner
    double y = 0.0;        ///< m
    double heading = 0.0;  ///< rad
  };

  /// @param cells by rows
  /// @param columns cells in a row
  /// @param resolution m, of a cell
  /// @param origin of the first cell's corner
  /// @throws std::invalid_argument for cells that do not fill whole rows, or a resolution that is
  /// not above 0
  Map(std::vector<int8_t> cells, size_t columns, double resolution, const Origin& origin);
  [[nodiscard]] const std::vector<int8_t>& cells() const { return cells_; }  ///< @return by rows
  size_t columns() const { return columns_; }               ///< @return cells in a row
  size_t rows() const { return cells_.size() / columns_; }  ///< @return rows
  double resolution() const { return resolution_; }         ///< @return m
  /// @param x m, world
  /// @param y m, world
  /// @return the cell there; -1 outside of the map
  [[nodiscard]] int at(double x, double y) const;
  /// @param x m, world
  /// @param y m, world
  /// @return whether that place is occupied
  [[nodiscard]] bool occupied(double x, double y) const { return at(x, y) == 100; }
  /// @return by rows: m from the middle of each cell to that of the nearest occupied one; +inf
  /// without one. Exact (Felzenszwalb and Huttenlocher 2012, by rows and then columns)
  [[nodiscard]] std::vector<double> distance_field() const;
  /// @param radius m, of a robot
  /// @return the map in which every cell within that radius of an occupied one is occupied
  [[nodiscard]] Map inflated(double radius) const;
  /// @param x m, world
  /// @param y m, world
  /// @param angle rad, of the world
  /// @param max_range m
  /// @return m to where the ray enters an occupied cell; +inf where it meets none within max_range,
  /// 0 from within one. Goes from cell to cell (Amanatides and Woo 1987)
  [[nodiscard]] double ray(double x, double y, double angle, double max_range = 30.0) const;
  const Origin& origin() const { return origin_; }  ///< @return of the first cell's corner
  /// Writes NAME.yaml and NAME.pgm, as map_server of ROS reads them.
  /// @param path NAME.yaml
  /// @throws std::invalid_argument for another name; Error for what cannot be written
  void save(const std::string& path) const;

 private:
  void to_cells(double x, double y, double& column, double& row) const;
  bool inside(int64_t column, int64_t row) const;

  std::vector<int8_t> cells_;
  size_t columns_;
  double resolution_;
  Origin origin_;
};

/// Reads what `ruedo map`, Map::save() and map_server of ROS write: NAME.yaml, and the PGM that it
/// names.
/// @param path NAME.yaml
/// @return the map
/// @throws Error, which names the file and what is wrong with it
Map load_map(const std::string& path);

}  // namespace ruedo::client
