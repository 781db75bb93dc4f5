// Tells contacts with the surface of a triangle mesh from contacts with edges that only divide it.
//
// Bullet tests one triangle at a time. Next to the triangle that carries a ball lies another, whose
// nearest point is on their common edge: a contact there would push sideways, as if the edge stood
// out of the floor.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "physics/base/bullet.h"
#include "physics/collision/contact_points.h"
#include "world/model/world_model.h"

namespace ruedo::physics {

class MeshEdges {
 public:
  MeshEdges(const world::Mesh& mesh, const Vec3& scale);

  // Whether another part of the mesh is nearer to something in the direction of `normal` (unit)
  // from `point` on that triangle. Both in the mesh's frame, scaled.
  bool belongs_elsewhere(int triangle, const Vec3& point, const Vec3& normal) const;

 private:
  static constexpr int kNone = -1;  // no other triangle has that edge, or several do

  void join_vertices(const world::Mesh& mesh, const Vec3& scale);
  void find_neighbours();
  void find_rings();

  std::vector<Vec3> vertices_;  // without duplicates
  std::vector<std::array<uint32_t, 3>> triangles_;
  std::vector<std::array<int, 3>> neighbours_;  // across the edge from corner i to i + 1
  std::vector<size_t> first_in_ring_;           // for each vertex, in ring_
  std::vector<uint32_t> ring_;                  // vertices connected by an edge
};

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
