// The parts of Embree that the caster needs, the same for Embree 3 and 4: a device, packets of
// eight rays, and room for our own data beside Embree's context.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#if defined(__SSE2__)
#include <xmmintrin.h>
#endif

#if RUEDO_EMBREE == 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include "ruedo/pose.h"

namespace ruedo::scene {

inline constexpr int kLanes = 8;  // rays in a packet

#if RUEDO_EMBREE == 4
using EmbreeContext = RTCRayQueryContext;
inline void init_context(EmbreeContext& context) { rtcInitRayQueryContext(&context); }
inline void intersect(RTCScene scene, EmbreeContext& context, RTCRayHit& ray) {
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.context = &context;
  rtcIntersect1(scene, &ray, &arguments);
}
inline void intersect(RTCScene scene, EmbreeContext& context, const int* valid, RTCRayHit8& rays) {
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.context = &context;
  rtcIntersect8(valid, scene, &rays, &arguments);
}
#else
using EmbreeContext = RTCIntersectContext;
inline void init_context(EmbreeContext& context) { rtcInitIntersectContext(&context); }
inline void intersect(RTCScene scene, EmbreeContext& context, RTCRayHit& ray) {
  rtcIntersect1(scene, &context, &ray);
}
inline void intersect(RTCScene scene, EmbreeContext& context, const int* valid, RTCRayHit8& rays) {
  rtcIntersect8(valid, scene, &context, &rays);
}
#endif

// A build may change the thread's denormal mode; physics in the same thread must not be affected.
class KeepFloatMode {
 public:
#if defined(__SSE2__)
  KeepFloatMode() : mode_(_mm_getcsr()) {}
  ~KeepFloatMode() { _mm_setcsr(mode_); }

 private:
  unsigned mode_;
#else
  KeepFloatMode() {}
#endif
  KeepFloatMode(const KeepFloatMode&) = delete;
  KeepFloatMode& operator=(const KeepFloatMode&) = delete;
};

struct ReleaseEmbree {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};
using DevicePtr = std::unique_ptr<std::remove_pointer_t<RTCDevice>, ReleaseEmbree>;
using ScenePtr = std::unique_ptr<std::remove_pointer_t<RTCScene>, ReleaseEmbree>;

// Without "threads=1", although only builds would use more: Embree would apply the limit to TBB in
// the whole process, and take the second core from the modules.
inline DevicePtr make_device() { return DevicePtr(rtcNewDevice("set_affinity=0")); }

// A float slightly above t >= 0.
inline float just_beyond(double t) { return static_cast<float>(t) * (1.0f + 2.5e-7f); }

// The smallest float that is not below x, and the largest that is not above it.
inline float round_up(double x) {
  const float f = static_cast<float>(x);
  return f < x ? std::nextafterf(f, std::numeric_limits<float>::infinity()) : f;
}
inline float round_down(double x) {
  const float f = static_cast<float>(x);
  return f > x ? std::nextafterf(f, -std::numeric_limits<float>::infinity()) : f;
}

// The lanes (bits) that a callback must decide.
inline unsigned lanes_of(const RTCIntersectFunctionNArguments& arguments) {
  RTCRayN* rays = RTCRayHitN_RayN(arguments.rayhit, arguments.N);
  unsigned lanes = 0;
  for (unsigned i = 0; i < arguments.N; ++i)
    if (arguments.valid[i]) lanes |= 1u << RTCRayN_id(rays, arguments.N, i);
  return lanes;
}

// Ends each ray at far(lane) >= 0 or just beyond, so that hits at equal distance are still found.
template <class Far>
void shorten(const RTCIntersectFunctionNArguments& arguments, Far far) {
  RTCRayN* rays = RTCRayHitN_RayN(arguments.rayhit, arguments.N);
  for (unsigned i = 0; i < arguments.N; ++i)
    if (arguments.valid[i])
      RTCRayN_tfar(rays, arguments.N, i) = just_beyond(far(RTCRayN_id(rays, arguments.N, i)));
}

// An axis-aligned box, in double.
struct Box {
  Vec3 lower = Vec3::Constant(std::numeric_limits<double>::infinity());
  Vec3 upper = -lower;

  bool empty() const { return !(lower.x() <= upper.x()); }
  void add(const Vec3& point) {
    lower = lower.cwiseMin(point);
    upper = upper.cwiseMax(point);
  }
  void add(const Box& box) {
    lower = lower.cwiseMin(box.lower);
    upper = upper.cwiseMax(box.upper);
  }
  void grow(double margin) {
    lower.array() -= margin;
    upper.array() += margin;
  }
  bool contains(const Vec3& p) const {
    return (p.array() >= lower.array()).all() && (p.array() <= upper.array()).all();
  }
  // How far boxes within this one are enlarged so that the single-precision traversal never misses
  // what the double-precision test would find: rays start in this box, and their rounding errors
  // are a few parts in 2^22 of its coordinates.
  double margin() const {
    return empty()
               ? 0.0
               : 1e-9 + 4e-6 * std::max(lower.cwiseAbs().maxCoeff(), upper.cwiseAbs().maxCoeff());
  }
  RTCBounds bounds() const {
    return {round_down(lower.x()), round_down(lower.y()), round_down(lower.z()), 0.0f,
            round_up(upper.x()),   round_up(upper.y()),   round_up(upper.z()),   0.0f};
  }
  // A generous bound for coordinates of this size: a box enlarged by it is not missed in double
  // precision.
  double rounding() const {
    return 1e-9 + 1e-12 * std::max(lower.cwiseAbs().maxCoeff(), upper.cwiseAbs().maxCoeff());
  }
  bool overlaps(const Box& other) const {
    return (lower.array() <= other.upper.array()).all() &&
           (other.lower.array() <= upper.array()).all();
  }
  // Narrows [enter, exit] to the part of the line inside the box; false if nothing is left.
  bool clip(const Vec3& o, const Vec3& d, double& enter, double& exit) const {
    for (int axis = 0; axis < 3; ++axis) {
      if (d[axis] == 0.0) {
        if (o[axis] < lower[axis] || o[axis] > upper[axis]) return false;
        continue;
      }
      const double inverse = 1.0 / d[axis];
      const double a = (lower[axis] - o[axis]) * inverse, b = (upper[axis] - o[axis]) * inverse;
      enter = std::max(enter, std::min(a, b));
      exit = std::min(exit, std::max(a, b));
    }
    return enter <= exit;
  }
  // Distance at which the ray enters the box, 0 if it starts inside; +inf if it misses.
  double entry(const Vec3& o, const Vec3& d) const {
    if (contains(o)) return 0.0;
    double enter = 0.0, exit = std::numeric_limits<double>::infinity();
    return clip(o, d, enter, exit) ? enter : std::numeric_limits<double>::infinity();
  }
};

// Eight rays for Embree. Each starts where it enters the scene's box, so that its coordinates are
// of the scene's magnitude; `start` is that distance.
struct Packet {
  RTCRayHit8 rays;
  alignas(32) int valid[kLanes];
  double start[kLanes];
  int active = 0, last = 0;  // number of valid lanes, and one of them

  Packet() { clear(); }
  void clear() {
    std::fill(valid, valid + kLanes, 0);
    active = 0;
  }

  void add(int lane, const Vec3& o, const Vec3& d, double enter, double far) {
    const Vec3 p = enter == 0.0 ? o : Vec3(o + enter * d);
    RTCRay8& r = rays.ray;
    r.org_x[lane] = static_cast<float>(p.x());
    r.org_y[lane] = static_cast<float>(p.y());
    r.org_z[lane] = static_cast<float>(p.z());
    r.dir_x[lane] = static_cast<float>(d.x());
    r.dir_y[lane] = static_cast<float>(d.y());
    r.dir_z[lane] = static_cast<float>(d.z());
    r.tnear[lane] = 0.0f;
    r.tfar[lane] = just_beyond(far - enter);
    r.time[lane] = 0.0f;
    r.mask[lane] = ~0u;
    r.id[lane] = static_cast<unsigned>(lane);
    r.flags[lane] = 0;
    rays.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
    valid[lane] = -1;
    start[lane] = enter;
    ++active;
    last = lane;
  }

  // Without AVX, Embree tests inactive lanes too, in other groups: they end before they start.
  void blank(int lane) {
    add(lane, Vec3::Zero(), Vec3::UnitX(), 0.0, 0.0);
    rays.ray.tfar[lane] = -1.0f;
    valid[lane] = 0;
    --active;
  }

  // Casts the rays added; a lone ray is cast singly, which is faster and gives the same result.
  void cast(RTCScene scene, EmbreeContext& context) {
    if (active == 0) return;
    if (active > 1) {
      for (int lane = 0; active < kLanes && lane < kLanes; ++lane)
        if (!valid[lane]) blank(lane);
      return intersect(scene, context, valid, rays);
    }
    const RTCRay8& r = rays.ray;
    RTCRayHit one;
    one.ray = {r.org_x[last], r.org_y[last], r.org_z[last], 0.0f, r.dir_x[last], r.dir_y[last],
               r.dir_z[last], 0.0f,          r.tfar[last],  ~0u,  r.id[last],    0u};
    one.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    intersect(scene, context, one);
  }
};

}  // namespace ruedo::scene
