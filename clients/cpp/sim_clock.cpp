// Sim time, and the threads that wait for it.
#include "sim_clock.h"

#include <algorithm>

namespace ruedo::client {
namespace {

constexpr int64_t kMostAhead = 1'000'000;  // us: ticks come ten times a second at least

}  // namespace

void SimClock::note(int64_t utime) {
  note_sign();
  const std::lock_guard lock(mutex_);
  const int64_t passed = utime > utime_ ? utime - utime_ : 0;
  utime_ += passed;
  std::vector<std::thread::id> woken;
  for (Sleeper& sleeper : sleepers_) {
    if (sleeper.left <= 0) continue;
    sleeper.left -= passed;
    if (sleeper.left <= 0) woken.push_back(sleeper.thread);
  }
  if (woken.empty()) return;
  woken_(utime_, woken);
  news_.notify_all();
}

void SimClock::note_tick(int64_t utime) {
  {
    const std::lock_guard lock(mutex_);
    if (utime < utime_ - kMostAhead) utime_ = std::max<int64_t>(utime, 0);
  }
  note(utime);
}

void SimClock::note_sign() { last_sign_ = SteadyClock::now().time_since_epoch().count(); }

void SimClock::reset(int64_t utime) {
  const std::lock_guard lock(mutex_);
  utime_ = std::max<int64_t>(utime, 0);
}

bool SimClock::is_far_ahead(int64_t utime) const {
  return utime > kMostAhead && utime - kMostAhead > utime_;
}

double SimClock::silence() const {
  const SteadyClock::duration since =
      SteadyClock::now().time_since_epoch() - SteadyClock::duration(last_sign_.load());
  return std::chrono::duration<double>(since).count();
}

void SimClock::sleep(int64_t duration, const std::function<void()>& check) {
  std::unique_lock lock(mutex_);
  const auto me = sleepers_.insert(sleepers_.end(), {std::this_thread::get_id(), duration});
  struct Leave {
    SimClock& clock;
    std::unique_lock<std::mutex>& lock;
    std::list<Sleeper>::iterator me;
    ~Leave() {
      if (!lock.owns_lock()) lock.lock();
      clock.sleepers_.erase(me);
    }
  };
  const Leave leave{*this, lock, me};
  while (me->left > 0) {
    news_.wait_for(lock, std::chrono::milliseconds(500));
    if (me->left <= 0) break;
    lock.unlock();
    check();
    lock.lock();
  }
}

void SimClock::wake() {
  const std::lock_guard lock(mutex_);
  news_.notify_all();
}

}  // namespace ruedo::client
