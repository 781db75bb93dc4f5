// A triangle mesh for rays: a watertight test in double precision over an Embree tree of its own, in the
// mesh's frame. Shared by all shapes with the same mesh and scale.
//
// The test is that of Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection", JCGT 2013: an edge gives
// the same number, but for its sign, in both triangles that share it, so no ray slips through between them.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "model/mesh.h"
#include "scene/ray_embree.h"
#include "scene/ray_shapes.h"

namespace ruedo::scene {

// A ray as the triangle test wants it: sheared so that it points along one axis.
struct ShearedRay {
  Vec3 origin;
  int kx, ky, kz;
  double sx, sy, sz;

  ShearedRay() = default;
  ShearedRay(const Vec3& o, const Vec3& d);
};

// What is known of one ray while it runs through a mesh. triangle -1: nothing was hit yet.
struct MeshRay {
  ShearedRay ray;
  double t = kNoHit;
  int triangle = -1;
};

class RayMesh {
 public:
  // device null: no tree, plain loops over the triangles.
  RayMesh(const model::Mesh& mesh, const Vec3& scale, RTCDevice device);

  // The nearest hit of each of the lanes (bits of `lanes`) not beyond t_max[lane]; hits[lane].feature is the triangle.
  void intersect(unsigned lanes, const Vec3* o, const Vec3* d, const double* t_max, ShapeHit* hits) const;

  // Is the point inside the closed mesh? Counts the signed crossings of the surface on the way out (the winding
  // number), so overlapping parts count once. False for an open mesh.
  bool inside(const Vec3& point) const;

  Vec3 normal(int triangle) const;    // unit, by the winding
  const Box& box() const { return box_; }
  bool closed() const { return closed_; }
  const std::vector<Vec3>& positions() const { return positions_; }

 private:
  struct Query;
  static void bounds(const RTCBoundsFunctionArguments* arguments);
  static void intersect_triangle(const RTCIntersectFunctionNArguments* arguments);
  void test(int triangle, MeshRay& ray) const;
  int crossing(int triangle, const ShearedRay& ray) const;

  std::vector<Vec3> positions_;
  std::vector<std::array<uint32_t, 3>> triangles_;
  bool closed_ = false;
  Box box_;    // grown by margin_
  double margin_ = 0.0;
  ScenePtr scene_;
};

}  // namespace ruedo::scene
