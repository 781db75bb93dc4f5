// Whether sim time advances while a call waits for it, and if not, why.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>

#include "sim_clock.h"

namespace ruedo::client {

// Of one call, in its thread.
class Standstill {
 public:
  using Clock = std::chrono::steady_clock;

  // call: for the terminal. why: why sim time may stand still; "": it is not known to.
  Standstill(const SimClock& clock, std::string call, std::function<std::string()> why);

  void look();           // says so, once, when it has stood still for 5 s
  std::string reason();  // why the call has waited in vain; "": sim time advances

 private:
  Clock::duration stands_for();

  const SimClock& clock_;
  const std::string call_;
  const std::function<std::string()> why_;
  int64_t utime_;
  const Clock::time_point began_ = Clock::now();
  Clock::time_point since_ = began_;
  bool told_ = false;
};

}  // namespace ruedo::client
