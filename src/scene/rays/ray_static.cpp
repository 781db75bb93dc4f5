#include "scene/rays/ray_static.h"

namespace ruedo::scene {

using world::Shape;

StaticRayScene::StaticRayScene(const world::WorldModel& world, const world::BodyLayout& body_layout,
                               bool visuals, Backend kind)
    : layout(body_layout),
      backend(kind),
      device_(kind == Backend::embree ? make_device() : nullptr),
      table(world, body_layout, visuals, device_.get()) {
  if (backend == Backend::reference) return;
  std::vector<Box> boxes, closed_boxes;
  std::vector<std::pair<int, const RayShape*>> meshes;
  for (const int index : table.statics) {
    const RayShape& s = shape(index);
    if (!fits_tree(s.box_F)) {
      unbounded_.push_back(index);
    } else if (s.mesh) {
      meshes.emplace_back(index, &s);
      if (s.mesh->closed()) {
        closed_.push_back(index);
        closed_boxes.push_back(s.mesh->box());
      }
    } else {
      bounded_.push_back(index);
      boxes.push_back(s.box_F);
    }
  }
  has_meshes_ = !meshes.empty();
  tree_.build(device(), std::move(boxes), test_primitive, meshes);
  closed_tree_.build(device(), std::move(closed_boxes), test_closed);
}

void StaticRayScene::cast(unsigned lanes, TreeQuery& query) const {
  for (const int index : unbounded_)
    test_shape(shape(index), index, shape(index).into, lanes, query.batch.world, query.batch);
  query.owner = this;
  if (!closed_.empty()) cast_inside(lanes, query);
  tree_.cast(lanes, query);
}

// Triangles alone have no inside, so the closed meshes around a ray's origin are found separately:
// once for all rays with the same origin.
void StaticRayScene::cast_inside(unsigned lanes, TreeQuery& query) const {
  RayBatch& batch = query.batch;
  for (unsigned rest = lanes; rest != 0; rest &= rest - 1) {
    const int lane = std::countr_zero(rest);
    const Vec3& o = batch.world.o[lane];
    if (!batch.asked_statics || batch.asked_at != o) {
      batch.asked_statics = true;
      batch.asked_at = o;
      batch.inside_static = RayBatch::kNothing;
      const double t = std::exchange(batch.t[lane], 0.0);
      closed_tree_.cast(1u << lane, query);
      batch.t[lane] = t;
    }
    if (batch.inside_static != RayBatch::kNothing)
      batch.offer(lane, {0.0, kInside}, batch.inside_static);
  }
}

void StaticRayScene::test_closed(const RTCIntersectFunctionNArguments* arguments) {
  auto& query = *static_cast<TreeQuery*>(arguments->context);
  const auto& statics = *static_cast<const StaticRayScene*>(query.owner);
  const int index = statics.closed_[arguments->primID];
  const RayShape& s = statics.shape(index);
  RayBatch& batch = query.batch;
  if (s.link == batch.ignored_link || index > batch.inside_static) return;
  if (statics.tree_.inside(*s.mesh, batch.asked_at)) batch.inside_static = index;
}

void StaticRayScene::test_primitive(const RTCIntersectFunctionNArguments* arguments) {
  auto& query = *static_cast<TreeQuery*>(arguments->context);
  if (query.counting) return;
  const auto& statics = *static_cast<const StaticRayScene*>(query.owner);
  const int index = statics.bounded_[arguments->primID];
  const RayShape& s = statics.shape(index);
  test_shape(s, index, s.into, lanes_of(*arguments), query.batch.world, query.batch);
  shorten(*arguments,
          [&](unsigned lane) { return query.batch.t[lane] - query.packet.start[lane]; });
}

std::shared_ptr<const StaticRayScene> make_static_ray_scene(const world::WorldModel& world,
                                                            const world::BodyLayout& layout,
                                                            bool visuals, Backend backend) {
  return std::make_shared<const StaticRayScene>(world, layout, visuals, backend);
}

}  // namespace ruedo::scene
