// Models that come to a world and leave it, as the host of a run and a reader of its log both do
// it: names and places in the lists come out the same.
//
// What has left keeps its place in the list of models, which the next instance of the same model
// takes: when models come and go for days, the lists do not grow.
#pragma once

#include <memory>
#include <string>

#include "model/world_model.h"
#include "ruedo/spawn_request_t.hpp"

namespace ruedo::engine {

class WorldEditor {
 public:
  // The world must outlive it.
  explicit WorldEditor(model::WorldModel& world) : world_(world) {}

  struct Placed {
    InstanceIndex instance;  // index into the world's models
    bool reused;             // in the place of one that has left
  };
  Placed place(const std::string& name, const Pose& X_WM,
               std::shared_ptr<const model::Model> model);
  void remove(InstanceIndex instance);

 private:
  model::WorldModel& world_;
};

// Index of the model of that name; -1: there is none.
InstanceIndex find_model(const model::WorldModel& world, const std::string& name);

// Where a SPAWN puts a model: as it says, or standing on the ground below.
Pose spawn_pose(const model::WorldModel& world, const model::Model& model,
                const spawn_request_t& request);

}  // namespace ruedo::engine
