// What ray scenes of all modules share: the table of shapes, the Embree device, and the tree of the static
// shapes. Internal to src/scene.
#pragma once

#include "scene/ray_scene.h"
#include "scene/ray_table.h"

namespace ruedo::scene {

// The context of a packet's run through a tree; lanes are found by the ray's id.
struct TreeQuery : EmbreeContext {
  RayBatch batch;
  Packet packet;
  const void* owner = nullptr;    // for the callback
};

// An Embree tree over boxes of our own, with a callback that tests what is in them.
class RayTree {
 public:
  // Embree keeps its address.
  RayTree() = default;
  RayTree(const RayTree&) = delete;
  RayTree& operator=(const RayTree&) = delete;

  // boxes: one a primitive; `moving`: they will change.
  void build(RTCDevice device, std::vector<Box> boxes, RTCIntersectFunctionN callback, bool moving);

  Box& box(size_t primitive) { return boxes_[primitive]; }
  // After boxes were changed.
  void refit();
  // Casts the lanes (bits) of query.batch.
  void cast(unsigned lanes, TreeQuery& query) const;

 private:
  static void bounds(const RTCBoundsFunctionArguments* arguments);

  std::vector<Box> boxes_;
  Box all_;
  double margin_ = 0.0;
  RTCGeometry geometry_ = nullptr;    // owned by the scene
  ScenePtr scene_;
};

// Calls test(primitive, lanes) and shortens the packet's rays to the nearest hits after it.
template <class Test>
void run_callback(const RTCIntersectFunctionNArguments& arguments, TreeQuery& query, Test test) {
  RTCRayN* rays = RTCRayHitN_RayN(arguments.rayhit, arguments.N);
  unsigned lanes = 0;
  for (unsigned i = 0; i < arguments.N; ++i)
    if (arguments.valid[i]) lanes |= 1u << RTCRayN_id(rays, arguments.N, i);
  test(arguments.primID, lanes);
  for (unsigned i = 0; i < arguments.N; ++i) {
    if (!arguments.valid[i]) continue;
    const unsigned lane = RTCRayN_id(rays, arguments.N, i);
    RTCRayN_tfar(rays, arguments.N, i) = round_up(query.batch.t[lane] - query.packet.start[lane]);
  }
}

class StaticRayScene {
 public:
  StaticRayScene(const model::WorldModel& world, const model::BodyLayout& layout, bool visuals, Backend backend);

  const model::BodyLayout& layout;
  const Backend backend;

 private:
  DevicePtr device_;    // before what is made with it

 public:
  const RayTable table;
  RTCDevice device() const { return device_.get(); }
  // Static shapes, for the lanes (bits) of query.batch.
  void cast(unsigned lanes, TreeQuery& query) const;

 private:
  static void test_primitive(const RTCIntersectFunctionNArguments* arguments);
  std::vector<int> unbounded_, bounded_;    // indices into table.shapes
  RayTree tree_;
};

// Is there a ray at all? Others hit nothing.
inline bool usable(const Ray& ray) {
  return ray.origin.allFinite() && ray.direction.allFinite() && ray.direction != Vec3::Zero() && ray.max_range >= 0.0;
}

// Embree's limit on coordinates, with room to spare.
inline bool fits_tree(const Box& box) {
  return !box.empty() && box.lower.minCoeff() > -1e15 && box.upper.maxCoeff() < 1e15;
}

std::unique_ptr<RayScene> make_reference_ray_scene(std::shared_ptr<const StaticRayScene> statics);

}  // namespace ruedo::scene
