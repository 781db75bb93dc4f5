// When the next steps of a world may be computed. The engine asks; who hosts it knows clocks,
// clients and pauses.
#pragma once

#include <cstdint>

namespace ruedo::engine {

class Pace {
 public:
  virtual ~Pace() = default;

  // Waits until the next state may be computed; returns how many may be computed now, at most
  // `limit`, 0 when the run is over. `step` becomes the first of them. The simulation thread's.
  virtual int wait(int64_t& step, int limit) = 0;

  // For another thread that would rather compute the next steps itself than wake the one that
  // sleeps in wait(): how many may be computed now, if at most `limit`; 0: none, or more, and then
  // that thread is woken for them. Until give_back() it sleeps on. unused: the last so many were
  // not computed.
  virtual int borrow(int64_t& step, int limit) = 0;
  virtual void give_back(int unused) = 0;

  virtual void stop() = 0;  // wait() returns 0 from now on
};

}  // namespace ruedo::engine
