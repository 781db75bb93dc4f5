// The progress of a long task, for a watcher: a terminal's line
// (src/cli/support/progress_line.h). Without a reader it costs a store.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

namespace ruedo {

class Progress {
 public:
  using Clock = std::chrono::steady_clock;

  // what: in words, such as "reading run.lcm". whole: where it will be done; 0: unknown.
  explicit Progress(std::string what, int64_t whole = 0);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void to(int64_t done) { done_.store(done, std::memory_order_relaxed); }

  struct State {
    std::string what;
    int64_t done = 0, whole = 0;
    Clock::time_point begin;
  };
  // Of what began last and is not over yet, in whichever thread.
  static std::optional<State> latest();
  // Called when a task begins or ends, before the program continues; one watcher at a time, {} for
  // none.
  static void watch(std::function<void()> watcher);

 private:
  const std::string what_;
  const int64_t whole_;
  std::atomic<int64_t> done_ = 0;
  const Clock::time_point begin_ = Clock::now();
};

}  // namespace ruedo
