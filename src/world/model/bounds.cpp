#include "world/model/bounds.h"

#include "world/model/height_grid.h"

namespace ruedo::world {

Eigen::AlignedBox3d bounds(const Geometry& g) {
  Vec3 half = Vec3::Zero();
  switch (g.shape) {
    case Shape::box: half = g.size / 2; break;
    case Shape::sphere: half = Vec3::Constant(g.size.x()); break;
    case Shape::ellipsoid: half = g.size; break;
    case Shape::cylinder:
    case Shape::cone: half = {g.size.x(), g.size.x(), g.size.y() / 2}; break;
    case Shape::capsule: half = {g.size.x(), g.size.x(), g.size.y() / 2 + g.size.x()}; break;
    case Shape::plane: return {};
    case Shape::mesh: {
      if (const HeightGrid* grid = grid_of(*g.mesh)) {
        return {Vec3(grid->x(0), grid->y(grid->rows() - 1), grid->lowest()),
                Vec3(grid->x(grid->columns() - 1), grid->y(0), grid->highest())};
      }
      Eigen::AlignedBox3d box;
      for (const auto& p : g.mesh->positions) box.extend(g.scale.cwiseProduct(p.cast<double>()));
      return box;
    }
  }
  return {-half, half};
}

}  // namespace ruedo::world
