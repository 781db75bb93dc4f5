// Models as wholes, in the world's state.
#pragma once

#include "model/body_layout.h"
#include "ruedo/snapshot.h"

namespace ruedo {

// X_WL of a link.
inline Pose link_pose(const model::BodyLayout& layout, int link, const Snapshot& now) {
  const model::LinkPlacement& placement = layout.links[static_cast<size_t>(link)];
  if (placement.body < 0) return placement.X_BL;
  return now.bodies[static_cast<size_t>(placement.body)] *
         layout.link_in_body(link, now.wheel_angles);
}

// X_WM, of a model that goes with its first link.
inline Pose model_pose(const model::WorldModel& world, const model::BodyLayout& layout,
                       int instance, const Snapshot& now) {
  const model::Model& model = *world.models[static_cast<size_t>(instance)].model;
  const int first = layout.first_link[static_cast<size_t>(instance)];
  return link_pose(layout, first, now) * model.links.front().X_ML.inverse();
}

}  // namespace ruedo
