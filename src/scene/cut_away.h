// Removes roofs and ceilings, so that a picture from above shows what is below them.
#pragma once

#include <memory>
#include <optional>

#include "world/model/world_model.h"

namespace ruedo::scene {

// The height (m, world) above which things hide what is below: set where, seen from above, more
// than half of the world lies under visuals higher than a person. nullopt: the world is open.
std::optional<double> height_of_ceiling(const world::WorldModel& world);

// The same world without the visuals above that height: whole shapes, and single triangles of
// meshes.
std::shared_ptr<const world::WorldModel> without_what_is_above(const world::WorldModel& world,
                                                               double height_m);

}  // namespace ruedo::scene
