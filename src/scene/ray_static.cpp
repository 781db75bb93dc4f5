#include "scene/ray_static.h"

namespace ruedo::scene {

void RayTree::build(RTCDevice device, std::vector<Box> boxes, RTCIntersectFunctionN callback, bool moving) {
  boxes_ = std::move(boxes);
  if (boxes_.empty()) return;
  const KeepFloatMode keep;
  scene_.reset(rtcNewScene(device));
  geometry_ = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
  rtcSetGeometryUserPrimitiveCount(geometry_, static_cast<unsigned>(boxes_.size()));
  rtcSetGeometryUserData(geometry_, this);
  rtcSetGeometryBoundsFunction(geometry_, bounds, nullptr);
  rtcSetGeometryIntersectFunction(geometry_, callback);
  if (moving) {
    rtcSetSceneFlags(scene_.get(), RTC_SCENE_FLAG_DYNAMIC);
    rtcSetGeometryBuildQuality(geometry_, RTC_BUILD_QUALITY_REFIT);
  }
  rtcAttachGeometry(scene_.get(), geometry_);
  rtcReleaseGeometry(geometry_);    // the scene keeps it
  refit();
}

void RayTree::bounds(const RTCBoundsFunctionArguments* arguments) {
  const RayTree& tree = *static_cast<const RayTree*>(arguments->geometryUserPtr);
  Box box = tree.boxes_[arguments->primID];
  box.grow(tree.margin_);
  *arguments->bounds_o = box.bounds();
}

void RayTree::refit() {
  if (!scene_) return;
  const KeepFloatMode keep;
  all_ = {};
  for (const Box& box : boxes_) all_.add(box);
  margin_ = all_.margin();
  all_.grow(margin_);
  rtcCommitGeometry(geometry_);
  rtcCommitScene(scene_.get());
}

void RayTree::cast(unsigned lanes, TreeQuery& query) const {
  if (!scene_) return;
  Packet& packet = query.packet;
  packet.clear();
  for (unsigned rest = lanes; rest != 0; rest &= rest - 1) {
    const int lane = std::countr_zero(rest);
    const Vec3 &o = query.batch.world.o[lane], &d = query.batch.world.d[lane];
    const double enter = all_.entry(o, d);
    if (enter <= query.batch.t[lane] && enter < kNoHit) packet.add(lane, o, d, enter, query.batch.t[lane]);
  }
  packet.cast(scene_.get(), query);
}

StaticRayScene::StaticRayScene(const model::WorldModel& world, const model::BodyLayout& body_layout, bool visuals, Backend kind)
    : layout(body_layout),
      backend(kind),
      device_(kind == Backend::embree ? make_device() : nullptr),
      table(world, body_layout, visuals, device_.get()) {
  std::vector<Box> boxes;
  for (const int index : table.statics) {
    const Box& box = table.shapes[static_cast<size_t>(index)].box_F;
    if (fits_tree(box)) {
      bounded_.push_back(index);
      boxes.push_back(box);
    } else {
      unbounded_.push_back(index);
    }
  }
  if (backend == Backend::embree) tree_.build(device_.get(), std::move(boxes), test_primitive, false);
}

void StaticRayScene::cast(unsigned lanes, TreeQuery& query) const {
  for (const int index : unbounded_) {
    const RayShape& shape = table.shapes[static_cast<size_t>(index)];
    test_shape(shape, index, shape.into, lanes, query.batch.world, query.batch);
  }
  query.owner = this;
  tree_.cast(lanes, query);
}

void StaticRayScene::test_primitive(const RTCIntersectFunctionNArguments* arguments) {
  auto& query = *static_cast<TreeQuery*>(arguments->context);
  const auto& statics = *static_cast<const StaticRayScene*>(query.owner);
  run_callback(*arguments, query, [&](unsigned primitive, unsigned lanes) {
    const int index = statics.bounded_[primitive];
    const RayShape& shape = statics.table.shapes[static_cast<size_t>(index)];
    test_shape(shape, index, shape.into, lanes, query.batch.world, query.batch);
  });
}

std::shared_ptr<const StaticRayScene> make_static_ray_scene(const model::WorldModel& world, const model::BodyLayout& layout,
                                                            bool visuals, Backend backend) {
  return std::make_shared<const StaticRayScene>(world, layout, visuals, backend);
}

}  // namespace ruedo::scene
