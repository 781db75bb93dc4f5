// Runs a world on threads, for one epoch of a run.
//
// The simulation thread (the module "kinematics") takes commands, drives the robots and steps
// Bullet; batches of snapshots go to the modules with something due; the publisher takes finished
// batches, in order. At most kBatches batches are in flight: a slow module makes the others wait,
// and nothing is dropped.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "engine/batch.h"
#include "engine/module_thread.h"
#include "engine/pace.h"
#include "engine/world.h"

namespace ruedo::engine {

// After a change of the world, or the attempt, a module has no scene or renderer any more: the
// simulation cannot continue.
struct SceneLost : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct SimulationOptions {
  FleetOptions fleet;
  int batch_steps = 0;  // at most so many, up to kMaxBatchSteps; 0: by the size of the world
  // For tests: called in a module's thread ("kinematics" too) before each batch.
  std::function<void(const std::string& module)> before_batch;
};

class Simulation {
 public:
  static constexpr int kBatches = 4;

  // Creates everything but threads, and announces channels. finished: set whenever next_batch() may
  // have something. Throws InputError.
  Simulation(std::shared_ptr<const world::WorldModel> world, const SimulationOptions& options,
             Channels& channels, Findings& findings, Wakeup& finished);
  ~Simulation();  // stops, and waits for all threads

  // Starts the threads. Throws EnvironmentError if a module cannot run here. The pace must outlive
  // it.
  void start(Pace& pace);

  // From the next batch on, only these channels are read (Batch::read). Any thread.
  void set_read_channels(ReadChannels read);

  // Computes the next steps in the caller's thread, the publisher's, if they are at most `most`,
  // may be computed now, and the simulation thread is waiting for them: waking it and waiting for
  // it takes longer than a step of a small world. Otherwise wakes it, and returns false.
  bool go(int most);

  // For the publisher: the next finished batch in order, or null if there is none yet. The batch
  // stays valid until the next call that returns one. Throws std::runtime_error if a module failed.
  const Batch* next_batch();
  // Whether the last batch was taken, and why the run ended early; "": it did not.
  bool over() const { return last_taken_; }
  const std::string& end() const { return end_; }

  // The computation in progress if next_batch() has nothing: a sensor, or a step; "": none.
  // For the publisher.
  std::string at_work() const;

  // Ends the run here: what has not been taken yet is not finished, so that the last batch comes
  // soon, without steps.
  void leave_off();

  // Calls handler(step, channel index, bytes, size) for each message of a step of a batch, in
  // schedule order. The steps of a batch must be requested in order, from the first.
  template <class Handler>
  void messages(const Batch& batch, int64_t step, Handler&& handler);

  const world::WorldModel& world() const { return world_.model(); }
  const world::BodyLayout& layout() const { return world_.layout(); }
  const std::vector<device_info_t>& devices() const { return world_.devices(); }
  CommandInbox& inbox() { return world_.inbox(); }
  const physics::PhysicsWorld& physics() const { return world_.physics(); }
  robot::Robots& robots() { return world_.robots(); }

  // ---- Changes of the world while it stands still: its pace holds, all batches are read, every
  // thread waits. Writes then become visible to the threads through the locks of the pace
  // and the modules' queues.

  // As in World. They also throw EnvironmentError if a module cannot run here; the world is then
  // unchanged. Both throw SceneLost.
  InstanceIndex add_model(const std::string& name, const Pose& X_WM,
                          std::shared_ptr<const world::Model> model, int64_t step,
                          Channels& channels, Findings& findings);
  void remove_model(InstanceIndex instance, Channels& channels);
  SimTime reset_time(int epoch) { return world_.reset_time(epoch); }

  // Copies this state to another copy of the world, without commands that are not applied yet.
  // Throws as World::take.
  void save(World& copy) const;
  // Writes it likewise. Throws as World::exchange.
  void write(StateArchive& archive) { world_.exchange(archive); }
  // Becomes what save() made, in a new epoch.
  void restore(const World& copy, int epoch);

 private:
  const Batch* advance();
  void simulate();
  void compute(Batch& batch, int64_t first_step, int count);
  void dispatch(Batch& batch, bool here);
  void fit_threads();  // adapts them to the world's modules, and the batches to them

  World world_;
  bool started_ = false;
  std::function<void(const std::string&)> before_batch_;
  Wakeup& finished_;
  std::mutex read_mutex_;
  std::shared_ptr<const ReadChannels> read_;  // null: everything
  std::atomic<bool> left_off_{false};
  std::atomic<int64_t> computing_{-1};                  // the first step being computed; -1: none
  std::vector<std::unique_ptr<ModuleThread>> threads_;  // of the world's modules, in order
  std::vector<Batch> batches_;
  Wakeup batch_freed_;
  std::atomic<int64_t> step_ns_{INT64_MAX};  // wall time of the last step
  size_t round_ = 0;  // number of the batch round, counted by the simulation thread
  Pace* pace_ = nullptr;
  std::thread thread_;

  // The publisher's.
  size_t next_batch_ = 0;
  Batch* taken_ = nullptr;
  bool last_taken_ = false;
  std::string end_;
  std::vector<std::vector<size_t>> cursors_;  // for each module, into its pieces in taken_
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
