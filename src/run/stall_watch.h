// Reports within two seconds why a run does not advance, once for each stop.
//
// While the publisher has nothing to do it asks for the reason itself: a client, a sensor, a step.
// When the publisher itself is blocked, by a request or a disk, a thread of the watch notices that
// its beats have stopped, and reports it; likewise when the whole process was stopped. That thread
// prints all reports, and delays nothing meanwhile: standard error may be a pipe without a
// reader.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace ruedo::run {

class StallWatch {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds kPatience{1500};
  // A client that takes seconds for each answer is reported at most once in this time.
  static constexpr std::chrono::seconds kQuiet{60};

  enum class At { rest, steps, messages, request };  // what the publisher is at

  struct Host {
    // Called with the reason, in the watch's thread.
    std::function<void(const std::string& reason)> tell;
    // Describes what takes no messages. Called in the watch's thread.
    std::function<std::string()> takes_none;
  };

  explicit StallWatch(Host host);
  ~StallWatch();

  // ---- For the publisher's thread

  // It begins with the next thing.
  void beat(At at) {
    at_.store(at, std::memory_order_relaxed);
    beats_.fetch_add(1, std::memory_order_release);
  }
  // It begins with a request that may take long: "SPAWN of 'planner'".
  void beat(std::string request);
  // A state was published, or the run stands because a client paused it.
  void moved(Clock::time_point now);
  // It has nothing to do. why: the client or thing that it waits for; "" if no report is needed.
  void idle(Clock::time_point now, const std::function<std::string()>& why);

 private:
  void watch();
  void look(Clock::time_point now);
  std::string reason(At at);
  void say(const std::string& reason, Clock::time_point now);

  const Host host_;
  std::atomic<At> at_{At::rest};
  std::atomic<uint64_t> beats_{0};

  Clock::time_point moved_ = Clock::now();  // with the next: the publisher's thread
  bool told_ = false;

  Clock::time_point last_look_ = moved_, last_beat_ = moved_;  // to beat_missed_: the watch's
  uint64_t seen_beats_ = 0;
  bool beat_missed_ = false;

  std::mutex mutex_;  // of what follows
  std::condition_variable changed_;
  bool is_over_ = false;
  std::vector<std::string> to_tell_;
  std::string request_;
  std::string last_reason_;
  Clock::time_point last_told_;
  std::thread thread_;
};

}  // namespace ruedo::run
