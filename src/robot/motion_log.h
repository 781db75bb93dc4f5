// The messages of a robot's motion at each step: the current state, and motions that ended or were
// refused before it.
#pragma once

#include <array>
#include <span>

#include "ruedo/snapshot.h"

namespace ruedo::robot {

// Collects the changes of a step, so that a command shows at the step at which it takes effect: a
// snapshot has the state after it, and in addition the primitives that were replaced, and the
// refusals.
class MotionLog {
 public:
  // The current state. Counts as a change if id, kind, state or reason differ.
  void set(const MotionState& state) { current_ = state; }
  // A single event: the end of a replaced primitive, or a refusal.
  void mention(const MotionState& state);
  void progress(double done, double remaining) {
    current_.done = done;
    current_.remaining = remaining;
  }
  const MotionState& current() const { return current_; }
  // To be called once per step: shows the events since the last call.
  void advance();
  const MotionState& shown() const { return shown_; }
  std::span<const MotionState> ends() const { return {ends_.data(), shown_ends_}; }

 private:
  static constexpr size_t kEnds = 8;  // events per step; the newest ones beyond are dropped
  MotionState current_, shown_;
  std::array<MotionState, kEnds> ends_{};
  size_t shown_ends_ = 0, new_ends_ = 0;  // in ends_; at most one of them is not 0
};

}  // namespace ruedo::robot
