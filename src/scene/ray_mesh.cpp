#include "scene/ray_mesh.h"

#include <bit>

namespace ruedo::scene {

ShearedRay::ShearedRay(const Vec3& o, const Vec3& d) : origin(o) {
  d.cwiseAbs().maxCoeff(&kz);
  kx = kz == 2 ? 0 : kz + 1;
  ky = kx == 2 ? 0 : kx + 1;
  if (d[kz] < 0.0) std::swap(kx, ky);    // keeps the winding
  sx = d[kx] / d[kz];
  sy = d[ky] / d[kz];
  sz = 1.0 / d[kz];
}

namespace {

// A triangle's corners in the ray's frame, and its edge functions.
struct Sheared {
  double ax, ay, az, bx, by, bz, cx, cy, cz;
  double u, v, w;

  Sheared(const ShearedRay& r, const Vec3& a0, const Vec3& b0, const Vec3& c0) {
    const Vec3 a = a0 - r.origin, b = b0 - r.origin, c = c0 - r.origin;
    az = a[r.kz];
    bz = b[r.kz];
    cz = c[r.kz];
    ax = a[r.kx] - r.sx * az;
    ay = a[r.ky] - r.sy * az;
    bx = b[r.kx] - r.sx * bz;
    by = b[r.ky] - r.sy * bz;
    cx = c[r.kx] - r.sx * cz;
    cy = c[r.ky] - r.sy * cz;
    u = cx * by - cy * bx;
    v = ax * cy - ay * cx;
    w = bx * ay - by * ax;
  }
  double t(const ShearedRay& r) const { return r.sz * (u * az + v * bz + w * cz) / (u + v + w); }
};

}  // namespace

// The context of one run through a tree; lanes are found by the ray's id.
struct RayMesh::Query : EmbreeContext {
  const RayMesh* mesh;
  MeshRay lanes[kLanes];
  double start[kLanes];
  bool counting = false;    // signed crossings of lane 0 instead of the nearest hit
  int crossings = 0;
};

RayMesh::RayMesh(const model::Mesh& mesh, const Vec3& scale, RTCDevice device)
    : triangles_(mesh.triangles), closed_(mesh.closed) {
  positions_.reserve(mesh.positions.size());
  for (const Eigen::Vector3f& p : mesh.positions) positions_.push_back(p.cast<double>().cwiseProduct(scale));
  for (const auto& triangle : triangles_)
    for (const uint32_t corner : triangle) box_.add(positions_[corner]);
  margin_ = box_.margin();
  box_.grow(margin_);
  if (!device || triangles_.empty()) return;

  const KeepFloatMode keep;
  scene_.reset(rtcNewScene(device));
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
  rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(triangles_.size()));
  rtcSetGeometryUserData(geometry, this);
  rtcSetGeometryBoundsFunction(geometry, bounds, nullptr);
  rtcSetGeometryIntersectFunction(geometry, intersect_triangle);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene_.get(), geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene_.get());
}

void RayMesh::bounds(const RTCBoundsFunctionArguments* arguments) {
  const RayMesh& mesh = *static_cast<const RayMesh*>(arguments->geometryUserPtr);
  Box box;
  for (const uint32_t corner : mesh.triangles_[arguments->primID]) box.add(mesh.positions_[corner]);
  box.grow(mesh.margin_);
  *arguments->bounds_o = box.bounds();
}

void RayMesh::test(int triangle, MeshRay& ray) const {
  const auto& corners = triangles_[static_cast<size_t>(triangle)];
  const Sheared s(ray.ray, positions_[corners[0]], positions_[corners[1]], positions_[corners[2]]);
  if ((s.u < 0.0 || s.v < 0.0 || s.w < 0.0) && (s.u > 0.0 || s.v > 0.0 || s.w > 0.0)) return;
  if (s.u + s.v + s.w == 0.0) return;    // edge on, or no area
  const double t = s.t(ray.ray);
  if (!(t >= 0.0)) return;
  if (t < ray.t || (t == ray.t && (ray.triangle < 0 || triangle < ray.triangle))) {
    ray.t = t;
    ray.triangle = triangle;
  }
}

// +1 where the ray leaves through the triangle, -1 where it enters, 0 where it misses. A ray through an edge or a
// corner is moved aside by less than any number, the same way for all triangles: so each crossing counts once.
int RayMesh::crossing(int triangle, const ShearedRay& ray) const {
  const auto& corners = triangles_[static_cast<size_t>(triangle)];
  const Sheared s(ray, positions_[corners[0]], positions_[corners[1]], positions_[corners[2]]);
  const auto sign = [](double edge, double dy, double dx) {
    const double first = edge != 0.0 ? edge : dy != 0.0 ? dy : dx;
    return (first > 0.0) - (first < 0.0);
  };
  const int u = sign(s.u, s.cy - s.by, s.bx - s.cx);
  const int v = sign(s.v, s.ay - s.cy, s.cx - s.ax);
  const int w = sign(s.w, s.by - s.ay, s.ax - s.bx);
  if (u == 0 || u != v || u != w) return 0;
  const double det = s.u + s.v + s.w;
  if (det == 0.0 || !(s.t(ray) > 0.0)) return 0;
  return -u;    // seen from the front: the ray enters
}

void RayMesh::intersect_triangle(const RTCIntersectFunctionNArguments* arguments) {
  auto& query = *static_cast<Query*>(arguments->context);
  RTCRayN* rays = RTCRayHitN_RayN(arguments->rayhit, arguments->N);
  const int triangle = static_cast<int>(arguments->primID);
  if (query.counting) {
    query.crossings += query.mesh->crossing(triangle, query.lanes[0].ray);
    return;
  }
  for (unsigned i = 0; i < arguments->N; ++i) {
    if (!arguments->valid[i]) continue;
    const unsigned lane = RTCRayN_id(rays, arguments->N, i);
    MeshRay& ray = query.lanes[lane];
    const double before = ray.t;
    query.mesh->test(triangle, ray);
    if (ray.t < before) RTCRayN_tfar(rays, arguments->N, i) = round_up(ray.t - query.start[lane]);
  }
}

void RayMesh::intersect(unsigned lanes, const Vec3* o, const Vec3* d, const double* t_max, ShapeHit* hits) const {
  Query query;
  Packet packet;
  for (unsigned rest = lanes; rest != 0; rest &= rest - 1) {
    const int lane = std::countr_zero(rest);
    hits[lane] = {};
    const double enter = box_.entry(o[lane], d[lane]);
    if (!(enter <= t_max[lane]) || enter == kNoHit) continue;
    MeshRay& ray = query.lanes[lane];
    ray.ray = ShearedRay(o[lane], d[lane]);
    ray.t = t_max[lane];
    ray.triangle = -1;
    query.start[lane] = enter;
    packet.add(lane, o[lane], d[lane], enter, t_max[lane]);
  }
  if (packet.active == 0) return;
  if (scene_) {
    init_context(query);
    query.mesh = this;
    packet.cast(scene_.get(), query);
  } else {
    for (int lane = 0; lane < kLanes; ++lane)
      if (packet.valid[lane])
        for (size_t i = 0; i < triangles_.size(); ++i) test(static_cast<int>(i), query.lanes[lane]);
  }
  for (int lane = 0; lane < kLanes; ++lane)
    if (packet.valid[lane] && query.lanes[lane].triangle >= 0) hits[lane] = {query.lanes[lane].t, query.lanes[lane].triangle};
}

bool RayMesh::inside(const Vec3& point) const {
  if (!closed_ || !box_.contains(point)) return false;
  static const Vec3 kUp = Vec3(0.0123, 0.0171, 1.0).normalized();    // along no face or edge that people draw
  const ShearedRay ray(point, kUp);
  int crossings = 0;
  if (scene_) {
    Query query;
    init_context(query);
    query.mesh = this;
    query.counting = true;
    query.lanes[0].ray = ray;
    Packet packet;
    packet.add(0, point, kUp, 0.0, kNoHit);
    packet.cast(scene_.get(), query);
    crossings = query.crossings;
  } else {
    for (size_t i = 0; i < triangles_.size(); ++i) crossings += crossing(static_cast<int>(i), ray);
  }
  return crossings != 0;
}

Vec3 RayMesh::normal(int triangle) const {
  const auto& corners = triangles_[static_cast<size_t>(triangle)];
  const Vec3& a = positions_[corners[0]];
  return (positions_[corners[1]] - a).cross(positions_[corners[2]] - a).normalized();
}

}  // namespace ruedo::scene
