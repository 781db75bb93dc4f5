#include "world/read/triangle_count.h"

#include <algorithm>

#include "world/model/height_grid.h"
#include "world/model/world_model.h"
#include "world/read/read_context.h"

namespace ruedo::world {

void TriangleCount::add(const std::shared_ptr<const Mesh>& mesh, const Vec3& scale,
                        const Element& shape) {
  constexpr size_t kHeightsOfTriangle = 25;  // a height takes little memory
  if (!seen_.insert({mesh, scale.x(), scale.y(), scale.z()}).second) return;
  const HeightGrid* grid = grid_of(*mesh);
  triangles_ += static_cast<int64_t>(grid ? grid->vertex_count() / kHeightsOfTriangle
                                          : mesh->triangles.size());
  if (triangles_ <= kMostTriangles) return;
  throw TooLarge(shape.source,
                 "<" + shape.name + ">: the meshes have more than " +
                     std::to_string(kMostTriangles) +
                     " triangles in all with this one; each counts once for every scale");
}

namespace {

// Of a model's collisions; 0 if it moves.
int64_t placed_triangles(const Model& model) {
  const bool is_fixed =
      model.is_static || std::any_of(model.joints.begin(), model.joints.end(),
                                     [](const Joint& joint) { return !joint.parent.valid(); });
  if (!is_fixed) return 0;
  int64_t triangles = 0;
  for (const Link& link : model.links) {
    for (const Collision& collision : link.collisions) {
      if (collision.geometry.mesh)
        triangles += static_cast<int64_t>(collision.geometry.mesh->triangles.size());
    }
  }
  return triangles;
}

}  // namespace

std::string placed_triangles_fault(const WorldModel& world, const Model* more) {
  int64_t triangles = more ? placed_triangles(*more) : 0;
  for (const ModelInstance& instance : world.models)
    if (!instance.removed) triangles += placed_triangles(*instance.model);
  if (triangles <= kMostPlacedTriangles) return "";
  return "the collisions of what stands still have more than " +
         std::to_string(kMostPlacedTriangles) + " triangles in all";
}

}  // namespace ruedo::world
