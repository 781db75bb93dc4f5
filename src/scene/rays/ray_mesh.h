// A triangle mesh for ray casting: a watertight test in double precision, and an Embree tree over
// the triangles.
//
// The test is that of Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection", JCGT 2013:
// vertices are projected onto a plane across the ray, identically for all triangles, so that no ray
// slips through an edge or a vertex.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include "scene/rays/ray_embree.h"
#include "scene/rays/ray_shapes.h"
#include "world/model/mesh.h"

namespace ruedo::scene {

// The shear that makes the ray point along one coordinate axis.
struct Shear {
  int kx, ky, kz;
  double sx, sy, sz;

  Shear() = default;
  explicit Shear(const Vec3& d) {
    d.cwiseAbs().maxCoeff(&kz);
    kx = kz == 2 ? 0 : kz + 1;
    ky = kx == 2 ? 0 : kx + 1;
    if (d[kz] < 0.0) std::swap(kx, ky);  // keeps the winding
    sz = 1.0 / d[kz];
    sx = d[kx] * sz;
    sy = d[ky] * sz;
  }
};

// A triangle in the ray's sheared coordinates: vertices across and along the ray, and the edge
// functions.
struct SeenTriangle {
  double ax, ay, az, bx, by, bz, cx, cy, cz, u, v, w;
  SeenTriangle(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& o, const Shear& s) {
    const auto see = [&](const Vec3& p, double& x, double& y, double& z) {
      z = p[s.kz] - o[s.kz];
      x = (p[s.kx] - o[s.kx]) - s.sx * z;
      y = (p[s.ky] - o[s.ky]) - s.sy * z;
    };
    see(a, ax, ay, az);
    see(b, bx, by, bz);
    see(c, cx, cy, cz);
    u = cx * by - cy * bx;
    v = ax * cy - ay * cx;
    w = bx * ay - by * ax;
  }
  double t(const Shear& s) const { return s.sz * ((u * az + v * bz + w * cz) / (u + v + w)); }
  // The distance of the hit; kNoHit if the ray misses, sees it edge-on, or it is degenerate.
  double hit(const Shear& s) const {
    if ((u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0)) return kNoHit;
    if (u + v + w == 0.0) return kNoHit;
    const double distance = t(s);
    return distance >= 0.0 ? distance : kNoHit;
  }
};

// Eight rays in some frame; the shears are used by meshes only.
struct FrameRays {
  Vec3 o[kLanes], d[kLanes];
  Shear shear[kLanes];
};

class RayMesh {
 public:
  // The mesh, scaled, in frame F.
  RayMesh(const world::Mesh& mesh, const Vec3& scale, const Pose& X_FMesh);

  // Builds a tree, for intersect() and inside(); without it they loop over the triangles.
  void build_tree(RTCDevice device);

  // The nearest hit of each lane (bit) up to t_max[lane]; hits[lane].feature is the triangle.
  void intersect(unsigned lanes, const FrameRays& rays, const double* t_max, ShapeHit* hits) const;

  // Whether the point is inside the closed mesh: counts signed crossings of the surface along a
  // line (the winding number), so overlapping parts count once. False for an open mesh.
  bool inside(const Vec3& point) const;

  // Calls found(lane, t) for the lanes that hit the triangle.
  template <class Found>
  void test(int triangle, unsigned lanes, const FrameRays& rays, Found found) const;
  // +1 if the ray leaves through the triangle, -1 if it enters, 0 if it misses. A ray through an
  // edge or vertex is displaced by an infinitesimal amount, identically for all triangles, so that
  // each crossing counts once.
  int crossing(int triangle, const Vec3& o, const Shear& shear) const;
  static const Vec3& way_out();  // the direction in which inside() counts

  Vec3 normal(int triangle) const;  // unit, by the winding
  size_t size() const { return triangles_.size(); }
  // Consecutive triangles that share an edge form one primitive of the trees, which halves the
  // leaves. Primitive i holds the triangles from pairs()[i] up to pairs()[i + 1].
  const std::vector<int>& pairs() const { return pairs_; }
  Box pair_box(unsigned pair) const;
  const Box& box() const { return box_; }  // enlarged by its margin()
  bool closed() const { return closed_; }
  const std::vector<Vec3>& positions() const { return positions_; }

 private:
  struct Query;
  const Vec3& corner(int triangle, int i) const { return positions_[triangles_[triangle][i]]; }
  SeenTriangle seen(int triangle, const Vec3& o, const Shear& shear) const {
    return {corner(triangle, 0), corner(triangle, 1), corner(triangle, 2), o, shear};
  }
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

template <class Found>
inline void RayMesh::test(int triangle, unsigned lanes, const FrameRays& rays, Found found) const {
  for (unsigned rest = lanes; rest != 0; rest &= rest - 1) {
    const int lane = std::countr_zero(rest);
    const double t = seen(triangle, rays.o[lane], rays.shear[lane]).hit(rays.shear[lane]);
    if (t < kNoHit) found(lane, t);
  }
}

}  // namespace ruedo::scene
