// A height map for ray casting: the exact test of triangle meshes, on the cells that a ray passes.
#pragma once

#include <memory>

#include "scene/rays/ray_mesh.h"
#include "world/model/height_grid.h"

namespace ruedo::scene {

class RayGrid {
 public:
  // The map in frame F.
  RayGrid(std::shared_ptr<const world::HeightGrid> grid, const Pose& X_FG);

  // As RayMesh::intersect().
  void intersect(unsigned lanes, const FrameRays& rays, const double* t_max, ShapeHit* hits) const;

  Vec3 normal(int triangle) const;                            // unit, upwards
  const Box& box() const { return box_; }                     // in F
  std::array<Vec3, 4> cell(size_t row, size_t column) const;  // its corners in F, row by row

 private:
  struct Walk;
  Box box_of(size_t row, size_t row_end, size_t column, size_t column_end,
             const world::HeightGrid::Range& heights) const;
  void walk_block(size_t level, size_t row, size_t column, Walk& walk) const;
  void walk_cells(size_t row, size_t column, double enter, double exit, Walk& walk) const;
  void test_cell(size_t row, size_t column, Walk& walk) const;

  std::shared_ptr<const world::HeightGrid> grid_;
  Eigen::Matrix3d rotation_;
  Vec3 translation_;
  Box box_;
  double reach_;  // the largest coordinate, in either frame
};

}  // namespace ruedo::scene
