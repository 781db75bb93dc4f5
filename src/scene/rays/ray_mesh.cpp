#include "scene/rays/ray_mesh.h"

namespace ruedo::scene {

// The context of a packet's traversal; rays carry their lane as id.
struct RayMesh::Query : EmbreeContext {
  const RayMesh* mesh;
  const FrameRays* rays = nullptr;
  ShapeHit* hits = nullptr;
  const double* t_max = nullptr;
  Packet packet;
  const Vec3* counting_from = nullptr;  // not null: count signed crossings instead
  Shear shear;
  int crossings = 0;

  // Keeps the nearer hit; among equals that of the lower triangle.
  void offer(int lane, double t, int triangle) {
    ShapeHit& hit = hits[lane];
    if (t <= t_max[lane] && (t < hit.t || (t == hit.t && triangle < hit.feature)))
      hit = {t, triangle};
  }
};

RayMesh::RayMesh(const world::Mesh& mesh, const Vec3& scale, const Pose& X_FMesh)
    : triangles_(mesh.triangles), closed_(mesh.closed) {
  const Eigen::Matrix3d rotation = X_FMesh.rotation.toRotationMatrix();
  positions_.reserve(mesh.positions.size());
  for (const Eigen::Vector3f& p : mesh.positions)
    positions_.push_back(rotation * p.cast<double>().cwiseProduct(scale) + X_FMesh.translation);
  for (const auto& triangle : triangles_)
    for (const uint32_t corner : triangle) box_.add(positions_[corner]);
  margin_ = box_.margin();
  box_.grow(margin_);

  const auto share_edge = [&](int i, int j) {
    int common = 0;
    for (int k = 0; k < 9; ++k) common += corner(i, k / 3) == corner(j, k % 3);
    return common >= 2;
  };
  const int n = static_cast<int>(size());
  for (int i = 0; i < n;) {
    pairs_.push_back(i);
    i += i + 1 < n && share_edge(i, i + 1) ? 2 : 1;
  }
  pairs_.push_back(n);
}

void RayMesh::build_tree(RTCDevice device) {
  const KeepFloatMode keep;
  scene_.reset(rtcNewScene(device));
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
  rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(pairs_.size() - 1));
  rtcSetGeometryUserData(geometry, this);
  rtcSetGeometryBoundsFunction(geometry, bounds, nullptr);
  rtcSetGeometryIntersectFunction(geometry, intersect_pair);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene_.get(), geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene_.get());
}

Box RayMesh::pair_box(unsigned pair) const {
  Box box;
  for (int triangle = pairs_[pair]; triangle < pairs_[pair + 1]; ++triangle)
    for (int i = 0; i < 3; ++i) box.add(corner(triangle, i));
  return box;
}

void RayMesh::bounds(const RTCBoundsFunctionArguments* arguments) {
  const RayMesh& mesh = *static_cast<const RayMesh*>(arguments->geometryUserPtr);
  Box box = mesh.pair_box(arguments->primID);
  box.grow(mesh.margin_);
  *arguments->bounds_o = box.bounds();
}

void RayMesh::intersect_pair(const RTCIntersectFunctionNArguments* arguments) {
  auto& query = *static_cast<Query*>(arguments->context);
  const RayMesh& mesh = *query.mesh;
  const unsigned lanes = lanes_of(*arguments);
  for (int i = mesh.pairs_[arguments->primID]; i < mesh.pairs_[arguments->primID + 1]; ++i) {
    if (query.counting_from)
      query.crossings += mesh.crossing(i, *query.counting_from, query.shear);
    else
      mesh.test(i, lanes, *query.rays, [&](int lane, double t) { query.offer(lane, t, i); });
  }
  if (query.counting_from) return;
  shorten(*arguments, [&](unsigned lane) {
    return std::min(query.hits[lane].t, query.t_max[lane]) - query.packet.start[lane];
  });
}

void RayMesh::intersect(unsigned lanes, const FrameRays& rays, const double* t_max,
                        ShapeHit* hits) const {
  Query query;
  query.mesh = this;
  query.rays = &rays;
  query.hits = hits;
  query.t_max = t_max;
  for (unsigned rest = lanes; rest != 0; rest &= rest - 1) {
    const int lane = std::countr_zero(rest);
    hits[lane] = {kNoHit, std::numeric_limits<int>::max()};
    const double enter = box_.entry(rays.o[lane], rays.d[lane]);
    if (enter <= t_max[lane] && enter < kNoHit)
      query.packet.add(lane, rays.o[lane], rays.d[lane], enter, t_max[lane]);
  }
  if (scene_) {
    init_context(query);
    query.packet.cast(scene_.get(), query);
    return;
  }
  for (int i = 0; i < static_cast<int>(size()); ++i)
    test(i, lanes, rays, [&](int lane, double t) { query.offer(lane, t, i); });
}

int RayMesh::crossing(int triangle, const Vec3& o, const Shear& shear) const {
  const SeenTriangle s = seen(triangle, o, shear);
  const auto sign = [](double edge, double dy,
                       double dx) {  // ties are broken as if the ray were displaced by (e, e^2)
    const double first = edge != 0.0 ? edge : dy != 0.0 ? dy : dx;
    return (first > 0.0) - (first < 0.0);
  };
  const int u = sign(s.u, s.cy - s.by, s.bx - s.cx);
  const int v = sign(s.v, s.ay - s.cy, s.cx - s.ax);
  const int w = sign(s.w, s.by - s.ay, s.ax - s.bx);
  if (u == 0 || u != v || u != w || s.u + s.v + s.w == 0.0 || !(s.t(shear) > 0.0)) return 0;
  return -u;  // positive when seen from the front: the ray enters
}

const Vec3& RayMesh::way_out() {
  static const Vec3 kUp =
      Vec3(0.0123, 0.0171, 1.0).normalized();  // not parallel to faces or edges in usual meshes
  return kUp;
}

bool RayMesh::inside(const Vec3& point) const {
  if (!closed_ || !box_.contains(point)) return false;
  Query query;
  query.mesh = this;
  query.counting_from = &point;
  query.shear = Shear(way_out());
  if (scene_) {
    init_context(query);
    query.packet.add(0, point, way_out(), 0.0, kNoHit);
    query.packet.cast(scene_.get(), query);
  } else {
    for (int i = 0; i < static_cast<int>(size()); ++i)
      query.crossings += crossing(i, point, query.shear);
  }
  return query.crossings != 0;
}

Vec3 RayMesh::normal(int triangle) const {
  const Vec3& a = corner(triangle, 0);
  return (corner(triangle, 1) - a).cross(corner(triangle, 2) - a).normalized();
}

}  // namespace ruedo::scene
