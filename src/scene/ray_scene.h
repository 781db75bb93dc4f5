// Rays against the collision geometry: exact, in double precision, the same from every thread, for
// single rays and packets alike.
//
// StaticRayScene holds what never moves and is shared by all; a RayScene adds the movers and
// belongs to one module. Between update() calls, cast() is const and safe from many threads.
#pragma once

#include <limits>
#include <memory>
#include <span>

#include "model/body_layout.h"
#include "ruedo/snapshot.h"

namespace ruedo::scene {

// A ray that is none (not finite, a direction that is no unit vector within 0.1 %) hits nothing.
struct Ray {
  Vec3 origin = Vec3::Zero();                                  // m, world
  Vec3 direction = Vec3::UnitX();                              // unit, world
  double max_range = std::numeric_limits<double>::infinity();  // m; hits beyond it do not count
};

struct Hit {
  double range = std::numeric_limits<double>::infinity();  // m; +inf: nothing; 0: the origin is
                                                           // inside a closed shape
  LinkIndex link;                                          // none: nothing
  int shape =
      -1;  // index of the struck shape: collision of that link (or visual, as the scene is made)
  Vec3 normal = Vec3::Zero();  // unit, world, towards the ray's origin
  bool hit() const { return link.valid(); }
};

// How a caster is made. `reference` is plain loops over the shapes in double precision, for tests.
enum class Backend { embree, reference };

class StaticRayScene;

// world and layout must outlive the scene. `visuals` true: rays hit visuals instead of collisions.
std::shared_ptr<const StaticRayScene> make_static_ray_scene(const model::WorldModel& world,
                                                            const model::BodyLayout& layout,
                                                            bool visuals = false,
                                                            Backend backend = Backend::embree);

class RayScene {
 public:
  virtual ~RayScene() = default;

  // Moves the movers to where the snapshot has them. Not safe while another thread casts.
  virtual void update(const Snapshot& snapshot) = 0;

  // Casts rays[i] and writes hits[i]: the nearest hit, ties by the lowest link and shape.
  // `ignored_link` is not seen: a sensor's own link.
  // Faster for many rays near each other.
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
