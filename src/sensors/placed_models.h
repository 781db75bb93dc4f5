// Whole models in the world's current state.
#pragma once

#include <algorithm>
#include <string>

#include "ruedo/logical_object_t.hpp"
#include "ruedo/snapshot.h"
#include "world/model/body_layout.h"

namespace ruedo {

// X_WL of a link.
inline Pose link_pose(const world::BodyLayout& layout, LinkIndex link, const Snapshot& now) {
  const world::LinkPlacement& placement = layout.links[link];
  if (!placement.body.valid()) return placement.X_BL;
  return now.bodies[placement.body] * layout.link_in_body(link, now.wheel_angles);
}

// X_WM; the model moves with its first link.
inline Pose model_pose(const world::WorldModel& world, const world::BodyLayout& layout,
                       InstanceIndex instance, const Snapshot& now) {
  const world::Model& model = *world.models[instance].model;
  return link_pose(layout, layout.first_link[instance], now) * model.links.front().X_ML.inverse();
}

// A model as in messages; X_SM: its pose in the device's frame.
inline void put(const std::string& model, const Pose& X_SM, logical_object_t& object) {
  object.model = model;
  const Quat& q = X_SM.rotation;
  const double wxyz[] = {q.w(), q.x(), q.y(), q.z()};
  std::copy(std::begin(wxyz), std::end(wxyz), object.orientation);
  std::copy_n(X_SM.translation.data(), 3, object.position);
}

}  // namespace ruedo
