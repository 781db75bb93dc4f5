// Inserts and removes models, identically in a running world and in the reader of its log: names
// and places in the lists come out the same.
//
// A removed model keeps its place in the list, which the next instance of the same model reuses:
// the lists do not grow when models come and go for days.
#pragma once

#include <memory>
#include <string>

#include "ruedo/spawn_request_t.hpp"
#include "world/model/world_model.h"

namespace ruedo::engine {

class WorldEditor {
 public:
  // The world must outlive it.
  explicit WorldEditor(world::WorldModel& world) : world_(world) {}

  struct Placed {
    InstanceIndex instance;  // index into the world's models
    bool reused;             // in the place of a removed one
  };
  Placed place(const std::string& name, const Pose& X_WM,
               std::shared_ptr<const world::Model> model);
  void remove(InstanceIndex instance);

 private:
  world::WorldModel& world_;
};

// Index of the model with that name; -1: unknown.
InstanceIndex find_model(const world::WorldModel& world, const std::string& name);

// The pose for a SPAWN: as requested, or standing on the ground below.
Pose spawn_pose(const world::WorldModel& world, const world::Model& model,
                const spawn_request_t& request);

}  // namespace ruedo::engine
