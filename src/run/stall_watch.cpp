// Two ways to notice: the publisher's own, while it is idle, and the thread's, while it is not.
#include "run/stall_watch.h"

#include <utility>

#include <fmt/format.h>
#include <pthread.h>

namespace ruedo::run {

StallWatch::StallWatch(Host host) : host_(std::move(host)), thread_([this] { watch(); }) {}

StallWatch::~StallWatch() {
  {
    const std::lock_guard lock(mutex_);
    is_over_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void StallWatch::beat(std::string request) {
  {
    const std::lock_guard lock(mutex_);
    request_ = std::move(request);
  }
  beat(At::request);
}

void StallWatch::moved(Clock::time_point now) {
  moved_ = now;
  told_ = false;
}

void StallWatch::idle(Clock::time_point now, const std::function<std::string()>& why) {
  if (told_ || now < moved_ + kPatience) return;
  const std::string reason = why();
  if (reason.empty()) return;
  told_ = true;
  {
    const std::lock_guard lock(mutex_);
    say(reason, now);
  }
  changed_.notify_all();
}

void StallWatch::say(const std::string& reason, Clock::time_point now) {
  if (reason == last_reason_ && now < last_told_ + kQuiet) return;
  last_reason_ = reason;
  last_told_ = now;
  to_tell_.push_back(reason);
}

std::string StallWatch::reason(At at) {
  switch (at) {
    case At::rest: return "";  // idle() reports
    case At::steps: return "a step is being computed";
    case At::messages: return host_.takes_none();
    case At::request: return "a request is being executed: " + request_;
  }
  return "";
}

void StallWatch::watch() {
  pthread_setname_np(pthread_self(), "stall watch");
  std::unique_lock lock(mutex_);
  while (!is_over_ || !to_tell_.empty()) {
    changed_.wait_for(lock, kPatience / 6, [this] { return is_over_ || !to_tell_.empty(); });
    if (!is_over_) look(Clock::now());
    const std::vector<std::string> reasons = std::exchange(to_tell_, {});
    lock.unlock();
    for (const std::string& reason : reasons) host_.tell(reason);
    lock.lock();
    last_look_ = Clock::now();
  }
}

void StallWatch::look(Clock::time_point now) {
  const Clock::duration blind = now - std::exchange(last_look_, now);
  const uint64_t beats = beats_.load(std::memory_order_acquire);
  if (blind > kPatience) {
    to_tell_.push_back(
        fmt::format("this process did not run for {:.1f} s: a signal stopped it, or it got no "
                    "processor. Sim time continues where it stopped",
                    std::chrono::duration<double>(blind).count()));
    last_beat_ = now;  // no client is to blame
  } else if (beats != std::exchange(seen_beats_, beats)) {
    last_beat_ = now;
    beat_missed_ = false;
  } else if (!beat_missed_ && now >= last_beat_ + kPatience) {
    const std::string why = reason(at_.load(std::memory_order_relaxed));
    beat_missed_ = true;
    if (!why.empty()) say(why, now);
  }
}

}  // namespace ruedo::run
