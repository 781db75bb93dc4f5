// A module: the devices of one kind on all robots of a world, with their sample times.
//
// Its bytes do not depend on threads: devices are divided into pieces of a fixed size, each with
// its own outbox, which are read in order. The world's host gives a module a thread (ModuleThread),
// or runs it in its own.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/batch.h"
#include "engine/faults/sensor_faults.h"
#include "ruedo/sensor.h"
#include "scene/pictures/render_scene.h"
#include "scene/rays/ray_scene.h"

namespace ruedo::engine {

// Owns an optional object, and copies it with its owner.
template <class T>
class Owned : public std::unique_ptr<T> {
 public:
  using std::unique_ptr<T>::operator=;
  Owned() = default;
  Owned(Owned&&) noexcept = default;
  Owned& operator=(Owned&&) noexcept = default;
  Owned(const Owned& other) : Owned() { *this = other; }
  Owned& operator=(const Owned& other) {
    if (*this && other) {
      **this = *other;
    } else {
      *this = other ? std::make_unique<T>(*other) : nullptr;
    }
    return *this;
  }
  ~Owned() = default;
};

// The steps at which any of some devices takes a sample.
class DueSteps {
 public:
  // first: the step from which the clock counts; sample: the next one.
  void add(const SampleClock& clock, int64_t first = 0, int64_t sample = 0);
  void clear() { entries_.clear(), update(); }
  int64_t next() const { return next_; }  // INT64_MAX: never
  void pass(int64_t step);                // everything up to and including `step` is done

 private:
  struct Entry {
    SampleClock clock;
    int64_t first, sample, step;
  };
  void update();
  std::vector<Entry> entries_;
  int64_t next_ = INT64_MAX;
};

// A device as its module sees it.
struct Device {
  std::unique_ptr<Sensor> sensor;
  Rate rate;
  int64_t phase_us = 0;
  bool visual_rays = false;  // its rays hit visuals, not collisions
  RobotIndex robot = {};     // none: the simulation's
  int64_t first_step = 0;    // its samples count from the time of this step
  std::string name = {};     // the name used in faults
  std::vector<int> channels = {};
  std::optional<RandomSource> random = {};  // the sensor's random source, to be reseeded
};

struct ModuleSetup {
  std::string name;
  std::vector<Device> devices;  // in world order: robot, then device
  int piece_size = 16;          // devices processed one after the other
  int64_t step_us = 5000;
  int rank = 0;  // in the schedule; modules of one kind share it
  bool wants_rays = false, wants_visual_rays = false, wants_renderer = false;

  ModuleSetup without_devices() const {
    return {name, {}, piece_size, step_us, rank, wants_rays, wants_visual_rays, wants_renderer};
  }
};

// The parts of the world from which a module creates its scenes, in its own thread. Entries that
// no module needs may be empty.
struct SceneMakers {
  std::function<std::unique_ptr<scene::RayScene>()> rays, visual_rays;
  std::function<std::unique_ptr<scene::Renderer>()> renderer;
};

class Module {
 public:
  explicit Module(ModuleSetup setup);

  // Creates its scenes, in the thread that will process batches: a renderer's context belongs to
  // it. Throws what creating them threw.
  void make_scenes(const SceneMakers& makers);
  // Whether it needs them for a batch: a module that draws pictures does if any is read, or may be
  // faulty.
  bool needs_scenes(const ReadChannels* read, const std::vector<SensorFault>* faults) const;
  bool has_scenes() const {
    return setup_.wants_rays || setup_.wants_visual_rays || setup_.wants_renderer;
  }
  void drop_renderer() { renderer_.reset(); }
  bool has_renderer() const { return renderer_ != nullptr; }

  // For the thread that makes batches: whether a batch has work for it; and that it gets the one up
  // to `last_step`.
  bool wants(const Batch& batch) const {
    return looks_at_each_step(batch) || to_hand_over_.next() < batch.first_step + batch.count;
  }
  void pass(int64_t last_step) { to_hand_over_.pass(last_step); }

  // Lets its devices observe and sample the states of a batch, and writes their messages into
  // `output`. Batches come in order; left_off: once true, samples are no longer wanted.
  void process(const Batch& batch, Batch::Output& output, const std::atomic<bool>& left_off);
  // Lets the device of a channel take the last sample that it skipped for lack of a reader, if no
  // later one was due; does nothing otherwise.
  void catch_up(int channel, Outbox& out);
  // Whether a sample is due before that step.
  bool is_due(int64_t before_step) const { return to_sample_.next() < before_step; }

  // Changes between two batches, while it has none.
  void add(ModuleSetup more);  // `more` has its devices in the order of robots
  void remove(RobotIndex robot);
  // of the only device, whose samples continue
  void replace_sensor(std::unique_ptr<Sensor> sensor);
  void reset_time(SimTime us);  // sim time was set back, and steps count from 0

  // Between two batches: takes the devices, clocks and faults of another copy of the world. Returns
  // a device whose sensor does not support it, or null.
  const Device* copy_from(const Module& other);
  // The same, in bytes, where no device was ever faulty. Returns likewise.
  const Device* exchange(StateArchive& archive);

  // Index of the device that started to work last; -1: none. Any thread.
  int at_work() const { return at_work_.load(std::memory_order_relaxed); }
  const Device& device(int place) const { return setup_.devices[place]; }
  int devices() const { return static_cast<int>(setup_.devices.size()); }

  int rank() const { return setup_.rank; }
  bool wants_visual_rays() const { return setup_.wants_visual_rays; }
  // Whether it serves a robot after that one.
  bool robots_after(RobotIndex robot) const {
    return !setup_.devices.empty() && setup_.devices.back().robot > robot;
  }
  const std::string& name() const { return setup_.name; }
  int pieces() const {
    return static_cast<int>((setup_.devices.size() + setup_.piece_size - 1) / setup_.piece_size);
  }

 private:
  struct Slot {
    SampleClock clock;
    int64_t sample, step;
    bool observes, visual_rays;
    Owned<FaultFilter> faults = {};    // while the device is faulty
    Owned<Snapshot> passed_over = {};  // what the skipped sample would have shown
    int64_t passed_sample = -1;        // its number; -1: none was skipped
    uint64_t passed_seed = 0;          // the seed that it would have used
  };

  Slot slot_of(const Device& device) const;
  bool looks_at_each_step(const Batch& batch) const;
  bool is_read(size_t k, const ReadChannels* read, const std::vector<SensorFault>* faults) const;
  void reseed(size_t k, const std::vector<Reseeding>& reseedings, int64_t step);
  void pass_over(size_t k, const Snapshot& snapshot);
  void count_due();
  void process_pieces(const Batch& batch, Batch::Output& output, int begin, int end,
                      const std::atomic<bool>& left_off);
  void note_cost(std::chrono::nanoseconds of_piece);
  void sample_with_faults(const Batch& batch, const Snapshot& snapshot, size_t k, Outbox& outbox);
  SampleInput input_of(const Slot& slot, const Snapshot& snapshot) const;
  void take_sample(const Batch& batch, const Snapshot& snapshot, size_t k, Outbox& out);
  void process_piece(const Batch& batch, Outbox& outbox, int piece, int begin, int end,
                     const std::atomic<bool>& left_off);

  ModuleSetup setup_;
  bool observes_ = false;
  std::vector<Slot> slots_;  // one per device
  std::atomic<int> at_work_{-1};
  int64_t piece_ns_ = 0;  // wall time of the first piece
  // for the thread that makes batches, and for the one that processes them
  DueSteps to_hand_over_, to_sample_;
  std::unique_ptr<scene::RayScene> rays_, visual_rays_;
  std::unique_ptr<scene::Renderer> renderer_;
};

}  // namespace ruedo::engine
