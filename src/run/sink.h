// A receiver of a run's messages: the bus, a log, a watcher, another middleware.
//
// The publisher calls every sink from its own thread, in one order: announce(), then for each state
// begin_step(), its messages in the order of the schedule, and end_step(). No sink may throw,
// delay the run, or change the messages of others: one that may be slow works behind a QueuedSink,
// in a thread of its own. docs/architecture.md says how a sink is added.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "engine/channels.h"
#include "ruedo/sim_time.h"
#include "ruedo/world_info_t.hpp"

namespace ruedo::run {

enum class Kind {
  sample,   // of a sensor, or ruedo/world: the result of the run, the same bytes for the same seed
            // and commands
  record,   // what acted on the run, and hashes of its state: for logs
  service,  // ticks, ruedo/info and replies: of this run alone, and in no log
};

// A message. Its data is valid during the call.
struct Published {
  Kind kind;
  SimTime time_us;             // sim time in this epoch
  SimTime stamp_us;            // the same for logs: it continues when sim time is reset
  const std::string& channel;  // as it is called on the bus
  engine::ChannelIndex index;  // in Announcement::channels; none: a record
  int64_t sequence;            // number on its channel in this epoch, from 0; of a tick: its part
  const uint8_t* data;
  size_t size;
};

struct Step {
  int64_t step;
  SimTime time_us;
  int32_t epoch;
};

// The contents of the run from now on.
struct Announcement {
  engine::Channels channels;
  engine::SimulationChannels own;  // their indices
  std::vector<world_info_t> info;  // robots, devices, frames, rates, in parts
};

class Sink {
 public:
  struct Hears {
    bool samples = true, records = false, services = false;
    bool repeated =
        false;  // also while a log or a snapshot is repeated: logs hear that, clients do not
  };

  virtual ~Sink() = default;

  // Does not change.
  virtual Hears hears() const { return {}; }

  // Whether it reads the samples of that channel. Pictures that no sink reads are not drawn: then
  // message() does not get them. The publisher's thread, as the next.
  virtual bool wants(const std::string& channel) const {
    static_cast<void>(channel);
    return true;
  }
  // Grows whenever the answer of wants() may have changed.
  virtual uint64_t audience() const { return 0; }

  // Before anything else, and again whenever models have come or gone, or sim time was reset.
  virtual void announce(const std::shared_ptr<const Announcement>& announcement) {
    static_cast<void>(announcement);
  }
  virtual void begin_step(const Step& step) { static_cast<void>(step); }
  virtual void message(const Published& message) = 0;
  virtual void end_step(const Step& step) { static_cast<void>(step); }

  // Sends off the messages until now: called after each batch of steps, and when there is nothing
  // else to do.
  virtual void flush() {}
};

}  // namespace ruedo::run
