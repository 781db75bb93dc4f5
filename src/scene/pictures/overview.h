// The part of a world that a picture from outside shows, for somebody who sees it first.
#pragma once

#include <memory>
#include <optional>

#include "scene/pictures/render_scene.h"
#include "world/model/world_model.h"

namespace ruedo::scene {

struct Overview {
  // The box of all robots and nearly all of the models, by volume: without one far outside, and
  // without a floor that is much larger than the things on it.
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
