// What a robot's motion publishes at each step: the state that holds, and what ended or was refused
// on the way to it.
#pragma once

#include <array>
#include <span>

#include "ruedo/snapshot.h"

namespace ruedo::robot {

// Gathers the changes of a step, so that a command shows at the step at which it takes effect: a
// snapshot has what holds after it, and beside that the ends of the primitives that commands
// replaced, and the refusals.
class MotionLog {
 public:
  // What holds from now on. Counted as a change when id, kind, state or reason are others.
  void set(const MotionState& state) { current_ = state; }
  // Something that is over as soon as it is shown: the end of a replaced primitive, a refusal.
  void mention(const MotionState& state);
  void progress(double done, double remaining) {
    current_.done = done;
    current_.remaining = remaining;
  }
  const MotionState& current() const { return current_; }
  // To be called once a step: shows what came since the last one.
  void advance();
  const MotionState& shown() const { return shown_; }
  std::span<const MotionState> ends() const { return {ends_.data(), shown_ends_}; }

 private:
  static constexpr size_t kEnds = 8;  // more in one step are left out, the newest first
  MotionState current_, shown_;
  std::array<MotionState, kEnds> ends_{};
  size_t shown_ends_ = 0, new_ends_ = 0;  // of those in ends_; at most one of both is not 0
};

}  // namespace ruedo::robot
