// A few steps on their way through the server: their snapshots, and what the modules make of them.
//
// Handing steps over singly costs more than a small world's step does, so they travel in batches.
// Batches are recycled: after the first round none of this allocates.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engine/queue.h"
#include "ruedo/sensor.h"
#include "ruedo/snapshot.h"

namespace ruedo::engine {

// A command that took effect on the state of `step`.
struct AppliedCommand {
  int64_t step = 0;
  int input = -1;              // index into CommandInbox's inputs
  std::vector<uint8_t> bytes;  // the message, as it came
};

struct SensorFault;

// From the state `step` on, whatever is drawn comes from that seed.
struct Reseeding {
  int64_t step;
  uint64_t seed;
};

// By channel: whether anybody reads its messages. A channel beyond its end is read.
using ReadChannels = std::vector<bool>;

// Written by the simulation thread, then by each module into its own output, then read by the
// publisher.
struct Batch {
  int64_t first_step = 0;
  int count = 0;
  bool last = false;                    // nothing follows
  std::vector<Snapshot> snapshots;      // the first `count` are valid
  std::vector<AppliedCommand> applied;  // the first `applied_count` are valid
  int applied_count = 0;

  // Of all devices, while any is faulty or was; null: none. Those of the batch's steps are in it.
  std::shared_ptr<const std::vector<SensorFault>> sensor_faults;

  // By step; null: none. Those of the batch's steps are in it.
  std::shared_ptr<const std::vector<Reseeding>> reseedings;

  // Null: everything is read. Pictures of cameras of which nothing is read are not drawn.
  std::shared_ptr<const ReadChannels> read;

  struct Output {
    bool woken = false;  // false: the rest is of an earlier round
    bool here = false;   // worked through by who computed the batch
    std::vector<Outbox> pieces;
  };
  std::vector<Output> outputs;  // one per module, in the order of the schedule

  // Modules that still work on it; kFree when none does.
  static constexpr int kFree = -1;
  std::atomic<int> pending{kFree};
  std::atomic<bool> failed{false};
  std::string failure;  // of the module that set `failed`
  std::string end;      // why it is the last, where the state could not be gone on from
};

}  // namespace ruedo::engine
