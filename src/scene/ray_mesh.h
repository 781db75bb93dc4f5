// A triangle mesh for rays: a watertight test in double precision, and an Embree tree over the triangles.
//
// The test takes the sign of d . (p x q) for each edge pq seen from the ray's origin (Pluecker coordinates, as in
// Davidovic et al., "3D rasterization", SCCG 2012). In the two triangles that share an edge it is the same
// number but for its sign, bit by bit, so no ray slips through between them.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include "model/mesh.h"
#include "scene/ray_embree.h"
#include "scene/ray_shapes.h"

namespace ruedo::scene {

// Eight rays in some frame.
struct FrameRays {
  Vec3 o[kLanes], d[kLanes];
};

class RayMesh {
 public:
  // The mesh, scaled, in frame F.
  RayMesh(const model::Mesh& mesh, const Vec3& scale, const Pose& X_FMesh);

  // Makes a tree of its own, for intersect() and inside(); without it they loop over the triangles.
  void build_tree(RTCDevice device);

  // The nearest hit of each of the lanes (bits) not beyond t_max[lane]; hits[lane].feature is the triangle.
  void intersect(unsigned lanes, const FrameRays& rays, const double* t_max, ShapeHit* hits) const;

  // Is the point inside the closed mesh? Counts the signed crossings of the surface on the way out (the winding
  // number), so overlapping parts count once. False for an open mesh.
  bool inside(const Vec3& point) const;

  // Calls found(lane, t) for the lanes that hit the triangle.
  template <class Found>
  void test(int triangle, unsigned lanes, const FrameRays& rays, Found found) const;
  // +1 where the ray leaves through the triangle, -1 where it enters, 0 where it misses. A ray through an edge or
  // corner is turned aside by less than any number, the same way for all triangles: each crossing counts once.
  int crossing(int triangle, const Vec3& o, const Vec3& d) const;
  static const Vec3& way_out();    // direction in which inside() counts

  Vec3 normal(int triangle) const;    // unit, by the winding
  size_t size() const { return triangles_.size(); }
  // Neighbours in the list that share an edge are one primitive of the trees: half the leaves. Primitive i holds the
  // triangles from pairs()[i] up to pairs()[i + 1].
  const std::vector<int>& pairs() const { return pairs_; }
  Box pair_box(unsigned pair) const;
  const Box& box() const { return box_; }    // grown by its margin()
  bool closed() const { return closed_; }
  const std::vector<Vec3>& positions() const { return positions_; }

 private:
  struct Query;
  // A triangle seen from a point: the planes through the point and each edge.
  struct Seen {
    Vec3 a, b, c, u, v, w;
    Seen() = default;
    Seen(const Vec3& a0, const Vec3& b0, const Vec3& c0, const Vec3& o)
        : a(a0 - o), b(b0 - o), c(c0 - o), u(b.cross(c)), v(c.cross(a)), w(a.cross(b)) {}
  };
  const Vec3& corner(int triangle, int i) const { return positions_[triangles_[static_cast<size_t>(triangle)][static_cast<size_t>(i)]]; }
  Seen seen(int triangle, const Vec3& o) const { return {corner(triangle, 0), corner(triangle, 1), corner(triangle, 2), o}; }
  static double distance(const Seen& seen, const Vec3& area, const Vec3& d);
  static void bounds(const RTCBoundsFunctionArguments* arguments);
  static void intersect_pair(const RTCIntersectFunctionNArguments* arguments);

  std::vector<Vec3> positions_;
  std::vector<std::array<uint32_t, 3>> triangles_;
  std::vector<int> pairs_;
  bool closed_ = false;
  Box box_;
  double margin_ = 0.0;
  ScenePtr scene_;
};

// Along the ray to the triangle's plane, but within the triangle: edge on, the plane says nothing.
inline double RayMesh::distance(const Seen& seen, const Vec3& area, const Vec3& d) {
  const double a = seen.a.dot(d), b = seen.b.dot(d), c = seen.c.dot(d);
  const double t = area.dot(seen.a) / area.dot(d);
  return std::clamp(t, std::min({a, b, c}), std::max({a, b, c}));
}

template <class Found>
void RayMesh::test(int triangle, unsigned lanes, const FrameRays& rays, Found found) const {
  Seen seen_from;
  const Vec3* from = nullptr;    // rays of one device start in one point
  for (unsigned rest = lanes; rest != 0; rest &= rest - 1) {
    const int lane = std::countr_zero(rest);
    const Vec3 &o = rays.o[lane], &d = rays.d[lane];
    if (!from || *from != o) {
      seen_from = seen(triangle, o);
      from = &o;
    }
    const double u = d.dot(seen_from.u), v = d.dot(seen_from.v), w = d.dot(seen_from.w);
    if ((u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0)) continue;
    const Vec3 area = (corner(triangle, 1) - corner(triangle, 0)).cross(corner(triangle, 2) - corner(triangle, 0));
    if (area.dot(d) == 0.0) continue;    // edge on, or no area
    const double t = distance(seen_from, area, d);
    if (t >= 0.0) found(lane, t);
  }
}

}  // namespace ruedo::scene
