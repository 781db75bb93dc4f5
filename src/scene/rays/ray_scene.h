// Rays against collision geometry: exact, in double precision, with the same results from every
// thread, and for single rays and packets alike.
//
// StaticRayScene holds what never moves and is shared; a RayScene adds the movers and belongs to
// one module. Between update() calls, cast() is const and thread-safe.
#pragma once

#include <limits>
#include <memory>
#include <span>

#include "ruedo/snapshot.h"
#include "world/model/body_layout.h"

namespace ruedo::scene {

// An invalid ray (not finite, or a direction whose length is off by more than 0.1 %) hits nothing.
struct Ray {
  Vec3 origin = Vec3::Zero();                                  // m, world
  Vec3 direction = Vec3::UnitX();                              // unit, world
  double max_range = std::numeric_limits<double>::infinity();  // m; hits beyond it do not count
};

struct Hit {
  // m; +inf: no hit; 0: the origin is inside a closed shape
  double range = std::numeric_limits<double>::infinity();
  LinkIndex link;              // none: nothing
  ShapeIndex shape;            // of the link: a collision (or a visual, see StaticRayScene)
  Vec3 normal = Vec3::Zero();  // unit, world, towards the ray's origin
  bool hit() const { return link.valid(); }
};

// `reference`: plain loops over the shapes in double precision, for tests.
enum class Backend { embree, reference };

class StaticRayScene;

// world and layout must outlive the scene. visuals: rays hit visuals instead of collisions.
std::shared_ptr<const StaticRayScene> make_static_ray_scene(const world::WorldModel& world,
                                                            const world::BodyLayout& layout,
                                                            bool visuals = false,
                                                            Backend backend = Backend::embree);

class RayScene {
 public:
  virtual ~RayScene() = default;

  // Moves the movers to their poses in the snapshot. Not safe while another thread casts.
  virtual void update(const Snapshot& snapshot) = 0;

  // Casts rays[i] and writes hits[i]: the nearest hit, with ties going to the lowest link and
  // shape. `ignored_link` is invisible: a sensor's own link. Faster for rays that are close
  // together.
  virtual void cast(std::span<const Ray> rays, std::span<Hit> hits,
                    LinkIndex ignored_link = {}) const = 0;

  Hit cast(const Ray& ray, LinkIndex ignored_link = {}) const {
    Hit hit;
    cast(std::span(&ray, 1), std::span(&hit, 1), ignored_link);
    return hit;
  }
};

std::unique_ptr<RayScene> make_ray_scene(std::shared_ptr<const StaticRayScene> statics);

}  // namespace ruedo::scene
