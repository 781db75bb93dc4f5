// Pacing by absolute deadlines on the monotonic clock; a condition variable's timed wait is the
// same kernel timer as clock_nanosleep's, and a pause or the end of the run cuts it short.
#include "run/pacer.h"

#include <algorithm>
#include <cmath>

#include "base/whole.h"

namespace ruedo::run {
namespace {

constexpr int64_t kFewSteps = 4;

// Of the steps granted in lockstep: the sensors, the publisher and the waiting client work on the
// first ones while the next are computed.
int64_t some_of(int64_t granted) { return std::max(kFewSteps, (granted + 3) / 4); }

}  // namespace

Pacer::Pacer(int64_t step_us, double rate, int64_t last_step)
    : step_us_(step_us),
      last_step_(last_step),
      rate_(rate),
      until_(last_step),
      origin_time_(Clock::now()) {}

Pacer::Clock::time_point Pacer::due(int64_t step) const {
  const double real_us =
      static_cast<double>(step - origin_step_) * static_cast<double>(step_us_) / rate_;
  return origin_time_ + std::chrono::nanoseconds(whole(std::min(real_us * 1e3, 9e18)));
}

// The last state that may be computed.
int64_t Pacer::until() const {
  const int64_t limit = std::min({until_, limit_, limits_.at_any_rate});
  return std::isfinite(rate_) ? limit : std::min(limit, limits_.at_highest_rate);
}

void Pacer::reset() {
  origin_step_ = granted_ + 1;
  origin_time_ = Clock::now();
}

void Pacer::sleep(std::unique_lock<std::mutex>& lock) {
  asleep_ = true;
  changed_.wait(lock);
  asleep_ = false;
}

int Pacer::wait(int64_t& step, int limit) {
  std::unique_lock lock(mutex_);
  if (granted_ < 0) reset();
  for (;;) {
    if (lent_) {
      sleep(lock);
      continue;
    }
    step = granted_ + 1;  // some may have been borrowed
    if (hold_ && !stopped_) {
      held_ = true;
      changed_.notify_all();
      changed_.wait(lock);
      held_ = false;
      continue;
    }
    if (stopped_ || step > last_step_) {
      over_ = true;
      changed_.notify_all();
      return 0;
    }
    const int64_t until = this->until();
    if (step > until) {
      sleep(lock);
      continue;
    }
    int64_t count =
        std::min<int64_t>(limit - 1, until - step) + 1;  // until may be the largest number there is
    if (limit_ < INT64_MAX || until < until_) count = std::min(count, some_of(until - step + 1));
    if (std::isfinite(rate_) && !paused_) {  // single steps are computed at once
      const Clock::time_point now = Clock::now();
      const Clock::time_point due_now = due(step);
      if (now < due_now) {
        changed_.wait_until(lock, due_now);
        continue;
      }
      if (now - due_now > kMostCatchUp) {
        origin_step_ = step;
        origin_time_ = now - kMostCatchUp;
      }
      int64_t late = 1;  // of a paced run, only what is already due goes together
      while (late < count && due(step + late) <= now) ++late;
      count = late;
    }
    granted_ = step + count - 1;
    return static_cast<int>(count);
  }
}

int Pacer::borrow(int64_t& step, int limit) {
  std::lock_guard lock(mutex_);
  const int64_t until = this->until();
  if (lent_ || granted_ >= until) return 0;
  const bool paced = std::isfinite(rate_) && !paused_;  // real time decides
  if (!asleep_ || hold_ || stopped_ || paced || until - granted_ > limit) {
    changed_.notify_all();
    return 0;
  }
  lent_ = true;
  step = granted_ + 1;
  granted_ = until;
  return static_cast<int>(until - step + 1);
}

void Pacer::give_back(int unused) {
  bool told;
  {
    std::lock_guard lock(mutex_);
    granted_ -= unused;
    lent_ = false;
    told = hold_ || stopped_ || granted_ >= last_step_ || until() > granted_;
  }
  if (told) changed_.notify_all();
}

int64_t Pacer::hold() {
  int64_t last;
  {
    std::lock_guard lock(mutex_);
    hold_ = true;
    last = granted_;
  }
  changed_.notify_all();
  return last;
}

bool Pacer::wait_until_held() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return held_ || over_; });
  return !over_;
}

void Pacer::release() {
  {
    std::lock_guard lock(mutex_);
    hold_ = false;
  }
  changed_.notify_all();
}

void Pacer::reset_time() {
  std::lock_guard lock(mutex_);
  granted_ = -1;
  until_ = paused_ ? 0 : last_step_;
  reset();
}

void Pacer::go_on_from(int64_t step) {
  std::lock_guard lock(mutex_);
  granted_ = step;
  until_ = paused_ ? step : last_step_;
  reset();
}

void Pacer::stop() {
  {
    std::lock_guard lock(mutex_);
    stopped_ = true;
  }
  changed_.notify_all();
}

int64_t Pacer::pause() {
  std::lock_guard lock(mutex_);
  paused_ = true;
  until_ = std::max<int64_t>(granted_, 0);  // the initial state is always published
  return until_;
}

void Pacer::resume() {
  {
    std::lock_guard lock(mutex_);
    if (!paused_) return;
    paused_ = false;
    until_ = last_step_;
    reset();
  }
  changed_.notify_all();
}

int64_t Pacer::allow(int64_t steps) {
  int64_t until;
  {
    std::lock_guard lock(mutex_);
    until_ = steps > last_step_ - until_ ? last_step_ : until_ + steps;
    until = until_;
  }
  changed_.notify_all();
  return until;
}

void Pacer::set_rate(double rate) {
  {
    std::lock_guard lock(mutex_);
    rate_ = rate;
    reset();
  }
  changed_.notify_all();
}

void Pacer::set_limit_quietly(int64_t step) {
  std::lock_guard lock(mutex_);
  limit_ = step;
}

void Pacer::set_limit(int64_t step) {
  set_limit_quietly(step);
  changed_.notify_all();
}

void Pacer::set_limits(const Backpressure::Limits& limits) {
  const std::lock_guard lock(mutex_);
  limits_ = limits;
}

void Pacer::look_again() { changed_.notify_all(); }

bool Pacer::paused() const {
  std::lock_guard lock(mutex_);
  return paused_;
}

bool Pacer::rests() const {
  const std::lock_guard lock(mutex_);
  if (granted_ >= until_) return true;
  const bool paced = std::isfinite(rate_) && !paused_;
  return paced && granted_ < limit_ && Clock::now() < due(granted_ + 1);
}

bool Pacer::is_limited() const {
  const std::lock_guard lock(mutex_);
  return granted_ >= until() && until() < std::min(until_, limit_);
}

double Pacer::rate() const {
  std::lock_guard lock(mutex_);
  return rate_;
}

}  // namespace ruedo::run
