// A module: the thread that serves the devices of one kind on all robots.
//
// Its bytes do not depend on threads: devices are cut into pieces of a fixed size, each piece has an outbox of
// its own, and the publisher reads them in order, whichever was finished first.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "ruedo/sensor.h"
#include "scene/ray_scene.h"
#include "scene/render_scene.h"
#include "server/batch.h"

namespace ruedo::server {

// The steps at which any of some devices takes a sample.
class DueSteps {
 public:
  void add(const SampleClock& clock);
  int64_t next() const { return next_; }    // INT64_MAX: never
  void pass(int64_t step);                  // everything up to and with `step` is done

 private:
  struct Entry { SampleClock clock; int64_t sample, step; };
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
};

struct ModuleSetup {
  std::string name;
  std::vector<Device> devices;             // in world order: robot, then device
  int piece_size = 16;                     // devices that are worked through one after the other
  int64_t step_us = 5000;
  bool wants_rays = false, wants_visual_rays = false, wants_renderer = false;
  // For tests: called in the module's thread before each batch.
  std::function<void(const std::string& module)> before_batch;

  ModuleSetup without_devices() const {
    return {name, {}, piece_size, step_us, wants_rays, wants_visual_rays, wants_renderer, before_batch};
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

  const std::string& name() const { return setup_.name; }
  int pieces() const { return static_cast<int>((setup_.devices.size() + setup_.piece_size - 1) / setup_.piece_size); }
  bool observes() const { return observes_; }

  // For the simulation thread: whether a batch up to `last_step` has work for it, and handing that batch over.
  bool wants(int64_t last_step) const { return observes_ || to_hand_over_.next() <= last_step; }
  void hand_over(Batch& batch, int64_t last_step);

 private:
  struct Slot { SampleClock clock; int64_t sample, step; bool observes, visual_rays; };

  void work();
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
  std::thread thread_;
};

}  // namespace ruedo::server
