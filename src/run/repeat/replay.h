// A run that is repeated: what acted on it is read from its log, or from a snapshot, and acts again
// on the same steps.
//
// Commands go to the inbox ahead of time; the pacer lets the run go as far as is known what acts on
// it, and to the step of a request, which the run then executes. Used by the publisher's thread
// alone.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "engine/command_inbox.h"
#include "log/reader.h"
#include "ruedo/applied_t.hpp"
#include "ruedo/log_header_t.hpp"
#include "ruedo/state_hash_t.hpp"
#include "run/gate.h"

namespace ruedo::run {

class Replay {
 public:
  // The input of the current epoch.
  struct Target {
    engine::CommandInbox& inbox;
    Gate& gate;
    // The input that takes it; -1: it is a request. Throws InputError for a channel that there is
    // not.
    std::function<engine::InputIndex(const applied_t&)> input_of;
    SimTime begin_us;  // of the epoch, in stamps of the log: what went on before sim time was last
                       // set to 0
  };

  // Throws InputError for a file that is not a log, or does not begin with the header of a run.
  explicit Replay(const std::string& path);

  const log_header_t& header() const { return header_; }
  const std::string& path() const { return reader_.path(); }

  // To be called when state `step` is out, or none is yet (-1). Returns a request that acts on that
  // state: execute it, then call executed(), then this again. Null: the run continues, or is at its
  // end. Throws InputError for a log that does not match the run.
  const applied_t* advance(int64_t step, const Target& target);
  void executed();
  const applied_t& applied() const { return applied_; }  // that advance() returned

  // After advance() returned null: whether that was all.
  bool at_end(int64_t step) const { return ended_ && !waits_ && step >= end_step_; }
  // Then: in what state the run ended, where the log says so.
  const state_hash_t& end() const { return end_; }

 private:
  static constexpr int64_t kAhead = 1024;  // steps that are read ahead of what runs

  void read(const Target& target);
  [[noreturn]] void damaged(const std::string& what) const;

  log::Reader reader_;
  log::Event event_;
  log_header_t header_;
  applied_t applied_;  // the next thing that acted, if waits_
  bool waits_ = false;
  bool ended_ = false;
  int64_t known_ = -1;  // all that acts on the states before this one is known
  int64_t end_step_ = -1;
  state_hash_t end_{};
};

// How far a log or a snapshot goes, by what its records say. Nothing of it is run.
struct Length {
  int64_t steps = 0;  // of all its sim times, for each reset begins another; INT64_MAX: or more
  std::string fault;  // why it breaks off; "": the end of the run is in it
};
// Throws InputError as Replay does.
Length length_of(const std::string& path);

// The header of a log. Throws InputError as Replay does.
log_header_t read_header(const std::string& path);

}  // namespace ruedo::run
