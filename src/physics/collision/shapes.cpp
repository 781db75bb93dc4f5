// Converts geometry to Bullet's shapes: margins that keep primitives exact, triangle meshes with an
// unquantised BVH (a quantised one loses contacts), and hulls of the connected parts of moving
// meshes.
#include "physics/collision/shapes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include <LinearMath/btConvexHullComputer.h>

#include "physics/collision/convex_shapes.h"
#include "physics/collision/height_field.h"
#include "physics/collision/mesh_edges.h"
#include "ruedo/math.h"

namespace ruedo::physics {

namespace {

// Bullet rounds the edges of boxes and cylinders by the margin, without changing their size; its
// default, 40 mm, is as large as a robot's wheel.
constexpr double kMargin_m = 1e-3;
constexpr size_t kMaxPieces = 64;
constexpr size_t kMaxHullVertices = 128;
// A mesh is concave if its hulls, or its convex pieces, enclose that much more volume than it does.
constexpr double kConcavity = 0.02, kConcavityOfPieces = 0.05;

double margin_for(double smallest_half_size) {
  return std::min(kMargin_m, 0.1 * smallest_half_size);
}

btVector3 scaled(const Eigen::Vector3f& p, const Vec3& scale) {
  return {p.x() * scale.x(), p.y() * scale.y(), p.z() * scale.z()};
}

// Labels every vertex with its connected part; vertices in the same place are one.
std::vector<int> connected_parts(const world::Mesh& mesh, int& count) {
  const size_t n = mesh.positions.size();
  std::vector<uint32_t> order(n), parent(n);
  std::iota(order.begin(), order.end(), 0u);
  std::iota(parent.begin(), parent.end(), 0u);
  const auto root = [&](uint32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  const auto key = [&](uint32_t i) {
    const Eigen::Vector3f& p = mesh.positions[i];
    return std::array<float, 3>{p.x(), p.y(), p.z()};
  };
  std::sort(order.begin(), order.end(),
            [&](uint32_t a, uint32_t b) { return std::pair(key(a), a) < std::pair(key(b), b); });
  for (size_t i = 1; i < n; ++i) {
    if (key(order[i]) == key(order[i - 1])) parent[root(order[i])] = root(order[i - 1]);
  }
  for (const auto& triangle : mesh.triangles) {
    parent[root(triangle[1])] = root(triangle[0]);
    parent[root(triangle[2])] = root(triangle[0]);
  }
  std::vector<int> label(n, -1), part(n);
  count = 0;
  for (size_t i = 0; i < n; ++i) {
    int& of_root = label[root(static_cast<uint32_t>(i))];
    if (of_root < 0) of_root = count++;
    part[i] = of_root;
  }
  return part;
}

double volume_of(const btConvexHullComputer& hull) {
  double six_volumes = 0.0;
  for (int f = 0; f < hull.faces.size(); ++f) {
    const btConvexHullComputer::Edge* first = &hull.edges[hull.faces[f]];
    const btVector3& a = hull.vertices[first->getSourceVertex()];
    for (const auto* edge = first->getNextEdgeOfFace();
         edge->getTargetVertex() != first->getSourceVertex(); edge = edge->getNextEdgeOfFace()) {
      const btVector3& b = hull.vertices[edge->getSourceVertex()];
      const btVector3& c = hull.vertices[edge->getTargetVertex()];
      six_volumes += a.dot(b.cross(c));
    }
  }
  return std::abs(six_volumes) / 6.0;
}

// The vertices of the convex hull of `points`; if there are too many and it need not be exact, only
// the extreme ones in evenly distributed directions.
std::unique_ptr<btConvexHullShape> hull_of(const std::vector<btVector3>& points, bool exact,
                                           double& volume) {
  btConvexHullComputer computer;
  computer.compute(&points[0].m_floats[0], sizeof(btVector3), static_cast<int>(points.size()), 0,
                   0);
  volume += volume_of(computer);
  auto shape = std::make_unique<SeenAhead<HullShape>>();
  const int corners = computer.vertices.size();
  const bool all = exact || corners <= static_cast<int>(kMaxHullVertices);
  std::vector<bool> keep(static_cast<size_t>(corners), all);
  if (!all) {
    for (size_t i = 0; i < kMaxHullVertices; ++i) {  // a Fibonacci sphere
      const double z = 1.0 - (2.0 * static_cast<double>(i) + 1.0) / kMaxHullVertices;
      const double angle = 2.399963229728653 * static_cast<double>(i), r = std::sqrt(1.0 - z * z);
      const btVector3 direction(r * math::cos(angle), r * math::sin(angle), z);
      int best = 0;
      for (int v = 1; v < corners; ++v) {
        if (direction.dot(computer.vertices[v]) > direction.dot(computer.vertices[best])) best = v;
      }
      keep[best] = true;
    }
  }
  for (int v = 0; v < corners; ++v) {
    if (keep[v])
      shape->addPoint(exact ? points[computer.original_vertex_index[v]] : computer.vertices[v],
                      false);
  }
  shape->setMargin(0.0);
  shape->recalcLocalAabb();
  if (!exact) shape->find_sides();
  return shape;
}

}  // namespace

// Bullet's triangle mesh refers to these arrays.
struct ShapeFactory::Triangles {
  std::vector<double> positions;
  std::vector<int> indices;
  btTriangleIndexVertexArray array;
  TriangleEdges edges;

  Triangles(const world::Mesh& mesh, const Vec3& scale) : edges(mesh, scale) {
    for (const auto& p : mesh.positions) {
      for (int i = 0; i < 3; ++i) positions.push_back(p[i] * scale[i]);
    }
    for (const auto& triangle : mesh.triangles)
      indices.insert(indices.end(), triangle.begin(), triangle.end());
    btIndexedMesh part;
    part.m_numTriangles = static_cast<int>(mesh.triangles.size());
    part.m_triangleIndexBase = reinterpret_cast<const unsigned char*>(indices.data());
    part.m_triangleIndexStride = 3 * sizeof(int);
    part.m_numVertices = static_cast<int>(mesh.positions.size());
    part.m_vertexBase = reinterpret_cast<const unsigned char*>(positions.data());
    part.m_vertexStride = 3 * sizeof(double);
    part.m_vertexType = PHY_DOUBLE;
    array.addIndexedMesh(part, PHY_INTEGER);
  }
};

ShapeFactory::ShapeFactory(Hulls hulls) : hulls_(hulls) {}
ShapeFactory::~ShapeFactory() = default;

btCollisionShape* ShapeFactory::primitive(const world::Geometry& geometry) {
  const Vec3& size = geometry.size;
  switch (geometry.shape) {
    case world::Shape::box: {
      auto box = std::make_unique<SeenAhead<btBoxShape>>(to_bt(Vec3(size / 2)));
      box->setMargin(margin_for(size.minCoeff() / 2));
      return own(std::move(box));
    }
    case world::Shape::sphere: return own(std::make_unique<SeenAhead<btSphereShape>>(size.x()));
    case world::Shape::cylinder: {
      auto cylinder = std::make_unique<SeenAhead<btCylinderShapeZ>>(
          btVector3(size.x(), size.x(), size.y() / 2));
      cylinder->setMargin(margin_for(std::min(size.x(), size.y() / 2)));
      return own(std::move(cylinder));
    }
    case world::Shape::capsule:
      return own(std::make_unique<SeenAhead<btCapsuleShapeZ>>(size.x(), size.y()));
    case world::Shape::ellipsoid:
      return own(std::make_unique<SeenAhead<EllipsoidShape>>(to_bt(size)));
    case world::Shape::cone: {
      auto cone = std::make_unique<SeenAhead<btConeShapeZ>>(size.x(), size.y());
      cone->setMargin(0.0);  // a cone's margin would be added outside
      return own(std::move(cone));
    }
    case world::Shape::plane:
      return own(std::make_unique<btStaticPlaneShape>(to_bt(geometry.normal), 0.0));
    case world::Shape::mesh: break;
  }
  return nullptr;
}

btCollisionShape* ShapeFactory::fixed(const world::Geometry& geometry) {
  if (geometry.shape != world::Shape::mesh) return primitive(geometry);
  if (!geometry.mesh || world::triangle_count(*geometry.mesh) == 0) return nullptr;
  const Vec3& scale = geometry.scale;
  btCollisionShape*& shape = fixed_meshes_[{geometry.mesh.get(), scale.x(), scale.y(), scale.z()}];
  const world::HeightMap* heights = world::height_map(*geometry.mesh);
  if (!shape && heights) {
    shape = own(std::make_unique<SeenAhead<HeightField>>(heights->grid));
  } else if (!shape) {
    triangles_.push_back(std::make_unique<Triangles>(*geometry.mesh, scale));
    auto mesh = std::make_unique<SeenAhead<btBvhTriangleMeshShape>>(&triangles_.back()->array,
                                                                    /*quantised*/ false);
    mesh->setMargin(0.0);
    mesh->setUserPointer(static_cast<MeshEdges*>(&triangles_.back()->edges));
    shape = own(std::move(mesh));
  }
  return shape;
}

ShapeFactory::Pieces ShapeFactory::pieces_of(const world::Geometry& geometry,
                                             const world::Mesh* convex) {
  const world::Mesh& mesh = *geometry.mesh;
  const Vec3& scale = geometry.scale;
  std::vector<std::vector<btVector3>> points;
  double mesh_volume = 0.0, hull_volume = 0.0;
  for (const auto& t : mesh.triangles) {
    const btVector3 b = scaled(mesh.positions[t[1]], scale);
    mesh_volume +=
        scaled(mesh.positions[t[0]], scale).dot(b.cross(scaled(mesh.positions[t[2]], scale))) / 6.0;
  }
  if (convex) {
    for (const world::Mesh::Part& part : convex->parts) {
      points.emplace_back();
      for (uint32_t t = 0; t < part.triangle_count; ++t) {
        for (const uint32_t i : convex->triangles[part.first_triangle + t])
          points.back().push_back(scaled(convex->positions[i], scale));
      }
    }
  } else {
    int count = 0;
    std::vector<int> part = connected_parts(mesh, count);
    if (static_cast<size_t>(count) > kMaxPieces) {
      std::fill(part.begin(), part.end(), 0);
      count = 1;
    }
    points.resize(static_cast<size_t>(count));
    for (const auto& t : mesh.triangles) {
      for (const uint32_t i : t) points[part[t[0]]].push_back(scaled(mesh.positions[i], scale));
    }
  }
  Pieces pieces;
  for (const auto& of_part : points) {
    if (!of_part.empty())
      pieces.hulls.push_back(own(hull_of(of_part, hulls_ == Hulls::exact, hull_volume)));
  }
  pieces.exact = mesh.closed && hull_volume - std::abs(mesh_volume) <=
                                    (convex ? kConcavityOfPieces : kConcavity) * hull_volume;
  return pieces;
}

bool ShapeFactory::moving(const world::Geometry& geometry, bool is_wheel,
                          std::vector<btCollisionShape*>& shapes) {
  if (geometry.shape == world::Shape::plane) return true;
  if (geometry.shape != world::Shape::mesh) {
    shapes.push_back(primitive(geometry));
    return true;
  }
  if (!geometry.mesh || geometry.mesh->triangles.empty()) return true;
  // A wheel's rim is not felt; its hull is round.
  const world::Mesh* convex = is_wheel ? nullptr : geometry.pieces.get();
  const Vec3& scale = geometry.scale;
  const auto [entry, is_new] = moving_meshes_.try_emplace(
      {convex ? convex : geometry.mesh.get(), scale.x(), scale.y(), scale.z()});
  Pieces& pieces = entry->second;
  if (is_new) pieces = pieces_of(geometry, convex);
  shapes.insert(shapes.end(), pieces.hulls.begin(), pieces.hulls.end());
  return pieces.exact;
}

btCollisionShape* ShapeFactory::tyre(double radius, double width) {
  return own(std::make_unique<SeenAhead<TyreShape>>(radius, width));
}

}  // namespace ruedo::physics
