// When the next steps may be computed: real time, pause, single steps and the end of the run in one
// place.
//
// Step s of a run at rate r is due s dt / r after the start, by the monotonic clock: deadlines are
// absolute, so that nothing drifts. None of this enters a result. Thread safe; wait() belongs to
// the simulation thread.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <limits>
#include <mutex>

#include "engine/pace.h"
#include "run/backpressure.h"
#include "run/gate.h"

namespace ruedo::run {

class Pacer : public engine::Pace, public Gate {
 public:
  using Clock = std::chrono::steady_clock;

  // Rates that make sense, beside +inf: a run that takes one step an hour looks like one that
  // hangs.
  static constexpr double kSlowest = 1e-4, kFastest = 1e6;
  static bool takes(double rate) {
    return rate == std::numeric_limits<double>::infinity() ||
           (rate >= kSlowest && rate <= kFastest);
  }

  // rate: simulated per real time; +inf: as fast as possible. last_step: of the run, INT64_MAX:
  // none.
  Pacer(int64_t step_us, double rate, int64_t last_step);

  int wait(int64_t& step, int limit) override;
  int borrow(int64_t& step, int limit) override;
  void give_back(int unused) override;
  void stop() override;
  int64_t
  pause();  // ends what allow() allowed, too; returns the last state that will still be computed
  void resume();
  int64_t allow(int64_t steps);  // while paused: that many more; returns the last one of them
  void set_rate(double rate);
  void set_limit(int64_t step) override;
  void set_limit_quietly(int64_t step) override;        // for the next call of borrow()
  void set_limits(const Backpressure::Limits& limits);  // beside that of set_limit(), and quietly
  void look_again();  // wakes a thread that waits at a limit that was set quietly

  // Standing still for a change of the world. hold(): wait() lets nothing more go; returns the last
  // state that it let go. wait_until_held(), when that state is done: until the simulation thread
  // waits; false when the run is over.
  int64_t hold();
  bool wait_until_held();
  void release();
  void reset_time();              // while held: the next state is 0
  void go_on_from(int64_t step);  // while held, or before wait(): that state is there

  bool paused() const override;
  // Whether nothing is to be computed now: a pause, the end of the run, or real time.
  bool rests() const;
  double rate() const;
  bool is_limited() const;  // by set_limits(), now
  int64_t last_step() const { return last_step_; }

 private:
  Clock::time_point due(int64_t step) const;
  int64_t until() const;
  void reset();
  void sleep(std::unique_lock<std::mutex>& lock);

  // After a delay the run catches up by at most this much; what is beyond it stays lost.
  static constexpr auto kMostCatchUp = std::chrono::milliseconds(250);

  const int64_t step_us_;
  const int64_t last_step_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  double rate_;
  bool stopped_ = false, paused_ = false;
  bool hold_ = false, held_ = false, over_ = false;
  bool asleep_ = false,
       lent_ = false;  // wait() waits for a higher limit; its steps are another thread's
  int64_t until_;  // last state that may be computed: by the end of the run, pause() and allow(),
  int64_t limit_ = INT64_MAX;    // by set_limit(),
  Backpressure::Limits limits_;  // and by set_limits()
  int64_t granted_ = -1;         // last state that wait() let go
  int64_t origin_step_ = 0;      // was due at origin_time_
  Clock::time_point origin_time_;
};

}  // namespace ruedo::run
