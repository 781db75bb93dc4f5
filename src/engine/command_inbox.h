// Where commands wait for the next step: received by the bus's thread, checked, and taken by the
// simulation thread at a step boundary.
//
// Bounded: of each robot the newest few are kept, so that a flood costs nothing but the flooder's
// own commands. Commands for steps to come wait apart from those, and are refused when there is no
// room.
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <string>
#include <unordered_map>
#include <vector>

#include "engine/batch.h"
#include "robot/robots.h"
#include "ruedo/decode.h"

namespace ruedo::engine {

class Faults;

// A channel on which a robot takes commands, or the world what clients draw.
struct Input {
  enum class Kind { velocity, wheels, move, joints, fault, reset_odometry, markers };
  std::string channel;  // on the bus
  RobotIndex robot;     // invalid: the world
  Kind kind = Kind::velocity;
};

class CommandInbox {
 public:
  static constexpr size_t kKeptPerRobot = 4;
  static constexpr size_t kKeptOfWorld = 64;        // messages of markers
  static constexpr size_t kMaxMessageSize = 65536;  // bytes
  static constexpr size_t kMostScheduled = 65536;   // commands
  static constexpr size_t kMostScheduledBytes = 32u << 20;

  enum class Scheduled { kept, faulty, late, full };

  // inputs: at most one of each channel but for reset_odometry, which has none of its own.
  CommandInbox(std::vector<Input> inputs, int robots);

  // Checks a message and keeps it; a faulty one is counted, and logged once a second at most. Any
  // thread.
  void receive(const std::string& channel, const uint8_t* data, size_t size);

  // Asks for a reset of a robot's odometry, with the request's body for the log. Any thread.
  void reset_odometry(RobotIndex robot, const std::vector<uint8_t>& body);

  // Keeps a command, as it would come over the bus, that acts on the state of exactly that step:
  // before the live ones of that step, in the order of scheduling. input: index into inputs().
  // late: the state was left already; full: no room before others were applied. A command that is
  // refused changes nothing. Any thread.
  Scheduled schedule(int64_t step, int input, const uint8_t* data, size_t size);

  // Applies what acts on the state `step` and notes it in the batch: what was scheduled for it,
  // then what waits, in the order of arrival. The simulation thread's, for one step after the
  // other.
  void apply(robot::Robots& robots, Faults& faults, int64_t step, Batch& batch);

  const std::vector<Input>& inputs() const { return inputs_; }
  // The first state that commands may still act on. Any thread.
  int64_t next_step() const {
    const std::lock_guard lock(mutex_);
    return waits_.next_step;
  }
  void clear();

  // Robots that come and go; while nothing is received or applied. `inputs` are all of one robot.
  void add(const std::vector<Input>& inputs, int robots);
  void remove(RobotIndex robot);
  void reset_time();  // steps count from 0: what was scheduled is dropped
  // What waits becomes what waits in another copy of the world; while nothing is received or
  // applied.
  void take(const CommandInbox& other) { waits_ = other.waits_; }

  uint64_t refused() const { return refused_; }      // faulty messages
  uint64_t displaced() const { return displaced_; }  // commands that newer ones pushed out

 private:
  struct Entry {
    int64_t step = -1;  // of a scheduled command
    uint64_t arrival = 0;
    int input = -1;
    robot::Command command;
    std::vector<uint8_t> bytes;
  };
  struct Slots {  // a ring of the newest
    explicit Slots(size_t most = kKeptPerRobot) : most(most) {}
    size_t most;
    std::vector<Entry> entries;  // none before the first that is kept
    size_t first = 0, size = 0;
  };

  void listen(int input);
  Slots& slots_of(RobotIndex robot) {
    return robot.valid() ? waits_.slots[robot] : waits_.world_slots;
  }
  Entry& next_entry(RobotIndex robot);  // with the mutex held
  void keep(int input, robot::Command& command, const uint8_t* data, size_t size);
  void refuse(const std::string& channel, const char* why);
  Entry& next_taken(size_t& count);
  static bool later(const Entry& a, const Entry& b);  // order of the heap

  std::vector<Input> inputs_;
  std::unordered_map<std::string, int> by_channel_;  // looked up only, never walked
  std::vector<int> reset_input_;                     // of each robot
  mutable std::mutex mutex_;
  struct Waits {
    std::vector<Slots> slots;  // of each robot
    Slots world_slots{kKeptOfWorld};
    std::vector<RobotIndex> robots;  // with entries
    uint64_t arrivals = 0;
    std::vector<Entry> scheduled;  // the first scheduled_count are a heap, the next step on top
    size_t scheduled_count = 0, scheduled_bytes = 0;
    int64_t next_step = 0;  // what was applied is all before it
  } waits_;
  std::vector<Entry> taken_;  // the simulation thread's
  std::atomic<uint64_t> refused_{0}, displaced_{0};
  int64_t last_warning_ns_ = 0;  // the bus thread's
};

// Whether all of its values are numbers.
bool is_finite(const robot::Command& command);

// Decodes a command of that kind, or says why not.
DecodeFault decode_command(Input::Kind kind, const uint8_t* data, size_t size,
                           robot::Command& command);

}  // namespace ruedo::engine
