// Many copies of one world in the caller's process, stepped together over all cores.
//
// The same code as a server's run, and the same bytes: copy i with the seed s + i, given the same
// commands at the same steps, makes the messages of `ruedo run --lockstep --seed s+i`. What never
// moves is shared between the copies. Pictures that nobody reads, neither by observe() nor by
// on_message(), are not drawn. Not thread safe: one thread at a time.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "engine/field_reader.h"
#include "engine/world.h"
#include "model/randomization.h"

namespace ruedo::engine {

struct EngineOptions {
  int worlds = 1;
  FleetOptions fleet;              // its seed is that of copy 0
  int threads = 0;                 // 0: one a core
  std::vector<model::Draw> draws;  // of each copy and reset, from the seed
};

// A field of one device on all robots that have it, in all copies. It follows the runs: after each
// step it holds what the newest message of each said.
struct FieldArray {
  Primitive type = Primitive::none;
  std::vector<int64_t> shape;     // copies, robots, then the field's own
  std::vector<std::byte> values;  // row by row, in the host's byte order
};

// A copy as it was at some step, with all that decides what follows. It does not change, and may
// outlive its engine.
class SavedWorld;

class Engine {
 public:
  // A message of a copy: step, channel, bytes.
  using MessageHandler = std::function<void(int world, int64_t step, const Channel& channel,
                                            std::span<const uint8_t> bytes)>;
  // A state of a copy: its snapshot, and the batch that tells what acted on the state before it.
  using StateHandler = std::function<void(int world, const Snapshot& snapshot, const Batch& batch)>;

  // Computes state 0 of each copy. Throws InputError and EnvironmentError.
  Engine(std::shared_ptr<const model::WorldModel> world, EngineOptions options);
  ~Engine();

  int worlds() const { return static_cast<int>(copies_.size()); }
  int64_t step_us() const { return world_->step_us; }
  int64_t current_step(int world) const;
  const model::WorldModel& model() const { return *world_; }
  const std::vector<device_info_t>& devices() const;
  const std::vector<Channel>& channels() const;
  // Robots with a drive, in the order of the world file: the second axis of drive().
  const std::vector<std::string>& driven() const { return driven_; }
  const Findings& findings() const { return findings_; }

  // Computes that many states, 1 or more: of every copy, or of those that have a 1 in `which`.
  // Throws std::runtime_error when a module failed.
  void step(int64_t steps, std::span<const uint8_t> which = {});

  // A velocity for every driven robot of every copy, on the states that there are: copies x driven
  // robots x (m/s ahead, m/s left, rad/s), row by row. A row with a NaN gives no command: what was
  // commanded before holds.
  void drive(std::span<const double> velocities);

  // A message as it would come over the bus, on the state that there is. Throws InputError for a
  // channel that takes no commands, or bytes that are no such message.
  void command(int world, const std::string& channel, std::span<const uint8_t> message);

  // Resets a copy.
  struct Reset {
    int world = 0;
    uint64_t seed = 1;
    // Another world, which from then on is that copy's; null: the one that it has. Its channels are
    // the first one's: the same robots with the same devices, in the same order.
    std::shared_ptr<const model::WorldModel> model = nullptr;
  };
  // Makes copies as they were at the beginning, each with its seed: what follows equals a fresh
  // run. Throws InputError; then some of them may be as they were.
  void reset(std::span<const Reset> resets);
  void reset(int world, uint64_t seed, std::shared_ptr<const model::WorldModel> model = nullptr) {
    const Reset one{world, seed, std::move(model)};
    reset(std::span(&one, 1));
  }

  // A copy as it stands, in time and memory that do not depend on how long it has run: about those
  // of a reset. What was commanded already is part of it. Throws InputError for a plugin's device
  // or drive that cannot be copied.
  std::shared_ptr<const SavedWorld> save(int world);
  // Makes copies what that one was: what follows equals what followed there, byte for byte, for the
  // same commands. Arrays show what they showed then. Throws InputError for what another engine
  // saved.
  void restore(const SavedWorld& saved, std::span<const int> worlds);

  // What was drawn for a copy.
  const model::Drawn& drawn(int world) const;

  // The array of a field, kept up to date as long as the engine lives. device: the name of one
  // ("LRF"), or of its kind
  // ("lrf") where each robot has at most one of them. Throws InputError, and EnvironmentError where
  // pictures cannot be drawn here.
  std::shared_ptr<const FieldArray> observe(const std::string& device, const std::string& field);

  // Of each copy and driven robot (int32): how many of the states of the last step() it ran into
  // something in (Snapshot::collisions).
  std::shared_ptr<const FieldArray> touching() const { return touching_; }
  // Of each driven robot of a copy: the bodies that it ran into in these states, sorted.
  std::vector<std::vector<std::string>> collisions(int world) const;

  uint64_t state_hash(int world) const;

  // Called in step() and reset() with each message, copies and messages in order; nothing is
  // computed in parallel then.
  void on_message(MessageHandler handler) { handler_ = std::move(handler); }
  // The same for each state, before its messages.
  void on_state(StateHandler handler) { state_handler_ = std::move(handler); }

  const std::vector<Input>& inputs(int world) const;

 private:
  friend class SavedWorld;
  struct Copy;
  struct Observer;
  class Borrowed;

  std::unique_ptr<Copy> make_copy(std::shared_ptr<const model::WorldModel> model, uint64_t seed,
                                  World* ended = nullptr);
  std::unique_ptr<Copy> make_another(const Copy& copy) const;
  void restore_one(const SavedWorld& saved, size_t world);
  void reset_one(const Reset& reset);
  std::shared_ptr<Plan> plan_of(const std::shared_ptr<const model::WorldModel>& model);
  void count_touching(Copy& copy, const Batch& batch, int32_t* counts) const;
  void take_velocities(size_t world);
  void compute(size_t world, int64_t steps);
  void tell(size_t world, const Batch& batch);
  void update(Observer& observer, size_t world);
  void read(const std::vector<int>& channels);
  void catch_up(Copy& copy, int channel);
  void for_each(size_t count, const std::function<void(size_t)>& body);
  std::vector<int> channels_of(const std::string& device) const;

  std::shared_ptr<const model::WorldModel> world_;
  EngineOptions options_;
  std::shared_ptr<const char> identity_ = std::make_shared<char>();  // saved worlds are of it
  // Of worlds that several copies may have: while one of them has it.
  struct Shared {
    std::weak_ptr<const model::WorldModel> model;
    std::weak_ptr<Plan> plan;
  };
  std::mutex shared_mutex_;
  std::map<const model::WorldModel*, Shared> shared_;  // looked up only
  Findings findings_;
  std::vector<std::unique_ptr<Copy>> copies_;
  bool first_made_ = false;  // the first copy tells what is wrong with the world
  std::vector<std::string> driven_;
  std::vector<int> velocity_inputs_;  // of the driven robots
  std::vector<RobotIndex> driven_robots_;
  std::vector<double> velocities_;  // of the last drive(): see Copy::driven
  std::shared_ptr<FieldArray> touching_ = std::make_shared<FieldArray>();
  std::vector<std::unique_ptr<Observer>> observers_;
  std::shared_ptr<const ReadChannels> read_;  // by observers; the same of each copy
  MessageHandler handler_;
  StateHandler state_handler_;
  struct Arena;
  std::unique_ptr<Arena> arena_;
};

}  // namespace ruedo::engine
