// Many copies of one world in the caller's process, stepped together on all cores.
//
// The same code as in a server's run, and the same bytes: copy i with the seed s + i, given the
// same commands at the same steps, produces the messages of `ruedo run --lockstep --seed s+i`.
// Copies share static models. Pictures without a reader, by observe() or on_message(), are not
// drawn. Not thread-safe: one thread at a time.
#pragma once

#include <atomic>
#include <cstdint>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "engine/field_reader.h"
#include "engine/world.h"
#include "world/randomization.h"

namespace ruedo::engine {

struct EngineOptions {
  int worlds = 1;
  FleetOptions fleet;              // its seed is for copy 0
  int threads = 0;                 // 0: one per core
  std::vector<world::Draw> draws;  // for each copy and reset, from the seed
};

// A field of one device on all robots that have it, in all copies. It is kept up to date: after
// each step it holds the values of the newest message of each device.
struct FieldArray {
  Primitive type = Primitive::none;
  std::vector<int64_t> shape;     // copies, robots, then the field's own dimensions
  std::vector<std::byte> values;  // row-major, in the host's byte order
};

// A copy at some step, with everything that determines how it continues. Immutable, and may outlive
// its engine.
class SavedWorld;

class Engine {
 public:
  // Called with a copy's message: step, channel, bytes.
  using MessageHandler = std::function<void(int world, int64_t step, const Channel& channel,
                                            std::span<const uint8_t> bytes)>;
  // Called with a copy's state: its snapshot, and the batch with what acted on the state before it.
  using StateHandler = std::function<void(int world, const Snapshot& snapshot, const Batch& batch)>;

  // Computes state 0 of each copy. Throws InputError and EnvironmentError.
  Engine(std::shared_ptr<const world::WorldModel> world, EngineOptions options);
  ~Engine();

  int worlds() const { return static_cast<int>(copies_.size()); }
  int64_t step_us() const { return world_->step_us; }
  int64_t current_step(int world) const;
  const world::WorldModel& model() const { return *world_; }
  const std::vector<device_info_t>& devices() const;
  const std::vector<Channel>& channels() const;
  // Robots with a drive, in world-file order: the second axis of drive().
  const std::vector<std::string>& driven() const { return driven_; }
  const Findings& findings() const { return findings_; }

  // Computes that many states, at least 1: of every copy, or of those with a 1 in `which`. Between
  // some of them, in which all copies have computed as many, `go_on` may say that it is enough.
  // Throws what the first copy threw that failed: that one has to be reset or restored; the others
  // have gone on. Or what the handler of its messages threw: all have gone on then.
  void step(int64_t steps, std::span<const uint8_t> which = {},
            const std::function<bool()>& go_on = {});

  // A velocity for every driven robot of every copy, acting on the current states: copies x driven
  // robots x (m/s forward, m/s left, rad/s), row-major. A row with a NaN gives no command: the
  // previous command stays in force; and so do those of copies that `which` leaves out.
  void drive(std::span<const double> velocities, std::span<const uint8_t> which = {});

  // A message as on the bus, acting on the current state. Throws InputError for a channel that
  // takes no commands, or invalid bytes.
  void command(int world, const std::string& channel, std::span<const uint8_t> message);

  // A reset of a copy.
  struct Reset {
    int world = 0;
    uint64_t seed = 1;
    // Another world for that copy from now on; null: the current one. It must have the channels of
    // the first world: the same robots with the same devices, in the same order.
    std::shared_ptr<const world::WorldModel> model = nullptr;
  };
  // Restarts copies, each with its seed: what follows equals a fresh run. Throws InputError; then
  // nothing has changed.
  void reset(std::span<const Reset> resets);
  void reset(int world, uint64_t seed, std::shared_ptr<const world::WorldModel> model = nullptr) {
    const Reset one{world, seed, std::move(model)};
    reset(std::span(&one, 1));
  }

  // A copy in its current state, in time and memory that do not depend on the length of its run:
  // about those of a reset. Includes commands given already. Throws InputError for a plugin's
  // device or drive that cannot be copied.
  std::shared_ptr<const SavedWorld> save(int world);
  // Gives copies the saved state: given the same commands, what follows equals what followed there,
  // byte for byte. Arrays show what they showed then. Throws InputError for a world saved by
  // another engine.
  void restore(const SavedWorld& saved, std::span<const int> worlds);

  // The values drawn for a copy.
  const world::Drawn& drawn(int world) const;

  // The array of a field, kept up to date for the engine's lifetime. device: a name ("LRF"), or a
  // kind ("lrf") if each robot has at most one of it; with a channel below it, "camera/depth".
  // Throws InputError, and EnvironmentError if pictures cannot be drawn here.
  std::shared_ptr<const FieldArray> observe(const std::string& device, const std::string& field);

  // For each copy and driven robot (int32): during how many of the states of the last step() it ran
  // into something (Snapshot::collisions).
  std::shared_ptr<const FieldArray> touching() const { return touching_; }
  // For each driven robot of a copy: the bodies that it ran into in these states, sorted.
  std::vector<std::vector<std::string>> collisions(int world) const;

  uint64_t state_hash(int world) const;

  // Called in step() and reset() with each message, in the order of copies and messages (of a long
  // step(), for each of its pieces); nothing is computed in parallel then. wants: the channels that
  // it reads; if empty, all.
  void on_message(MessageHandler handler, std::function<bool(const Channel&)> wants = {});
  // The same for each state, before its messages.
  void on_state(StateHandler handler) { state_handler_ = std::move(handler); }

  const std::vector<Input>& inputs(int world) const;

 private:
  friend class SavedWorld;
  struct Copy;
  struct Observer;
  class Borrowed;

  std::unique_ptr<Copy> make_copy(std::shared_ptr<const world::WorldModel> model, uint64_t seed,
                                  World* ended = nullptr);
  std::unique_ptr<Copy> make_another(const Copy& copy) const;
  void restore_one(const SavedWorld& saved, size_t world);
  std::unique_ptr<Copy> make_other(const Reset& reset);
  void reset_one(const Reset& reset, std::unique_ptr<Copy> made);
  std::shared_ptr<Plan> plan_of(const std::shared_ptr<const world::WorldModel>& model);
  void count_touching(Copy& copy, const Batch& batch, int32_t* counts) const;
  void choose_read();
  void take_velocities(size_t world);
  void compute(size_t world, int64_t steps);
  std::exception_ptr compute(size_t world, Copy& copy, int64_t steps);
  Copy& sound_copy(size_t world) const;
  void forget_touching(size_t world);
  void tell(size_t world, const Batch& batch);
  void update(Observer& observer, size_t world);
  void read(const std::vector<int>& channels);
  void catch_up(Copy& copy, int channel);
  void for_each(size_t count, const std::function<void(size_t)>& body);
  std::vector<int> channels_of(const std::string& device) const;

  std::shared_ptr<const world::WorldModel> world_;
  EngineOptions options_;
  std::shared_ptr<const char> identity_ = std::make_shared<char>();  // identifies its saved worlds
  // For worlds that several copies use: kept while one of them does.
  struct Shared {
    std::weak_ptr<const world::WorldModel> model;
    std::weak_ptr<Plan> plan;
  };
  std::mutex shared_mutex_;
  std::map<const world::WorldModel*, Shared> shared_;  // only looked up, never iterated
  Findings findings_;
  std::vector<std::unique_ptr<Copy>> copies_;
  bool first_made_ = false;  // the first copy reports what is wrong with the world
  std::vector<std::string> driven_;
  std::vector<InputIndex> velocity_inputs_;  // for the driven robots
  std::vector<RobotIndex> driven_robots_;
  std::vector<double> velocities_;  // from the last drive(): see Copy::driven
  std::shared_ptr<FieldArray> touching_ = std::make_shared<FieldArray>();
  std::vector<std::unique_ptr<Observer>> observers_;
  std::shared_ptr<const ReadChannels> read_;         // set by observers; the same for each copy
  std::shared_ptr<const ReadChannels> read_by_any_;  // also by the handler; null: all are
  MessageHandler handler_;
  std::function<bool(const Channel&)> handler_wants_;
  StateHandler state_handler_;
  struct Arena;
  std::unique_ptr<Arena> arena_;
};

}  // namespace ruedo::engine
