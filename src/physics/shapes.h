// Collision geometry as Bullet's shapes. Primitives are exact; a mesh that never moves is the mesh
// itself, one that moves becomes convex pieces, and says so where that changes it.
#pragma once

#include <map>
#include <memory>
#include <tuple>
#include <vector>

#include "model/world_model.h"
#include "physics/bullet.h"

namespace ruedo::physics {

// Makes and owns shapes; those of one mesh at one scale are shared. Must outlive all that use its
// shapes.
class ShapeFactory {
 public:
  ShapeFactory();
  ~ShapeFactory();

  // For a body that never moves. Null for a mesh without triangles. Planes: through the origin.
  btCollisionShape* fixed(const model::Geometry& geometry);

  // For a body that moves: one shape, or for a mesh the convex hull of each connected part. Appends
  // to `shapes`; nothing is appended for a plane, which cannot move. Returns false when the shape
  // is not quite the geometry: a concave mesh.
  bool moving(const model::Geometry& geometry, std::vector<btCollisionShape*>& shapes);

  // A wheel of that radius and width about its z axis (m).
  btCollisionShape* tyre(double radius, double width);

 private:
  struct Triangles;
  struct Pieces {
    std::vector<btCollisionShape*> hulls;
    bool exact = true;
  };
  using MeshKey =
      std::tuple<const model::Mesh*, double, double, double>;  // looked up, never iterated

  btCollisionShape* primitive(const model::Geometry& geometry);
  template <class Shape>
  Shape* own(std::unique_ptr<Shape> shape) {
    Shape* raw = shape.get();
    shapes_.push_back(std::move(shape));
    return raw;
  }

  std::vector<std::unique_ptr<Triangles>> triangles_;
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  std::map<MeshKey, btCollisionShape*> fixed_meshes_;
  std::map<MeshKey, Pieces> moving_meshes_;
};

}  // namespace ruedo::physics
