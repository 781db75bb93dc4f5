// Holds commands until the next step: they are received and checked in the bus's thread, and taken
// by the simulation thread at a step boundary.
//
// Bounded: for each robot only the newest few are kept, so that a flood only costs its sender's own
// commands. Commands for future steps are kept separately, and refused if there is no room.
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <unordered_map>
#include <vector>

#include "engine/batch.h"
#include "robot/robots.h"
#include "ruedo/decode.h"

namespace ruedo::engine {

class Faults;

// A channel for commands to a robot, or for what clients draw in the world.
struct Input {
  enum class Kind { velocity, wheels, move, joints, fault, reset_odometry, markers };
  std::string channel;  // on the bus
  RobotIndex robot;     // invalid: the world
  Kind kind = Kind::velocity;
};

class CommandInbox {
 public:
  static constexpr size_t kKeptPerRobot = 4;
  static constexpr size_t kKnownPrimitives = 32;    // of each robot
  static constexpr size_t kKeptOfWorld = 64;        // marker messages
  static constexpr size_t kMaxMessageSize = 65536;  // bytes
  static constexpr size_t kMostScheduled = 65536;   // commands
  static constexpr size_t kMostScheduledBytes = 32u << 20;

  enum class Scheduled { kept, faulty, late, full };

  // inputs: at most one for each channel, except that reset_odometry has no channel.
  CommandInbox(std::vector<Input> inputs, int robots);

  // Checks a message and stores it; a faulty one is counted, and logged at most once a second. A
  // motion primitive with a number is executed once, however often it is sent. Any thread.
  void put(const std::string& channel, const uint8_t* data, size_t size);

  // Requests a reset of a robot's odometry, with the request's body for the log. Any thread.
  void reset_odometry(RobotIndex robot, const std::vector<uint8_t>& body);

  // Schedules a command, encoded as on the bus, for exactly that state: it acts before the live
  // commands of that step, in the order of scheduling. late: the state
  // has passed; full: no room until others have been applied. A refused command changes nothing.
  // Any thread.
  Scheduled schedule(int64_t step, InputIndex input, const uint8_t* data, size_t size);

  // Applies the commands for the state `step` and records them in the batch: scheduled ones first,
  // then the waiting ones in order of arrival. For the simulation thread, for one step after the
  // other.
  void apply(robot::Robots& robots, Faults& faults, int64_t step, Batch& batch);

  const IndexedVector<InputIndex, Input>& inputs() const { return inputs_; }
  // The first state that commands can still act on. Any thread.
  int64_t next_step() const {
    const std::lock_guard lock(mutex_);
    return waits_.next_step;
  }
  void clear();

  // For robots that join and leave, while nothing is received or applied. `inputs` all belong to
  // one robot.
  void add(const std::vector<Input>& inputs, int robots);
  void remove(RobotIndex robot);
  void reset_time();  // steps count from 0: scheduled commands are dropped
  // Takes the waiting commands of another copy of the world, while nothing is received or applied.
  void copy_from(const CommandInbox& other) { waits_ = other.waits_; }
  // Waiting commands are not part of a written state.
  void exchange(StateArchive& archive) { archive(waits_.next_step); }

  uint64_t refused() const { return refused_; }      // faulty messages
  uint64_t displaced() const { return displaced_; }  // commands displaced by newer ones

 private:
  struct Entry {
    int64_t step = -1;  // of a scheduled command
    uint64_t arrival = 0;
    InputIndex input;
    robot::Command command;
    std::vector<uint8_t> bytes;
  };
  struct Slots {  // a ring of the newest
    explicit Slots(size_t most = kKeptPerRobot) : most(most) {}
    size_t most;
    std::vector<Entry> entries;                   // none before the first that is kept
    std::deque<std::vector<uint8_t>> primitives;  // the newest that have a number
    size_t first = 0, size = 0;
  };

  void listen(InputIndex input);
  Slots& slots_of(RobotIndex robot) {
    return robot.valid() ? waits_.slots[robot] : waits_.world_slots;
  }
  Entry& next_entry(RobotIndex robot);  // the mutex must be held
  bool is_repeated(const robot::Command& command, const uint8_t* data, size_t size);
  void keep(InputIndex input, robot::Command& command, const uint8_t* data, size_t size);
  void refuse(const std::string& channel, const char* why);
  Entry& next_taken(size_t& count);
  static bool later(const Entry& a, const Entry& b);  // the heap's order

  IndexedVector<InputIndex, Input> inputs_;
  std::unordered_map<std::string, InputIndex> by_channel_;  // only looked up, never iterated
  IndexedVector<RobotIndex, InputIndex> reset_input_;
  mutable std::mutex mutex_;
  struct Waits {
    std::vector<Slots> slots;  // for each robot
    Slots world_slots{kKeptOfWorld};
    std::vector<RobotIndex> robots;  // with entries
    uint64_t arrivals = 0;
    std::vector<Entry> scheduled;  // the first scheduled_count form a heap, the next step on top
    size_t scheduled_count = 0, scheduled_bytes = 0;
    int64_t next_step = 0;  // everything before it has been applied
  } waits_;
  std::vector<Entry> taken_;  // for the simulation thread
  std::atomic<uint64_t> refused_{0}, displaced_{0};
  int64_t last_warning_ns_ = 0;  // for the bus's thread
};

// The error in the values of a fault or of markers that can be decoded; "": none.
std::string check_values(Input::Kind kind, const uint8_t* data, size_t size);

// Whether all of its values are finite.
bool is_finite(const robot::Command& command);

// Decodes a command of that kind, or says why it cannot.
DecodeFault decode_command(Input::Kind kind, const uint8_t* data, size_t size,
                           robot::Command& command);

}  // namespace ruedo::engine
