// A height map as Bullet's shape: its triangles are found by their place in the grid.
#pragma once

#include <memory>

#include <BulletCollision/CollisionShapes/btConcaveShape.h>

#include "physics/base/bullet.h"
#include "physics/collision/mesh_edges.h"
#include "world/model/height_grid.h"

namespace ruedo::physics {

// The edges of its triangles, which follow from their numbers.
class HeightEdges final : public MeshEdges {
 public:
  explicit HeightEdges(std::shared_ptr<const world::HeightGrid> grid) : grid_(std::move(grid)) {}
  const world::HeightGrid& grid() const { return *grid_; }

 private:
  size_t triangle_count() const override { return grid_->triangle_count(); }
  std::array<uint32_t, 3> corners(int triangle) const override {
    return grid_->triangle(static_cast<size_t>(triangle));
  }
  Vec3 vertex(uint32_t index) const override { return grid_->vertex(index).cast<double>(); }
  int neighbour(int triangle, size_t edge) const override;
  bool any_around(uint32_t vertex, const std::function<bool(uint32_t)>& found) const override;

  std::shared_ptr<const world::HeightGrid> grid_;
};

class HeightField : public btConcaveShape {
 public:
  explicit HeightField(std::shared_ptr<const world::HeightGrid> grid);

  void processAllTriangles(btTriangleCallback* callback, const btVector3& low,
                           const btVector3& high) const override;
  void getAabb(const btTransform& X, btVector3& low, btVector3& high) const override;
  void setLocalScaling(const btVector3&) override {}
  const btVector3& getLocalScaling() const override { return scaling_; }
  void calculateLocalInertia(btScalar, btVector3& inertia) const override { inertia.setZero(); }
  const char* getName() const override { return "HeightField"; }

 private:
  HeightEdges edges_;
  btVector3 scaling_{1, 1, 1}, low_, high_;
};

}  // namespace ruedo::physics
