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
  fan_tree_.build(boxes);
  tree_.build(device(), std::move(boxes), test_primitive, meshes);
  closed_tree_.build(device(), std::move(closed_boxes), test_closed);
}

void StaticRayScene::prepare(const Vec3& origin, const Box& reach, Within& within) const {
  within.fan_known = !has_meshes_ && within.fan.collect(fan_tree_, origin, reach);
  const Vec3 center = 0.5 * (reach.lower + reach.upper), half = 0.5 * (reach.upper - reach.lower);
  for (size_t i = 0; i < std::min<size_t>(unbounded_.size(), 64); ++i) {
    const RayShape& s = shape(unbounded_[i]);
    if (s.kind != Shape::plane) continue;
    const double height = s.normal.dot(s.into.point(center));
    const double reached = s.into.vector_back(s.normal).cwiseAbs().dot(half) + reach.rounding() +
                           1e-12 * s.into.translation.cwiseAbs().maxCoeff();
    if (std::abs(height) > reached) within.unbounded &= ~(uint64_t{1} << i);
  }
}

void StaticRayScene::cast(unsigned lanes, const Within& within, TreeQuery& query) const {
  for (size_t i = 0; i < unbounded_.size(); ++i) {
    const RayShape& s = shape(unbounded_[i]);
    if (i >= 64 || (within.unbounded >> i & 1))
      test_shape(s, unbounded_[i], s.into, lanes, query.batch.world, query.batch);
  }
  if (within.fan_known) {
    within.fan.visit(lanes, query.batch, [&](size_t i) {
      const RayShape& s = shape(bounded_[i]);
      test_shape(s, bounded_[i], s.into, lanes, query.batch.world, query.batch);
    });
    return;
  }
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
