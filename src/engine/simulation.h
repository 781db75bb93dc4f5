// One epoch of a run: the world, its robots, its modules and their threads.
//
// The simulation thread (the module "kinematics") takes commands, drives the robots and steps Bullet; batches of
// snapshots go to the modules that have something due; the publisher takes finished batches, in order. At most
// kBatches batches are on their way: whoever is slow makes the others wait, and nothing is dropped.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "model/body_layout.h"
#include "physics/physics_world.h"
#include "robot/robots.h"
#include "scene/ray_scene.h"
#include "engine/batch.h"
#include "engine/channels.h"
#include "engine/command_inbox.h"
#include "engine/fleet.h"
#include "engine/module.h"
#include "engine/pace.h"

namespace ruedo::engine {

struct SimulationOptions {
  FleetOptions fleet;
  int batch_steps = 0;    // most steps in a batch; 0: by the size of the world
  // For tests: called in a module's thread ("kinematics" too) before each batch.
  std::function<void(const std::string& module)> before_batch;
};

class Simulation {
 public:
  static constexpr int kBatches = 4;

  // Makes everything but threads; channels are announced. finished: set whenever take() may have something.
  // Throws InputError.
  Simulation(std::shared_ptr<const model::WorldModel> world, const SimulationOptions& options, Channels& channels,
             Findings& findings, Wakeup& finished);
  ~Simulation();    // leaves off, then waits for all threads

  // Starts the threads. Throws EnvironmentError when a module cannot be served here. The pace must outlive it.
  void start(Pace& pace);

  // Computes the next steps in the caller's thread, the publisher's, where they are few, may be computed now, and the
  // simulation thread waits for them: waking it, and waiting for it, takes longer than a small world's step. Else wakes it,
  // and returns false.
  bool go();

  // The publisher's: the next finished batch in order, or null when there is none yet. The batch stays valid until
  // the next call that returns one. Throws std::runtime_error when a module failed.
  const Batch* take();

  // Ends the run here: what was not taken yet is left unfinished, so that the last batch comes soon, and no steps with it.
  void leave_off();

  // Calls handler(step, channel index, bytes, size) for each message of one step of a batch, in the schedule's order.
  // Steps of a batch must be asked for in order, from its first.
  template <class Handler>
  void messages(const Batch& batch, int64_t step, Handler&& handler);

  const model::WorldModel& world() const { return world_; }
  const model::BodyLayout& layout() const { return layout_; }
  const std::vector<device_info_t>& devices() const { return devices_; }
  CommandInbox& inbox() { return inbox_; }
  const physics::PhysicsWorld& physics() const { return *physics_; }

  // ---- Changes of the world, while it stands still: its pace holds, all batches are taken, every thread waits. In
  // simulation_edits.cpp.

  // Puts a model in, which is seen from the next state on; `step` is that state's number. Returns its index in
  // world().models. Throws InputError and EnvironmentError; the world is then as it was.
  int add_model(const std::string& name, const Pose& X_WM, std::shared_ptr<const model::Model> model, int64_t step,
                Channels& channels, Findings& findings);
  // Takes one out. Its numbers stay free until the same model comes again.
  void remove_model(int instance, Channels& channels);
  // The state that there is becomes state 0. Returns what the time was.
  SimTime begin_time_anew(int epoch);
  robot::Robots& robots() { return *robots_; }

 private:
  const Batch* advance();
  void simulate();
  void compute(Batch& batch, int64_t first_step, int count);
  void step(Batch& batch, int64_t step);
  void dispatch(Batch& batch, bool here);
  SceneMakers scene_makers();

  int place(const std::string& name, const Pose& X_WM, std::shared_ptr<const model::Model> model);
  void show_beginning(Fleet& fleet, int64_t step) const;
  void join(Fleet fleet);
  void join(ModuleSetup setup);
  void fit_batches();
  void renew_scenes();
  void renew_world_state();

  model::WorldModel world_;
  model::BodyLayout layout_;
  FleetOptions fleet_options_;
  bool started_ = false;
  std::function<void(const std::string&)> before_batch_;
  Wakeup& finished_;
  Fleet fleet_;                                  // its modules move into modules_
  std::vector<device_info_t> devices_;
  CommandInbox inbox_;
  std::unique_ptr<physics::PhysicsWorld> physics_;
  std::unique_ptr<robot::Robots> robots_;
  int world_channel_ = -1;                       // of ruedo/world
  std::vector<std::unique_ptr<Module>> modules_;    // in the order of the schedule
  std::vector<Batch> batches_;
  Wakeup batch_freed_;
  std::atomic<int64_t> step_ns_{INT64_MAX};      // what the last step took of real time
  size_t round_ = 0;                             // of the batches; whoever computes one counts it
  Pace* pace_ = nullptr;
  std::atomic<bool> left_off_{false};
  std::thread thread_;

  // The publisher's.
  size_t next_batch_ = 0;
  Batch* taken_ = nullptr;
  bool last_taken_ = false;
  std::vector<std::vector<size_t>> cursors_;     // of each module's pieces in taken_
};

template <class Handler>
void Simulation::messages(const Batch& batch, int64_t step, Handler&& handler) {
  for (size_t m = 0; m < batch.outputs.size(); ++m) {
    if (!batch.outputs[m].woken) continue;
    for (size_t p = 0; p < batch.outputs[m].pieces.size(); ++p) {
      const Outbox& outbox = batch.outputs[m].pieces[p];
      size_t& cursor = cursors_[m][p];
      for (; cursor < outbox.entries().size() && outbox.entries()[cursor].step == step; ++cursor) {
        const Outbox::Entry& entry = outbox.entries()[cursor];
        handler(step, entry.channel, outbox.data(entry), entry.size);
      }
    }
  }
}

}  // namespace ruedo::engine
