// A few steps on their way through the server: their snapshots, and the modules' output for them.
//
// Passing on single steps would cost more than computing a step of a small world, so they travel in
// batches. Batches are recycled: after the first round nothing here allocates.
#pragma once

#include <algorithm>
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

inline constexpr int kMaxBatchSteps = 32;

using InputIndex = Index<struct InputKind>;  // into CommandInbox::inputs()

// A command that acted on the state of `step`.
struct AppliedCommand {
  int64_t step = 0;
  InputIndex input;
  std::vector<uint8_t> bytes;  // the message, as received
};

struct SensorFault;

// From the state `step` on, random numbers are drawn from that seed.
struct Reseeding {
  int64_t step;
  uint64_t seed;
};

// Of a list by step: the one by which that step draws; null: none yet.
inline const Reseeding* reseeding_at(const std::vector<Reseeding>& all, int64_t step) {
  const auto later =
      std::find_if(all.begin(), all.end(), [=](const Reseeding& one) { return one.step > step; });
  return later == all.begin() ? nullptr : &*std::prev(later);
}

// By channel: whether anybody reads its messages. Channels beyond its end are read.
using ReadChannels = std::vector<bool>;

// Written by the simulation thread, then by each module into its own output, then read by the
// publisher.
struct Batch {
  int64_t first_step = 0;
  int count = 0;
  bool last = false;                    // no batch follows
  std::vector<Snapshot> snapshots;      // the first `count` are valid
  std::vector<AppliedCommand> applied;  // the first `applied_count` are valid
  int applied_count = 0;

  // Of all devices, once any was faulty; null: none. Includes those that act on the batch's steps.
  std::shared_ptr<const std::vector<SensorFault>> sensor_faults;

  // By step; null: none. Includes those that the batch's steps draw by.
  std::shared_ptr<const std::vector<Reseeding>> reseedings;

  // Null: everything is read. Pictures without a reader are not drawn.
  std::shared_ptr<const ReadChannels> read;

  struct Output {
    bool woken = false;  // false: the rest is from an earlier round
    bool here = false;   // processed by the thread that computed the batch
    std::vector<Outbox> pieces;
  };
  std::vector<Output> outputs;  // one per module, in the order of the schedule

  // The number of modules still working on it; kFree if it is not in use.
  static constexpr int kFree = -1;
  std::atomic<int> pending{kFree};
  std::atomic<bool> failed{false};
  std::string failure;  // from the module that set `failed`
  std::string end;      // why it is the last one, if the state was not valid
};

}  // namespace ruedo::engine
