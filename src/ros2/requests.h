// A client of the run's requests: it joins when it has something to ask, and hands each answer to
// who asked.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "ruedo/reply_t.hpp"

namespace ruedo::ros2 {

class Requests {
 public:
  using Inject = std::function<void(const std::string& channel, std::span<const uint8_t> message)>;
  using Then = std::function<void(const reply_t& reply)>;

  static constexpr size_t kMostPending = 24;  // the run answers no more of a session at once

  explicit Requests(Inject inject) : inject_(std::move(inject)) {}

  // Where requests go; "": the run takes none.
  void listen(const std::string& channel);

  // Any thread. `then` is called once, in this thread (when nothing can be asked) or in that of
  // reply().
  void ask(int32_t kind, std::vector<uint8_t> body, Then then);

  // A message on ruedo/reply.
  void reply(std::span<const uint8_t> message);

 private:
  struct Asked {
    int32_t kind = 0;
    std::vector<uint8_t> body;
    Then then;
    bool again = false;  // after the session was lost
  };

  void join(std::unique_lock<std::mutex>& lock);
  void send(std::unique_lock<std::mutex>& lock, Asked asked);
  void joined(const reply_t& reply, std::unique_lock<std::mutex>& lock);

  Inject inject_;
  std::mutex mutex_;  // not held while something is injected or answered
  std::string channel_;
  int64_t session_ = 0, sequence_ = 0, join_sequence_ = 0;
  std::deque<Asked> waiting_;         // for the session
  std::map<int64_t, Asked> pending_;  // by sequence
};

}  // namespace ruedo::ros2
