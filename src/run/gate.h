// The limit of a run: no state after it is computed. The pacer is one; tests of the modes have
// their own.
#pragma once

#include <cstdint>

namespace ruedo::run {

class Gate {
 public:
  virtual ~Gate() = default;
  // The step that waits for a higher limit is due at once when it comes.
  virtual void set_limit(int64_t step) = 0;
  // The same, without waking the simulation thread: the caller computes the next steps itself, or
  // wakes it later.
  virtual void set_limit_quietly(int64_t step) = 0;
  virtual bool paused() const = 0;
};

}  // namespace ruedo::run
