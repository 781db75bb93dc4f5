// Changes of the world that requests ask for: models come and go, are put elsewhere, are pushed.
//
// Each function checks a request's body and carries it out on a simulation that stands still; the
// effect is on the state that was computed last. The same body on the same state does the same, so
// a log needs no more than the bodies: a name that is left to the server, and the height of the
// ground, follow from the state.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "engine/outcome.h"
#include "engine/simulation.h"
#include "model/load_model.h"
#include "ruedo/set_pose_request_t.hpp"
#include "ruedo/set_twist_request_t.hpp"
#include "ruedo/spawn_request_t.hpp"

namespace ruedo::engine {

inline constexpr double kFarthest_m = 1e6, kFastest_m_s = 1e3,
                        kFastest_rad_s = 1e4;  // that a request may ask for
inline constexpr size_t kMostModels = 10'000;  // of a world, the places of removed ones included

// Models that came with requests. A file that was not touched since, or the same text, is read once
// as long as any model of a world is of it. Thread safe.
class ModelStore {
 public:
  explicit ModelStore(std::string world_file) : world_file_(std::move(world_file)) {}
  // Throws InputError. budget: may be null.
  model::LoadedModel load(const spawn_request_t& request, model::LoadBudget* budget = nullptr);

 private:
  struct Known {
    std::weak_ptr<const model::Model> model;
    model::LoadedModel rest;  // without the model
  };
  std::string world_file_;
  std::mutex mutex_;
  std::map<std::string, Known> known_;
};

// That name, or with _2, _3, ... when it is taken: of a spawned model that was given none.
std::string unused_name(const model::WorldModel& world, const std::string& name);

// What can be said before the model is read; OK: nothing is wrong.
Outcome check_spawn(const spawn_request_t& request);
// step: of the first state that shows it. name: becomes the model's.
Outcome spawn(const spawn_request_t& request, const model::LoadedModel& loaded, int64_t step,
              Simulation& simulation, Channels& channels, std::string& name);
Outcome remove(const std::string& name, Simulation& simulation, Channels& channels);
// A model that stands fast, static or by a joint with the world, is taken out and put in again.
// step: of the first state that shows it.
Outcome set_pose(const set_pose_request_t& request, int64_t step, Simulation& simulation,
                 Channels& channels);
Pose pose_of(const set_pose_request_t& request);
// Whether the model of that name is one of those; false where there is none.
bool stands_fast(const model::WorldModel& world, const std::string& name);
Outcome set_twist(const set_twist_request_t& request, Simulation& simulation);
// Everything that is there back to where it started or was spawned, at rest.
void reset_poses(Simulation& simulation);

}  // namespace ruedo::engine
