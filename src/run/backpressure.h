// Back-pressure from the program that launched the run: the run waits for it instead of leaving it
// behind.
//
// The program reports its progress in sim time. The run advances at most kMostAhead further, half
// of it while the program is using a sample, or one step if that is longer; and it has at most
// kMostBytes of samples on the way to the program. Before the first report the run does not
// wait.
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
  // It is using samples of that time, and has not requested newer ones: a run at the highest rate
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

  // Any thread, as all that follows. Reports of another epoch are ignored.
  void note_progress(const LauncherProgress& progress);
  void end();  // the run waits no longer
  // The run continues from there.
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
