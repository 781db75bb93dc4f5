// Embree's own triangles in single precision without our code: what the ray caster is measured
// against.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "scene/rays/ray_embree.h"
#include "scene/rays/ray_scene.h"
#include "world/model/mesh.h"

namespace ruedo::bench {

class BareEmbree {
 public:
  explicit BareEmbree(const world::Mesh& mesh) {
    RTCGeometry geometry = rtcNewGeometry(device_.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* p = static_cast<float*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, mesh.positions.size()));
    auto* t = static_cast<uint32_t*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, mesh.triangles.size()));
    for (const auto& v : mesh.positions) p = std::copy(v.data(), v.data() + 3, p);
    for (const auto& v : mesh.triangles) t = std::copy(v.begin(), v.end(), t);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_.get(), geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene_.get());
  }

  // ranges[i] of rays[i], m; max_range where nothing is hit. By packets of eight, or one by one.
  void cast(const std::vector<scene::Ray>& rays, std::vector<double>& ranges, bool packets) const {
    scene::EmbreeContext context;
    scene::init_context(context);
    for (size_t first = 0; first < rays.size(); first += packets ? scene::kLanes : 1) {
      scene::Packet packet;
      const size_t last = packets ? std::min(rays.size(), first + scene::kLanes) : first + 1;
      for (size_t i = first; i < last; ++i) {
        packet.add(static_cast<int>(i - first), rays[i].origin, rays[i].direction, 0.0,
                   rays[i].max_range);
      }
      if (packets) {
        scene::intersect(scene_.get(), context, packet.valid, packet.rays);
        for (size_t i = first; i < last; ++i)
          ranges[i] = static_cast<double>(packet.rays.ray.tfar[i - first]);
      } else {
        const RTCRay8& r = packet.rays.ray;
        RTCRayHit one;
        one.ray = {r.org_x[0], r.org_y[0], r.org_z[0], 0,   r.dir_x[0], r.dir_y[0],
                   r.dir_z[0], 0,          r.tfar[0],  ~0u, 0,          0};
        one.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        scene::intersect(scene_.get(), context, one);
        ranges[first] = static_cast<double>(one.ray.tfar);
      }
    }
  }

 private:
  scene::DevicePtr device_ = scene::make_device();
  scene::ScenePtr scene_{rtcNewScene(device_.get())};
};

}  // namespace ruedo::bench
