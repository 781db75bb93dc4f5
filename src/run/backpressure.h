// Back-pressure from the program that launched the run: the run waits for it, rather than leave it
// behind.
//
// The program says how far it has come, in sim time. The run goes at most kMostAhead further, half
// of it where the program works with what it knows, or one step where that is longer; and it has at
// most kMostBytes of samples on the way to the program. Until the first such word the run waits for
// nobody.
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <limits>
#include <mutex>
#include <optional>
#include <string_view>

#include "ruedo/sim_time.h"

namespace ruedo::run {

// How far the program that launched the run has come.
struct LauncherProgress {
  int32_t epoch = 0;
  // All samples up to here have come, and its callbacks have seen them.
  SimTime received_us = 0;
  // It works with what it knew then, and has not asked for more yet: a run at the highest rate
  // waits for that, too. The largest number: it waits for samples.
  SimTime used_us = std::numeric_limits<SimTime>::max();
};

// A line of the program's: "EPOCH RECEIVED_US USED_US", in decimal; nothing: it is no such line.
std::optional<LauncherProgress> read_launcher_progress(std::string_view line);

class Backpressure {
 public:
  static constexpr SimTime kMostAhead = 30'000;
  static constexpr uint64_t kMostBytes = uint64_t{1} << 20;

  // The last steps that may be computed.
  struct Limits {
    int64_t at_any_rate = std::numeric_limits<int64_t>::max();
    int64_t at_highest_rate = std::numeric_limits<int64_t>::max();
  };

  explicit Backpressure(int64_t step_us) : step_us_(step_us) {}

  // Any thread, as all that follows. What is of another epoch is ignored.
  void note_progress(const LauncherProgress& progress);
  void end();  // nobody is waited for any more
  // The run goes on from there.
  void begin(int32_t epoch, SimTime time_us);
  Limits limits() const;
  bool acts() const { return acts_; }  // the program has said something; asked at each step

  // The samples up to that time have this many bytes, since the run began.
  void published(SimTime time_us, uint64_t bytes);
  bool has_room() const;

 private:
  struct Mark {
    SimTime time_us;
    uint64_t bytes;
  };

  const int64_t step_us_;
  std::atomic<bool> acts_{false};
  mutable std::mutex mutex_;
  LauncherProgress progress_;
  std::deque<Mark> on_the_way_;  // what was published after progress_.received_us
  uint64_t published_ = 0, received_ = 0;
};

}  // namespace ruedo::run
