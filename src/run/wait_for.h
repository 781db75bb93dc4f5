// Input channels that the run waits for: a program that answers each sensor message with a command,
// and knows nothing of steps, then drives a run that can be repeated, as fast as it can.
//
// Message k of such a channel (from 0) acts on the state of the first step at or after k / rate;
// the run goes no further than that state before the message is there. While the channel's robot is
// not in the world, nothing is waited for. Guarded by the server's lock of the simulation.
#pragma once

#include <string>
#include <vector>

#include "engine/channels.h"
#include "engine/command_inbox.h"
#include "ruedo/sim_time.h"
#include "run/gate.h"

namespace ruedo::run {

struct WaitForOption {
  std::string channel;  // its own name, or the one that --remap gives it
  Rate rate;
};

class WaitFor {
 public:
  // Messages that may be there before the run is where the first of them acts.
  static constexpr int64_t kMostAhead = 64;

  WaitFor(std::vector<WaitForOption> options, int64_t step_us);

  // For a simulation that was rebuilt, or is at `step` for another reason. The first time it throws
  // InputError for a channel that is not an input.
  void attach(const engine::Channels& channels, engine::CommandInbox& inbox, Gate& gate,
              int64_t step);

  // Models have come or gone at that step: robots that are waited for, maybe.
  void models_changed(const engine::Channels& channels, int64_t step);

  // False: another channel.
  bool on_message(const std::string& channel, const uint8_t* data, size_t size);

  // The missing message before the state after `step` can be computed, in words; "": none.
  std::string waits_for(int64_t step) const;

 private:
  struct Waited {
    WaitForOption option;
    SampleClock clock;
    engine::InputIndex input;  // none: its robot is not there
    std::string channel;       // on the bus
    int64_t next = 0;          // number of the message that comes next
    bool told = false;
  };

  void check(const engine::Channels& channels, const engine::CommandInbox& inbox) const;
  void begin(Waited& waited, engine::InputIndex input, int64_t step);  // from that state on
  void limit();

  std::vector<Waited> waited_;
  engine::CommandInbox* inbox_ = nullptr;
  Gate* gate_ = nullptr;
};

}  // namespace ruedo::run
