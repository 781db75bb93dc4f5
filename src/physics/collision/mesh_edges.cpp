// Neighbours of triangles, and filtering of Bullet's contacts with them.
#include "physics/collision/mesh_edges.h"

#include <algorithm>
#include <numeric>
#include <tuple>

namespace ruedo::physics {

namespace {

constexpr double kOnEdge = 1e-4;  // relative to the triangle's height above that edge
// Sine of the tolerance for normals that lean over an edge: meshes are read in single precision.
constexpr double kLean = 2e-3;

}  // namespace

TriangleEdges::TriangleEdges(const world::Mesh& mesh, const Vec3& scale) {
  join_vertices(mesh, scale);
  find_neighbours();
  find_rings();
}

void TriangleEdges::join_vertices(const world::Mesh& mesh, const Vec3& scale) {
  const auto key = [&](uint32_t i) {
    return std::tuple(mesh.positions[i].x(), mesh.positions[i].y(), mesh.positions[i].z());
  };
  std::vector<uint32_t> order(mesh.positions.size()), joined(mesh.positions.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(),
            [&](uint32_t a, uint32_t b) { return std::pair(key(a), a) < std::pair(key(b), b); });
  for (size_t i = 0; i < order.size(); ++i) {
    if (i == 0 || key(order[i]) != key(order[i - 1]))
      vertices_.push_back(mesh.positions[order[i]].cast<double>().cwiseProduct(scale));
    joined[order[i]] = static_cast<uint32_t>(vertices_.size() - 1);
  }
  for (const auto& t : mesh.triangles)
    triangles_.push_back({joined[t[0]], joined[t[1]], joined[t[2]]});
}

void TriangleEdges::find_neighbours() {
  neighbours_.assign(triangles_.size(), {kNone, kNone, kNone});
  struct Side {
    uint32_t low, high;
    int triangle, corner;
  };
  std::vector<Side> sides;
  for (size_t t = 0; t < triangles_.size(); ++t) {
    for (size_t i = 0; i < 3; ++i) {
      const uint32_t a = triangles_[t][i], b = triangles_[t][(i + 1) % 3];
      sides.push_back({std::min(a, b), std::max(a, b), static_cast<int>(t), static_cast<int>(i)});
    }
  }
  const auto edge = [](const Side& s) { return std::pair(s.low, s.high); };
  std::sort(sides.begin(), sides.end(), [&](const Side& a, const Side& b) {
    return std::tuple(edge(a), a.triangle, a.corner) < std::tuple(edge(b), b.triangle, b.corner);
  });
  for (size_t first = 0, end = 0; first < sides.size(); first = end) {
    while (end < sides.size() && edge(sides[end]) == edge(sides[first])) ++end;
    if (end - first != 2) continue;
    const Side &a = sides[first], &b = sides[first + 1];
    neighbours_[a.triangle][a.corner] = b.triangle;
    neighbours_[b.triangle][b.corner] = a.triangle;
  }
}

void TriangleEdges::find_rings() {
  std::vector<std::pair<uint32_t, uint32_t>> spokes;
  for (const auto& t : triangles_) {
    for (size_t i = 0; i < 3; ++i) {
      spokes.emplace_back(t[i], t[(i + 1) % 3]);
      spokes.emplace_back(t[(i + 1) % 3], t[i]);
    }
  }
  std::sort(spokes.begin(), spokes.end());
  spokes.erase(std::unique(spokes.begin(), spokes.end()), spokes.end());
  first_in_ring_.assign(vertices_.size() + 1, 0);
  for (const auto& [from, to] : spokes) {
    ++first_in_ring_[from + 1];
    ring_.push_back(to);
  }
  std::partial_sum(first_in_ring_.begin(), first_in_ring_.end(), first_in_ring_.begin());
}

bool TriangleEdges::any_around(uint32_t vertex, const std::function<bool(uint32_t)>& found) const {
  return std::any_of(ring_.begin() + static_cast<long>(first_in_ring_[vertex]),
                     ring_.begin() + static_cast<long>(first_in_ring_[vertex + 1]), found);
}

bool MeshEdges::belongs_elsewhere(int triangle, const Vec3& point, const Vec3& normal) const {
  if (triangle < 0 || static_cast<size_t>(triangle) >= triangle_count()) return false;
  const auto t = corners(triangle);
  const std::array<Vec3, 3> at{vertex(t[0]), vertex(t[1]), vertex(t[2])};
  const auto leads_there = [&](const Vec3& direction) {
    return normal.dot(direction) > kLean * direction.norm();
  };
  int on_edges = 0;
  size_t edge = 0;
  std::array<bool, 3> on{};
  for (size_t i = 0; i < 3; ++i) {
    const Vec3 &a = at[i], &b = at[(i + 1) % 3], &c = at[(i + 2) % 3];
    const Vec3 along = (b - a).normalized();
    const Vec3 inward = c - a - along * along.dot(c - a);
    on[i] = (point - a).dot(inward) < kOnEdge * inward.squaredNorm();
    if (!on[i]) continue;
    ++on_edges;
    edge = i;
  }
  if (on_edges == 0) return false;
  if (on_edges >= 2) {  // a vertex: any edge from it that comes nearer decides
    const size_t corner = on[0] && on[1] ? 1 : on[1] && on[2] ? 2 : 0;
    const auto nearer = [&](uint32_t next) { return leads_there(vertex(next) - at[corner]); };
    return any_around(t[corner], std::cref(nearer));  // a reference: nothing is allocated
  }
  const int other = neighbour(triangle, edge);
  if (other == kNone) return false;
  const size_t end = (edge + 1) % 3;
  const uint32_t from = t[edge], to = t[end];
  const auto n = corners(other);
  const auto third =
      std::find_if(n.begin(), n.end(), [&](uint32_t v) { return v != from && v != to; });
  if (third == n.end()) return false;
  const Vec3 along = (at[end] - at[edge]).normalized(), across = vertex(*third) - at[edge];
  return leads_there(across - along * along.dot(across));
}

bool has_triangles(const btCollisionShape& shape) {
  return shape.getShapeType() == TRIANGLE_MESH_SHAPE_PROXYTYPE ||
         shape.getShapeType() == TERRAIN_SHAPE_PROXYTYPE;
}

bool is_mesh(const btCollisionObject& object) {
  return has_triangles(*object.getCollisionShape()) && object.getCollisionShape()->getUserPointer();
}

MeshContacts::MeshContacts(const btCollisionObjectWrapper& a, const btCollisionObjectWrapper& b,
                           const btCollisionObject& mesh, Scratch& scratch)
    : ContactPoints(a, b, scratch),
      mesh_(mesh),
      edges_(*static_cast<const MeshEdges*>(mesh.getCollisionShape()->getUserPointer())) {}

bool MeshContacts::belongs(const btVector3& normal_on_b, const btVector3& point_on_b,
                           btScalar gap) const {
  const bool mesh_is_b = m_manifoldPtr->getBody1() == &mesh_;
  const btVector3 normal = mesh_is_b ? normal_on_b : -normal_on_b;
  const btVector3 point = mesh_is_b ? point_on_b : point_on_b + gap * normal_on_b;
  const int triangle = getBody0Internal() == &mesh_ ? m_index0 : m_index1;
  const btTransform& X_WM = mesh_.getWorldTransform();
  return !edges_.belongs_elsewhere(triangle, from_bt(X_WM.invXform(point)),
                                   from_bt(normal * X_WM.getBasis()));
}

}  // namespace ruedo::physics
