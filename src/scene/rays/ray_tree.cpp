// The Embree side of the caster: finds boxes and triangles that a packet of rays may hit.
#include "scene/rays/ray_static.h"

namespace ruedo::scene {

void RayTree::attach(RTCDevice device, size_t primitives, void* user,
                     RTCBoundsFunction bounds_function, RTCIntersectFunctionN callback) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
  rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(primitives));
  rtcSetGeometryUserData(geometry, user);
  rtcSetGeometryBoundsFunction(geometry, bounds_function, nullptr);
  rtcSetGeometryIntersectFunction(geometry, callback);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene_.get(), geometry);
  rtcReleaseGeometry(geometry);  // the scene keeps it
}

void RayTree::build(RTCDevice device, std::vector<Box> boxes, RTCIntersectFunctionN callback,
                    const std::vector<std::pair<int, const RayShape*>>& meshes) {
  if (boxes.empty() && meshes.empty()) return;
  const KeepFloatMode keep;
  boxes_ = std::move(boxes);
  for (const Box& box : boxes_) all_.add(box);
  for (const auto& [index, shape] : meshes) {
    triangles_.push_back({this, shape, index});
    all_.add(shape->mesh->box());
  }
  margin_ = all_.margin();
  all_.grow(margin_);
  scene_.reset(rtcNewScene(device));
  if (!boxes_.empty()) attach(device, boxes_.size(), this, bounds, callback);
  for (Triangles& part : triangles_)
    attach(device, part.shape->mesh->pairs().size() - 1, &part, pair_bounds, test_pair);
  rtcCommitScene(scene_.get());
}

void RayTree::bounds(const RTCBoundsFunctionArguments* arguments) {
  const RayTree& tree = *static_cast<const RayTree*>(arguments->geometryUserPtr);
  Box box = tree.boxes_[arguments->primID];
  box.grow(tree.margin_);
  *arguments->bounds_o = box.bounds();
}

void RayTree::pair_bounds(const RTCBoundsFunctionArguments* arguments) {
  const Triangles& part = *static_cast<const Triangles*>(arguments->geometryUserPtr);
  Box box = part.shape->mesh->pair_box(arguments->primID);
  box.grow(part.tree->margin_);
  *arguments->bounds_o = box.bounds();
}

void RayTree::test_pair(const RTCIntersectFunctionNArguments* arguments) {
  auto& query = *static_cast<TreeQuery*>(arguments->context);
  const Triangles& part = *static_cast<const Triangles*>(arguments->geometryUserPtr);
  const RayMesh& mesh = *part.shape->mesh;
  RayBatch& batch = query.batch;
  if (part.shape->link == batch.ignored_link && !query.counting) return;
  if (query.counting && query.counting != &mesh) return;
  const unsigned lanes = lanes_of(*arguments);
  for (int i = mesh.pairs()[arguments->primID]; i < mesh.pairs()[arguments->primID + 1]; ++i) {
    if (query.counting)
      query.crossings += mesh.crossing(i, query.counting_from, query.shear);
    else
      mesh.test(i, lanes, batch.world,
                [&](int lane, double t) { batch.offer(lane, {t, i}, part.index); });
  }
  if (query.counting) return;
  shorten(*arguments, [&](unsigned lane) { return batch.t[lane] - query.packet.start[lane]; });
}

void RayTree::cast(unsigned lanes, TreeQuery& query) const {
  if (!scene_) return;
  Packet& packet = query.packet;
  packet.clear();
  for (unsigned rest = lanes; rest != 0; rest &= rest - 1) {
    const int lane = std::countr_zero(rest);
    const Vec3 &o = query.batch.world.o[lane], &d = query.batch.world.d[lane];
    const double enter = all_.entry(o, d);
    if (enter <= query.batch.t[lane] && enter < kNoHit)
      packet.add(lane, o, d, enter, query.batch.t[lane]);
  }
  packet.cast(scene_.get(), query);
}

bool RayTree::inside(const RayMesh& mesh, const Vec3& point) const {
  if (!mesh.closed() || !mesh.box().contains(point)) return false;
  TreeQuery query;
  query.counting = &mesh;
  query.counting_from = point;
  query.shear = Shear(RayMesh::way_out());
  const double height = mesh.box().upper.z() - point.z();
  query.packet.add(0, point, RayMesh::way_out(), 0.0, height / RayMesh::way_out().z());
  query.packet.cast(scene_.get(), query);
  return query.crossings != 0;
}

}  // namespace ruedo::scene
