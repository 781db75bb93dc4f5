// The shared part of all modules' ray scenes: the table of shapes, the Embree device, and the tree
// over static shapes. Internal to src/scene.
#pragma once

#include "scene/rays/ray_fan.h"
#include "scene/rays/ray_scene.h"
#include "scene/rays/ray_table.h"

namespace ruedo::scene {

// The context of a packet's traversal; rays carry their lane as id.
struct TreeQuery : EmbreeContext {
  RayBatch batch;
  Packet packet;
  const void* owner = nullptr;        // for the callback
  const RayMesh* counting = nullptr;  // not null: count the signed crossings of this mesh instead
  Vec3 counting_from = Vec3::Zero();
  Shear shear;  // of the counting direction
  int crossings = 0;

  TreeQuery() { init_context(*this); }
};

// An Embree tree over our own boxes, with a callback that tests their contents, and over the
// triangles of meshes given in the world's frame.
class RayTree {
 public:
  // Not movable: Embree keeps its address.
  RayTree() = default;
  RayTree(const RayTree&) = delete;
  RayTree& operator=(const RayTree&) = delete;

  // boxes: one per primitive. meshes: with their index in the table; they must outlive the tree.
  void build(RTCDevice device, std::vector<Box> boxes, RTCIntersectFunctionN callback,
             const std::vector<std::pair<int, const RayShape*>>& meshes = {});

  // Casts the lanes (bits) of query.batch.
  void cast(unsigned lanes, TreeQuery& query) const;
  // Whether the point is inside one of the meshes given to build(). As RayMesh::inside.
  bool inside(const RayMesh& mesh, const Vec3& point) const;

 private:
  struct Triangles {
    const RayTree* tree;
    const RayShape* shape;
    int index;  // of the shape, in the table
  };
  static void bounds(const RTCBoundsFunctionArguments* arguments);
  static void pair_bounds(const RTCBoundsFunctionArguments* arguments);
  static void test_pair(const RTCIntersectFunctionNArguments* arguments);
  void attach(RTCDevice device, size_t primitives, void* user, RTCBoundsFunction bounds,
              RTCIntersectFunctionN callback);

  std::vector<Box> boxes_;
  std::vector<Triangles> triangles_;
  Box all_;
  double margin_ = 0.0;
  ScenePtr scene_;
};

class StaticRayScene {
 public:
  StaticRayScene(const world::WorldModel& world, const world::BodyLayout& layout, bool visuals,
                 Backend backend);

  const world::BodyLayout layout;  // a copy: the worlds that share it come and go
  const Backend backend;

 private:
  DevicePtr device_;  // declared before everything made with it

 public:
  const RayTable table;
  RTCDevice device() const { return device_.get(); }
  // rays in the world's frame then need their shear
  bool has_meshes() const { return has_meshes_; }
  // The shapes that a scan may hit, selected before its rays are cast.
  struct Within {
    bool fan_known = false;
    RayFan fan;
    uint64_t unbounded = ~uint64_t{0};  // bit i: the rays may meet the i-th, from 64 on all
  };
  // Of rays from one origin; reach: around them up to their maximum range.
  void prepare(const Vec3& origin, const Box& reach, Within& within) const;
  // Static shapes, for the lanes (bits) of query.batch.
  void cast(unsigned lanes, const Within& within, TreeQuery& query) const;

 private:
  static void test_primitive(const RTCIntersectFunctionNArguments* arguments);
  static void test_closed(const RTCIntersectFunctionNArguments* arguments);
  void cast_inside(unsigned lanes, TreeQuery& query) const;
  const RayShape& shape(int index) const { return table.shapes[index]; }

  std::vector<int> unbounded_, bounded_, closed_;  // indices into table.shapes
  RayTree tree_, closed_tree_;
  BoxTree fan_tree_;  // of bounded_
  bool has_meshes_ = false;
};

// Embree's limit on coordinates is 1.8e18.
inline constexpr double kFarthest = 1e15;  // m

// Whether the ray is valid. Others hit nothing.
inline bool usable(const Ray& ray) {
  return ray.origin.cwiseAbs().maxCoeff() <= kFarthest && ray.origin.allFinite() &&
         ray.max_range >= 0.0 && std::abs(ray.direction.squaredNorm() - 1.0) <= 1e-3;
}

inline bool fits_tree(const Box& box) {
  return !box.empty() && box.lower.minCoeff() > -kFarthest && box.upper.maxCoeff() < kFarthest;
}

std::unique_ptr<RayScene> make_reference_ray_scene(std::shared_ptr<const StaticRayScene> statics);

}  // namespace ruedo::scene
