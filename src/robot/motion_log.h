// The order in which a robot's MotionStates are shown: one change a snapshot, none left out.
#pragma once

#include <array>

#include "ruedo/snapshot.h"

namespace ruedo::robot {

// Shows each change of a robot's MotionState in a snapshot of its own, in order: a command that replaces a
// primitive in one step shows the primitive's end at that step, and itself at the next.
class MotionLog {
 public:
  // What holds from now on. Counted as a change when id, kind, state or reason are others.
  void set(const MotionState& state);
  // Something that is over as soon as it is shown: the end of a replaced primitive, a refusal.
  void mention(const MotionState& state);
  void progress(double done, double remaining) {
    current_.done = done;
    current_.remaining = remaining;
  }
  const MotionState& current() const { return current_; }
  // To be called once a step: the next state to show.
  void advance();
  const MotionState& shown() const { return shown_; }

 private:
  static constexpr size_t kMentions = 8;    // more in one step are left out, the newest first
  MotionState current_, shown_;
  std::array<MotionState, kMentions> mentions_{};
  size_t mentioned_ = 0;
};

}  // namespace ruedo::robot
