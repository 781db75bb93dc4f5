// When the next steps of a world may be computed. The engine asks; its host knows about clocks,
// clients and pauses.
#pragma once

#include <cstdint>

namespace ruedo::engine {

class Pace {
 public:
  virtual ~Pace() = default;

  // Waits until the next state may be computed; returns how many may be computed now, at most
  // `limit`; 0 once the run is over. `step` is set to the first of them. For the simulation thread.
  virtual int wait(int64_t& step, int limit) = 0;

  // For another thread that would rather compute the next steps itself than wake the one that
  // sleeps in wait(): how many may be computed now, if at most `limit`; 0: none, or more, and then
  // the sleeping thread is woken for them. It keeps sleeping until give_back(). unused: how many of
  // the last steps were not computed.
  virtual int borrow(int64_t& step, int limit) = 0;
  virtual void give_back(int unused) = 0;

  virtual void stop() = 0;  // from now on wait() returns 0
};

}  // namespace ruedo::engine
