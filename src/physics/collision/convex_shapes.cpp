// The flat sides of a hull: of the hull's faces those in one plane are one side.
#include "physics/collision/convex_shapes.h"

#include <algorithm>

#include <LinearMath/btConvexHullComputer.h>

#include "ruedo/math.h"

namespace ruedo::physics {

namespace {

constexpr btScalar kOnePlane = 0.99996;  // cosine of half a degree
constexpr btScalar kFlat = 1e-4;         // of the size: corners so near a plane are in it

struct Piece {
  btVector3 normal, corner;
  btScalar area;
};

std::vector<Piece> pieces_of(const btConvexHullComputer& hull, const btVector3* points) {
  std::vector<Piece> pieces;
  const auto at = [&](int vertex) { return points[hull.original_vertex_index[vertex]]; };
  for (int f = 0; f < hull.faces.size(); ++f) {
    const btConvexHullComputer::Edge* first = &hull.edges[hull.faces[f]];
    const btVector3 a = at(first->getSourceVertex());
    btVector3 sum(0, 0, 0);
    for (const auto* edge = first->getNextEdgeOfFace();
         edge->getTargetVertex() != first->getSourceVertex(); edge = edge->getNextEdgeOfFace())
      sum += (at(edge->getSourceVertex()) - a).cross(at(edge->getTargetVertex()) - a);
    const btScalar area = sum.length();
    if (area > 0.0) pieces.push_back({sum / area, a, area});
  }
  std::stable_sort(pieces.begin(), pieces.end(),
                   [](const Piece& a, const Piece& b) { return a.area > b.area; });
  return pieces;
}

}  // namespace

void HullShape::find_sides() {
  const btVector3* points = getUnscaledPoints();
  const int count = getNumPoints();
  btConvexHullComputer hull;
  hull.compute(&points[0].m_floats[0], sizeof(btVector3), count, 0, 0);
  btVector3 low, high, middle(0, 0, 0);
  btConvexHullShape::getAabb(btTransform::getIdentity(), low, high);
  const btScalar flat = kFlat * (high - low).length();
  for (int i = 0; i < count; ++i) middle += points[i] / count;
  for (Piece& piece : pieces_of(hull, points)) {
    if (piece.normal.dot(piece.corner - middle) < 0.0) piece.normal = -piece.normal;
    const btVector3& n = piece.normal;
    if (std::any_of(sides_.begin(), sides_.end(),
                    [&](const Side& side) { return side.normal.dot(n) > kOnePlane; }))
      continue;
    Side side{n, {}};
    for (int i = 0; i < count; ++i)
      if (btFabs(n.dot(points[i] - piece.corner)) <= flat) side.corners.push_back(points[i]);
    if (side.corners.size() < 3) continue;
    btVector3 centre(0, 0, 0), u, v;
    for (const btVector3& p : side.corners)
      centre += p / static_cast<btScalar>(side.corners.size());
    btPlaneSpace1(n, u, v);
    const auto angle = [&](const btVector3& p) {
      return math::atan2(v.dot(p - centre), u.dot(p - centre));
    };
    std::stable_sort(side.corners.begin(), side.corners.end(),
                     [&](const btVector3& a, const btVector3& b) { return angle(a) < angle(b); });
    sides_.push_back(std::move(side));
  }
}

}  // namespace ruedo::physics
