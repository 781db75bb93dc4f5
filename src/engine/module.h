// A module: the thread that serves the devices of one kind on all robots.
//
// Its bytes do not depend on threads: devices are cut into pieces of a fixed size, each piece has an outbox of
// its own, and the publisher reads them in order, whichever was finished first.
#pragma once

#include <atomic>
#include <functional>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "ruedo/sensor.h"
#include "scene/ray_scene.h"
#include "scene/render_scene.h"
#include "engine/batch.h"

namespace ruedo::engine {

// The steps at which any of some devices takes a sample.
class DueSteps {
 public:
  // first: the step that the clock counts from; sample: the next one.
  void add(const SampleClock& clock, int64_t first = 0, int64_t sample = 0);
  void clear() { entries_.clear(), update(); }
  int64_t next() const { return next_; }    // INT64_MAX: never
  void pass(int64_t step);                  // everything up to and with `step` is done

 private:
  struct Entry { SampleClock clock; int64_t first, sample, step; };
  void update();
  std::vector<Entry> entries_;
  int64_t next_ = INT64_MAX;
};

// One device as its module sees it.
struct Device {
  std::unique_ptr<Sensor> sensor;
  Rate rate;
  int64_t phase_us = 0;
  bool visual_rays = false;                // its rays hit visuals, not collisions
  int robot = -1;                          // index into BodyLayout::robots; -1: the simulation's
  int64_t first_step = 0;                  // its samples count from the time of this one
};

struct ModuleSetup {
  std::string name;
  std::vector<Device> devices;             // in world order: robot, then device
  int piece_size = 16;                     // devices that are worked through one after the other
  int64_t step_us = 5000;
  int rank = 0;                            // in the schedule; modules of one kind share it
  bool wants_rays = false, wants_visual_rays = false, wants_renderer = false;
  // For tests: called in the module's thread before each batch.
  std::function<void(const std::string& module)> before_batch;
  const std::atomic<bool>* left_off = nullptr;    // once it is true nobody wants samples any more

  ModuleSetup without_devices() const {
    return {name, {}, piece_size, step_us, rank, wants_rays, wants_visual_rays, wants_renderer, before_batch, left_off};
  }
};

// What a module needs of the world to make its scenes, in its own thread. An entry may be empty when no module
// wants it.
struct SceneMakers {
  std::function<std::unique_ptr<scene::RayScene>()> rays, visual_rays;
  std::function<std::unique_ptr<scene::Renderer>()> renderer;
};

class Module {
 public:
  // finished: set when the module was the last to finish a batch.
  Module(ModuleSetup setup, int index, Wakeup& finished);
  ~Module();    // ends the thread; batches that were handed over are finished first

  // Starts the thread and waits until its scenes are made. Throws what making them threw.
  void start(const SceneMakers& makers);

  // Changes between two batches, while it has none; the caller's thread and the module's take turns through its queue.
  void add(ModuleSetup more);              // its devices, in the order of robots
  void remove(int robot);
  void replace_sensor(std::unique_ptr<Sensor> sensor);    // of the only device, whose samples go on
  void renew_scenes(const SceneMakers& makers);    // waits until they are made; throws what making them threw
  void begin_time_anew(SimTime us);        // sim time was set back by so much, and steps count from 0
  void set_index(int index) { index_ = index; }

  int rank() const { return setup_.rank; }
  bool wants_visual_rays() const { return setup_.wants_visual_rays; }
  // True when it serves a robot that comes after that one.
  bool robots_after(int robot) const { return !setup_.devices.empty() && setup_.devices.back().robot > robot; }
  const std::string& name() const { return setup_.name; }
  int pieces() const { return static_cast<int>((setup_.devices.size() + setup_.piece_size - 1) / setup_.piece_size); }
  bool observes() const { return observes_; }

  // For the simulation thread: whether a batch up to `last_step` has work for it, and handing that batch over.
  bool wants(int64_t last_step) const { return observes_ || to_hand_over_.next() <= last_step; }
  void hand_over(Batch& batch, int64_t last_step);
  // For whoever dispatches a batch of a few steps: whether working through it takes less than waking the module's thread,
  // by how long the last took, and doing so in the caller's thread.
  bool is_quick() const;
  void work_here(Batch& batch, int64_t last_step);

 private:
  struct Slot { SampleClock clock; int64_t sample, step; bool observes, visual_rays; };

  Slot slot_of(const Device& device) const;
  void count_due();
  void make_scenes(const SceneMakers& makers);
  void work();
  void work_through(Batch& batch);
  void process(Batch& batch);
  void process_pieces(Batch& batch, int begin, int end);
  void process_piece(Batch& batch, int piece, int begin, int end);

  ModuleSetup setup_;
  int index_;
  Wakeup& finished_;
  bool observes_ = false;
  std::vector<Slot> slots_;                // one per device
  DueSteps to_hand_over_, to_sample_;      // of the simulation thread, of the module's
  std::unique_ptr<scene::RayScene> rays_, visual_rays_;
  std::unique_ptr<scene::Renderer> renderer_;
  Queue<Batch*> queue_;
  Batch renewal_;                          // in the queue: makers_ wait
  const SceneMakers* makers_ = nullptr;
  std::promise<void>* made_ = nullptr;
  std::atomic<int> in_hand_{0};            // batches that its thread has
  std::atomic<int64_t> cost_ns_{INT64_MAX};    // of the last batch in which something was due
  std::thread thread_;
};

}  // namespace ruedo::engine
