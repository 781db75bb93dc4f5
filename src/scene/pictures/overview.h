// What of a world is shown from outside, so that a stranger sees it at once.
#pragma once

#include <memory>
#include <optional>

#include "scene/pictures/render_scene.h"
#include "world/model/world_model.h"

namespace ruedo::scene {

struct Overview {
  // What holds all robots and nearly all of the models, by volume: one that lies far outside does
  // not count, nor does a floor that is much larger than what stands on it.
  Bounds shown;
  double floor = 0.0;  // m, world: what robots stand on
  // m, world: things above it hide what is below; set where, seen from above, more than half of
  // what is shown lies under visuals of fixed models higher than a person. nullopt: it is open.
  std::optional<double> ceiling;
};
Overview overview(const world::WorldModel& world);

// The same world without the visuals of fixed models above that height: whole shapes, and single
// triangles of meshes.
std::shared_ptr<const world::WorldModel> without_what_is_above(const world::WorldModel& world,
                                                               double height_m);

}  // namespace ruedo::scene
