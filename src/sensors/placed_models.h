// Models as wholes, in the world's state.
#pragma once

#include "model/body_layout.h"
#include "ruedo/snapshot.h"

namespace ruedo {

// X_WL of a link.
inline Pose link_pose(const model::BodyLayout& layout, LinkIndex link, const Snapshot& now) {
  const model::LinkPlacement& placement = layout.links[link];
  if (!placement.body.valid()) return placement.X_BL;
  return now.bodies[placement.body] * layout.link_in_body(link, now.wheel_angles);
}

// X_WM, of a model that goes with its first link.
inline Pose model_pose(const model::WorldModel& world, const model::BodyLayout& layout,
                       InstanceIndex instance, const Snapshot& now) {
  const model::Model& model = *world.models[instance].model;
  return link_pose(layout, layout.first_link[instance], now) * model.links.front().X_ML.inverse();
}

}  // namespace ruedo
