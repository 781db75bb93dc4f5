// Cuts signed triangles by planes; hulls are Bullet's.
#include "world/convex/solid.h"

#include <algorithm>
#include <map>
#include <tuple>

#include <LinearMath/btConvexHullComputer.h>
#include <Eigen/Geometry>
#include <Eigen/LU>

namespace ruedo::world {
namespace {

using Eigen::Vector3d;

Vector3d normal_of(const Triangle& t) { return (t[1] - t[0]).cross(t[2] - t[0]); }

std::tuple<double, double, double> key(const Vector3d& p) { return {p.x(), p.y(), p.z()}; }

// Where the segment meets the plane: the same bits for both directions, as neighbours share it.
Vector3d crossing(const Vector3d& a, const Vector3d& b, double above_a, double above_b) {
  if (key(b) < key(a)) return crossing(b, a, above_b, above_a);
  return a + (b - a) * (above_a / (above_a - above_b));
}

// Whether a point lies inside of a closed surface: the parity of what a ray meets. Its direction
// is one in which no designed edge runs.
bool is_inside(const Vector3d& point, std::span<const Triangle> surface) {
  const Vector3d ray(0.53771, 0.31131, 0.78357);
  bool inside = false;
  for (const Triangle& t : surface) {
    const Vector3d a = t[1] - t[0], b = t[2] - t[0], from = point - t[0];
    const Vector3d across = ray.cross(b);
    const double det = a.dot(across);
    if (det == 0.0) continue;
    const double u = from.dot(across) / det;
    if (u < 0.0 || u > 1.0) continue;
    const Vector3d over = from.cross(a);
    const double v = ray.dot(over) / det;
    if (v < 0.0 || u + v > 1.0) continue;
    if (b.dot(over) / det > 0.0) inside = !inside;
  }
  return inside;
}

}  // namespace

double volume_of(std::span<const Triangle> surface) {
  double six_volumes = 0.0;
  for (const Triangle& t : surface) six_volumes += t[0].dot(t[1].cross(t[2]));
  return six_volumes / 6.0;
}

double volume_of(const ConvexPiece& hull) {
  double six_volumes = 0.0;
  for (const auto& t : hull.triangles)
    six_volumes += hull.corners[t[0]].dot(hull.corners[t[1]].cross(hull.corners[t[2]]));
  return six_volumes / 6.0;
}

ConvexPiece hull_of(const std::vector<Vector3d>& points) {
  btConvexHullComputer computer;
  computer.compute(points[0].data(), sizeof(Vector3d), static_cast<int>(points.size()), 0, 0);
  ConvexPiece hull;
  // Bullet rounds corners to a grid: ours are the points.
  for (int v = 0; v < computer.vertices.size(); ++v)
    hull.corners.push_back(points[static_cast<size_t>(computer.original_vertex_index[v])]);
  for (int f = 0; f < computer.faces.size(); ++f) {
    const btConvexHullComputer::Edge* first = &computer.edges[computer.faces[f]];
    const auto corner = static_cast<uint32_t>(first->getSourceVertex());
    for (const auto* edge = first->getNextEdgeOfFace();
         edge->getTargetVertex() != first->getSourceVertex(); edge = edge->getNextEdgeOfFace()) {
      hull.triangles.push_back({corner, static_cast<uint32_t>(edge->getSourceVertex()),
                                static_cast<uint32_t>(edge->getTargetVertex())});
    }
  }
  // Bullet's faces are clockwise.
  if (volume_of(hull) < 0.0) {
    for (auto& t : hull.triangles) std::swap(t[1], t[2]);
  }
  return hull;
}

std::optional<std::vector<ConcaveEdge>> concave_edges(std::span<const Triangle> surface) {
  using Edge = std::pair<std::tuple<double, double, double>, std::tuple<double, double, double>>;
  std::map<Edge, std::pair<size_t, int>> edges;  // the triangle, and its corner where it begins
  for (size_t i = 0; i < surface.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      const Edge edge(key(surface[i][k]), key(surface[i][(k + 1) % 3]));
      if (!edges.try_emplace(edge, i, k).second) return std::nullopt;
    }
  }
  std::vector<ConcaveEdge> concave;
  for (const auto& [edge, place] : edges) {
    const auto other = edges.find({edge.second, edge.first});
    if (other == edges.end()) return std::nullopt;
    if (edge.second < edge.first) continue;  // each edge once
    const Triangle &t1 = surface[place.first], &t2 = surface[other->second.first];
    const ConcaveEdge found{t1[place.second], t1[(place.second + 1) % 3],
                            normal_of(t1).normalized(), normal_of(t2).normalized()};
    const Vector3d& opposite = t2[(other->second.second + 2) % 3];
    if (found.normal1.dot(opposite - found.from) > Part::kTiny &&
        found.normal1.cross(found.normal2).norm() > 1e-3)
      concave.push_back(found);
  }
  return concave;
}

Part::Part(std::span<const Triangle> whole, std::vector<ConcaveEdge> concave)
    : whole_(whole), surface_(whole.begin(), whole.end()), concave_(std::move(concave)) {
  measure();
}

void Part::measure() {
  volume_ = ruedo::world::volume_of(surface_) + ruedo::world::volume_of(caps_);
  hull_volume_ = volume_of(hull_of(corners()));
}

std::vector<Vector3d> Part::corners() const {
  std::vector<Vector3d> all = inner_corners_;
  for (const Triangle& t : surface_) all.insert(all.end(), t.begin(), t.end());
  return all;
}

// Appends what of the triangle is in the half-space, and the segments by which it ends on the
// plane, reversed: the rim of the cap.
void Part::cut(const Triangle& t, const HalfSpace& half, std::vector<Triangle>& kept,
               std::vector<std::array<Vector3d, 2>>& rim) const {
  std::array<double, 3> above;
  for (int k = 0; k < 3; ++k) {
    above[k] = half.above(t[k]);
    if (std::abs(above[k]) < kTiny) above[k] = 0.0;
  }
  const auto [least, most] = std::minmax_element(above.begin(), above.end());
  if (*most <= 0.0) {
    // A triangle in the plane belongs to the side on which the solid is.
    if (*least < 0.0 || normal_of(t).dot(half.normal) >= 0.0) return;
  }
  std::array<Vector3d, 4> corner;
  std::array<bool, 4> on_plane{};
  size_t n = 0;
  for (int k = 0; k < 3; ++k) {
    const int next = (k + 1) % 3;
    if (above[k] >= 0.0) {
      corner[n] = t[k];
      on_plane[n++] = above[k] == 0.0;
    }
    if (above[k] * above[next] < 0.0) {
      corner[n] = crossing(t[k], t[next], above[k], above[next]);
      on_plane[n++] = true;
    }
  }
  for (size_t i = 2; i < n; ++i) kept.push_back({corner[0], corner[i - 1], corner[i]});
  for (size_t i = 0; i < n; ++i) {
    const size_t next = (i + 1) % n;
    if (on_plane[i] && on_plane[next]) rim.push_back({corner[next], corner[i]});
  }
}

std::optional<Part> Part::in(const HalfSpace& half) const {
  Part part;
  part.whole_ = whole_;
  part.cell_ = cell_;
  part.inner_corners_ = inner_corners_;
  std::vector<std::array<Vector3d, 2>> rim;
  for (const Triangle& t : surface_) cut(t, half, part.surface_, rim);
  if (part.surface_.empty() || rim.empty()) return std::nullopt;
  for (const Triangle& t : caps_) cut(t, half, part.caps_, rim);
  for (const auto& [from, to] : rim) {
    part.caps_.push_back({rim[0][0], from, to});
    part.section_ -= normal_of(part.caps_.back()).dot(half.normal) / 2;
  }
  for (const ConcaveEdge& edge : concave_) {
    if (std::max(half.above(edge.from), half.above(edge.to)) > kTiny) part.concave_.push_back(edge);
  }
  part.find_inner_corners(half);
  part.measure();
  if (part.volume_ < 1e-7 * volume_ || part.volume_ > (1.0 - 1e-7) * volume_) return std::nullopt;
  return part;
}

void Part::find_inner_corners(const HalfSpace& half) {
  std::erase_if(inner_corners_, [&](const Vector3d& p) { return half.above(p) < -kTiny; });
  for (size_t i = 0; i < cell_.size(); ++i) {
    for (size_t j = 0; j < i; ++j) {
      Eigen::Matrix3d normals;
      normals << half.normal.transpose(), cell_[i].normal.transpose(), cell_[j].normal.transpose();
      if (std::abs(normals.determinant()) < 1e-6) continue;
      const Vector3d corner =
          normals.inverse() * Vector3d(half.distance, cell_[i].distance, cell_[j].distance);
      if (std::all_of(cell_.begin(), cell_.end(),
                      [&](const HalfSpace& each) { return each.above(corner) > -kTiny; }) &&
          is_inside(corner, whole_))
        inner_corners_.push_back(corner);
    }
  }
  cell_.push_back(half);
}

}  // namespace ruedo::world
