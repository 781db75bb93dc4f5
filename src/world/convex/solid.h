// A closed mesh and what planes cut off it: volumes and convex hulls.
#pragma once

#include <cmath>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "world/convex/convex_pieces.h"

namespace ruedo::world {

using Triangle = std::array<Eigen::Vector3d, 3>;

// The points with normal * x >= distance.
struct HalfSpace {
  Eigen::Vector3d normal;  // of length 1
  double distance = 0.0;
  double above(const Eigen::Vector3d& x) const { return normal.dot(x) - distance; }
};

// An edge where the solid's surface bends inwards.
struct ConcaveEdge {
  Eigen::Vector3d from, to;
  Eigen::Vector3d normal1, normal2;  // of its two triangles
};

double volume_of(std::span<const Triangle> surface);
ConvexPiece hull_of(const std::vector<Eigen::Vector3d>& points);
double volume_of(const ConvexPiece& hull);

// The concave edges of a closed surface; nullopt: it is not closed.
std::optional<std::vector<ConcaveEdge>> concave_edges(std::span<const Triangle> surface);

// The part of a solid in some half-spaces. Lengths below `kTiny` count as 0: solids are of size 1.
class Part {
 public:
  static constexpr double kTiny = 1e-5;

  // whole: outlives the part.
  Part(std::span<const Triangle> whole, std::vector<ConcaveEdge> concave);

  // The part in the half-space; nullopt: nothing, or all.
  std::optional<Part> in(const HalfSpace& half) const;

  std::span<const ConcaveEdge> concave() const { return concave_; }
  double volume() const { return volume_; }
  double hull_volume() const { return hull_volume_; }
  double excess() const { return hull_volume_ - volume_; }
  double section() const { return std::abs(section_); }  // the area of the last cut
  std::vector<Eigen::Vector3d> corners() const;          // its hull is the part's

 private:
  Part() = default;
  void cut(const Triangle& triangle, const HalfSpace& half, std::vector<Triangle>& kept,
           std::vector<std::array<Eigen::Vector3d, 2>>& rim) const;
  void find_inner_corners(const HalfSpace& half);
  void measure();

  std::span<const Triangle> whole_;
  std::vector<HalfSpace> cell_;
  std::vector<Triangle> surface_;  // of the whole, in the cell
  // Closes the surface, as a sum of signed triangles: they may overlap and cancel each other. That
  // gives the right volume without a triangulation of the sections, however many rims they have.
  std::vector<Triangle> caps_;
  std::vector<Eigen::Vector3d> inner_corners_;  // where three planes meet inside of the whole
  std::vector<ConcaveEdge> concave_;
  double volume_ = 0.0, hull_volume_ = 0.0, section_ = 0.0;
};

}  // namespace ruedo::world
