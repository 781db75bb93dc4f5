// Roofs and ceilings taken off a world, so that a picture from above shows what is below them.
#pragma once

#include <memory>
#include <optional>

#include "model/world_model.h"

namespace ruedo::scene {

// The height (m, world) above which things hide what is below them: where more than half of the
// world, as seen from above, lies under visuals higher than a person. nullopt: it lies open.
std::optional<double> height_of_ceiling(const model::WorldModel& world);

// The same world without what is seen of it above that height: shapes that lie there, and the
// triangles of meshes.
std::shared_ptr<const model::WorldModel> without_what_is_above(const model::WorldModel& world,
                                                               double height_m);

}  // namespace ruedo::scene
