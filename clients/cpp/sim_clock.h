// Sim time by the server's messages, and the time for which the server has been silent.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <list>
#include <mutex>
#include <thread>
#include <vector>

namespace ruedo::client {

// Thread safe.
class SimClock {
 public:
  using Woken = std::function<void(int64_t utime, const std::vector<std::thread::id>& threads)>;

  // woken: called with the sim time at which threads are woken, and with those.
  explicit SimClock(Woken woken) : woken_(std::move(woken)) { note_sign(); }

  int64_t utime() const { return utime_; }  // us, of the newest message
  void note(int64_t utime);                 // a message of that time came
  // The same of a tick: what another message said of a time long after it was false.
  void note_tick(int64_t utime);
  void note_sign();  // something came that has no time
  void reset(int64_t utime);
  // Whether the time is too far ahead of this run's messages to be right.
  bool is_far_ahead(int64_t utime) const;
  double silence() const;  // s of real time since the last sign of life
  // duration: us. check: called meanwhile, every 0.5 s at least; what it throws ends the waiting.
  void sleep(int64_t duration, const std::function<void()>& check);
  void wake();  // sleeping threads check at once

 private:
  using SteadyClock = std::chrono::steady_clock;
  struct Sleeper {
    std::thread::id thread;
    int64_t left;  // us; time may be set back meanwhile
  };

  const Woken woken_;
  std::atomic<int64_t> utime_{0};
  std::atomic<SteadyClock::rep> last_sign_{0};
  std::mutex mutex_;  // of changes to utime_, and what follows
  std::condition_variable news_;
  std::list<Sleeper> sleepers_;
};

}  // namespace ruedo::client
