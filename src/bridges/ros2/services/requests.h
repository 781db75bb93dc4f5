// A client of the run's requests: it joins at the first request, and hands each answer to its
// caller. A caller with many requests waits for its own answers, and delays no other.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "ruedo/reply_t.hpp"

namespace ruedo::ros2 {

class Requests {
 public:
  using Inject = std::function<void(const std::string& channel, std::span<const uint8_t> message)>;
  using Then = std::function<void(const reply_t& reply)>;
  using Clock = std::chrono::steady_clock;

  // Before its first state, and while it loads a world, the run keeps no more of a session.
  static constexpr size_t kMostPending = 8;
  static constexpr size_t kMostPendingOfOne = 4;
  static constexpr size_t kMostSteps = 4;  // STEPs, which may take for ever
  static constexpr size_t kMostWaitingOfOne = 32;
  static constexpr size_t kMostWaitingBytes = size_t{64} << 20;  // of all
  static constexpr auto kRepeat = std::chrono::seconds(1);       // what was not answered so long

  // inject: must not answer before it returns.
  explicit Requests(Inject inject) : inject_(std::move(inject)) {}

  // Where requests go; "": the run takes none.
  void listen(const std::string& channel);

  // Any thread. client: the caller. `then` is called once, in this thread (if it cannot be sent)
  // or in that of reply().
  void send(uint64_t client, int32_t kind, std::vector<uint8_t> body, Then then);

  // A message on ruedo/reply.
  void reply(std::span<const uint8_t> message);

  // Asks again for what was not answered: a run that has too much to do drops requests. To be
  // called every now and then.
  void repeat(Clock::time_point now);

 private:
  struct Asked {
    uint64_t client = 0;
    int32_t kind = 0;
    std::vector<uint8_t> body;
    Then then;
    bool again = false;  // after it or the session was lost
    Clock::time_point sent;
  };
  using Key = std::pair<int64_t, int64_t>;  // session and sequence

  // All under the mutex.
  void join();
  void pump();
  void inject(const Key& key, int32_t kind, const std::vector<uint8_t>& body);
  std::vector<Asked> joined(const reply_t& reply);

  Inject inject_;
  std::mutex mutex_;  // not held while something is answered
  std::string channel_;
  int64_t session_ = 0, sequence_ = 0, join_sequence_ = 0;
  Clock::time_point joined_at_;                    // when JOIN was sent
  std::map<uint64_t, std::deque<Asked>> waiting_;  // by client; none is empty
  uint64_t last_client_ = 0;                       // whose turn it was
  size_t waiting_bytes_ = 0;
  std::map<Key, Asked> pending_;
  std::map<uint64_t, size_t> pending_of_;  // how many, by client
  size_t steps_ = 0;                       // of them
};

}  // namespace ruedo::ros2
