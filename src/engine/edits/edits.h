// Changes to the world by requests: models are spawned, removed, moved and pushed.
//
// Each function checks a request's body and executes it while the simulation stands still; it acts
// on the state computed last. The same body has the same effect on the same state, so a log only
// needs the bodies: a generated name and the height of the ground follow from the state.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "engine/outcome.h"
#include "engine/simulation.h"
#include "ruedo/set_pose_request_t.hpp"
#include "ruedo/set_twist_request_t.hpp"
#include "ruedo/spawn_request_t.hpp"
#include "world/load_model.h"

namespace ruedo::engine {

inline constexpr double kFarthest_m = 1e6, kFastest_m_s = 1e3,
                        kFastest_rad_s = 1e4;  // maximum in requests
// models in a world, including the places of removed ones
inline constexpr size_t kMostModels = 10'000;

// Models from requests. As long as any model of a world comes from it, an unchanged file, or the
// same text, is not read again. Thread-safe.
class ModelStore {
 public:
  explicit ModelStore(std::string world_file) : world_file_(std::move(world_file)) {}
  // Throws InputError. budget: may be null.
  world::LoadedModel load(const spawn_request_t& request, world::LoadBudget* budget = nullptr);

 private:
  struct Known {
    std::weak_ptr<const world::Model> model;
    world::LoadedModel rest;  // everything but the model
  };
  std::string world_file_;
  std::mutex mutex_;
  std::map<std::string, Known> known_;
};

// The name, with _2, _3, ... appended if it exists: for a spawned model without a requested
// name.
std::string unused_name(const world::WorldModel& world, const std::string& name);

// "": it is allowed.
std::string fault_of_pose(const double (&position)[3], const double (&orientation)[4]);
// "": valid for a model, as in a world file; a robot's name must also be usable in channel names.
std::string fault_of_name(const std::string& name);
// The checks that need no model; OK: no error.
Outcome check_spawn(const spawn_request_t& request);
// step: the first state that shows it. name: is set to the model's name. findings: of its devices.
Outcome spawn(const spawn_request_t& request, const world::LoadedModel& loaded, int64_t step,
              Simulation& simulation, Channels& channels, std::string& name, Findings& findings);
Outcome remove(const std::string& name, Simulation& simulation, Channels& channels);
// A fixed model, static or with a joint to the world, is removed and inserted again. step: the
// first state that shows it.
Outcome set_pose(const set_pose_request_t& request, int64_t step, Simulation& simulation,
                 Channels& channels);
Pose pose_of(const set_pose_request_t& request);
// Whether the model of that name is fixed; false for an unknown name.
bool is_fixed(const world::WorldModel& world, const std::string& name);
Outcome set_twist(const set_twist_request_t& request, Simulation& simulation);
// Returns all models to where they started or were spawned, at rest.
void reset_poses(Simulation& simulation);

}  // namespace ruedo::engine
