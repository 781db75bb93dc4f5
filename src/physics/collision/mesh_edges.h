// Tells contacts with the surface of a triangle mesh from contacts with edges that only divide it.
//
// Bullet tests one triangle at a time. Next to the triangle that carries a ball lies another, whose
// nearest point is on their common edge: a contact there would push sideways, as if the edge stood
// out of the floor.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "physics/base/bullet.h"
#include "physics/collision/contact_points.h"
#include "world/model/world_model.h"

namespace ruedo::physics {

class MeshEdges {
 public:
  virtual ~MeshEdges() = default;

  // Whether another part of the mesh is nearer to something in the direction of `normal` (unit)
  // from `point` on that triangle. Both in the mesh's frame, scaled.
  bool belongs_elsewhere(int triangle, const Vec3& point, const Vec3& normal) const;

 protected:
  static constexpr int kNone = -1;  // no other triangle has that edge, or several do

 private:
  virtual size_t triangle_count() const = 0;
  virtual std::array<uint32_t, 3> corners(int triangle) const = 0;  // vertices, counter-clockwise
  virtual Vec3 vertex(uint32_t index) const = 0;
  // The triangle across the edge from corner `edge` to the next.
  virtual int neighbour(int triangle, size_t edge) const = 0;
  // Whether an edge from the vertex leads to one of which found() is true.
  virtual bool any_around(uint32_t vertex, const std::function<bool(uint32_t)>& found) const = 0;
};

class TriangleEdges final : public MeshEdges {
 public:
  TriangleEdges(const world::Mesh& mesh, const Vec3& scale);

 private:
  size_t triangle_count() const override { return triangles_.size(); }
  std::array<uint32_t, 3> corners(int triangle) const override { return triangles_[triangle]; }
  Vec3 vertex(uint32_t index) const override { return vertices_[index]; }
  int neighbour(int triangle, size_t edge) const override { return neighbours_[triangle][edge]; }
  bool any_around(uint32_t vertex, const std::function<bool(uint32_t)>& found) const override;

  void join_vertices(const world::Mesh& mesh, const Vec3& scale);
  void find_neighbours();
  void find_rings();

  std::vector<Vec3> vertices_;  // without duplicates
  std::vector<std::array<uint32_t, 3>> triangles_;
  std::vector<std::array<int, 3>> neighbours_;  // across the edge from corner i to i + 1
  std::vector<size_t> first_in_ring_;           // for each vertex, in ring_
  std::vector<uint32_t> ring_;                  // vertices connected by an edge
};

bool has_triangles(const btCollisionShape& shape);  // a static mesh, or a height map
bool is_mesh(const btCollisionObject& object);

// Of a pair with a static mesh.
class MeshContacts final : public ContactPoints {
 public:
  MeshContacts(const btCollisionObjectWrapper& a, const btCollisionObjectWrapper& b,
               const btCollisionObject& mesh, Scratch& scratch);

 private:
  bool belongs(const btVector3& normal_on_b, const btVector3& point_on_b,
               btScalar gap) const override;
  const btCollisionObject& mesh_;
  const MeshEdges& edges_;
};

}  // namespace ruedo::physics
