// Collision geometry as Bullet's shapes. Primitives are exact. A static mesh is the mesh itself; a
// moving one becomes convex pieces, which is reported if it changes the shape.
#pragma once

#include <map>
#include <memory>
#include <tuple>
#include <vector>

#include "physics/base/bullet.h"
#include "world/model/world_model.h"

namespace ruedo::physics {

// Creates and owns shapes; those of the same mesh and scale are shared. Must outlive all users of
// its shapes.
class ShapeFactory {
 public:
  // colliding: hulls have a bounded number of vertices, which are moved by up to 1e-4 of their
  // size. exact: they are the mesh's own.
  enum class Hulls { colliding, exact };
  explicit ShapeFactory(Hulls hulls = Hulls::colliding);
  ~ShapeFactory();

  // For a static body. Null for a mesh without triangles. Planes pass through the origin.
  btCollisionShape* fixed(const world::Geometry& geometry);

  // For a moving body: one shape, or for a mesh its convex pieces, or the convex hull of each
  // connected part if it has none or is a wheel. Appends to `shapes`; nothing for a plane, which
  // cannot move. Returns false if the shape differs from the geometry: for a concave mesh.
  bool moving(const world::Geometry& geometry, bool is_wheel,
              std::vector<btCollisionShape*>& shapes);

  // A wheel with that radius and width about its z axis (m).
  btCollisionShape* tyre(double radius, double width);

 private:
  struct Triangles;
  struct Pieces {
    std::vector<btCollisionShape*> hulls;
    bool exact = true;
  };
  // Only looked up, never iterated.
  using MeshKey = std::tuple<const world::Mesh*, double, double, double>;

  Pieces pieces_of(const world::Geometry& geometry, const world::Mesh* convex);

  btCollisionShape* primitive(const world::Geometry& geometry);
  template <class Shape>
  Shape* own(std::unique_ptr<Shape> shape) {
    Shape* raw = shape.get();
    shapes_.push_back(std::move(shape));
    return raw;
  }

  const Hulls hulls_;
  std::vector<std::unique_ptr<Triangles>> triangles_;
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  std::map<MeshKey, btCollisionShape*> fixed_meshes_;
  std::map<MeshKey, Pieces> moving_meshes_;
};

}  // namespace ruedo::physics
