// What the server is told: the line of src/run/backpressure.h.
#include "progress.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace ruedo::client {
namespace {

using SteadyClock = std::chrono::steady_clock;

// A program that was given a sample and then does something else for so long is not waited for.
constexpr std::chrono::milliseconds kPatience(500);

}  // namespace

void Progress::begin(std::function<void(const std::string& line)> tell) {
  const std::lock_guard lock(mutex_);
  tell_ = std::move(tell);
  told_ = true;
}

bool Progress::in_use() const {
  if (!told_) return false;
  const std::lock_guard lock(mutex_);
  return !uses_.empty();
}

void Progress::received(int32_t epoch, int64_t utime) {
  if (!told_) return;
  const std::lock_guard lock(mutex_);
  if (epoch != epoch_) uses_.clear();
  epoch_ = epoch;
  received_ = utime;
  say_locked();
}

void Progress::use(int64_t utime, const Threads& threads) {
  if (!told_) return;
  const std::lock_guard lock(mutex_);
  for (const std::thread::id thread : threads) uses_[thread] = {utime, SteadyClock::now()};
  say_locked();
}

void Progress::wait() {
  if (!told_) return;
  const std::lock_guard lock(mutex_);
  if (uses_.erase(std::this_thread::get_id()) > 0) say_locked();
}

void Progress::say() {
  if (!told_) return;
  const std::lock_guard lock(mutex_);
  say_locked();
}

void Progress::say_locked() {
  const auto now = SteadyClock::now();
  std::erase_if(uses_, [&](const auto& one) { return now - one.second.since > kPatience; });
  int64_t used = std::numeric_limits<int64_t>::max();
  for (const auto& [thread, use] : uses_) {
    const auto since = std::chrono::duration_cast<std::chrono::microseconds>(now - use.since);
    used = std::min(used, use.utime + since.count());
  }
  std::string line =
      std::to_string(epoch_) + " " + std::to_string(received_) + " " + std::to_string(used) + "\n";
  if (line == last_) return;
  last_ = std::move(line);
  tell_(last_);
}

}  // namespace ruedo::client
