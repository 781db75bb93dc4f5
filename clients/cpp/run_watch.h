// Which run a client belongs to, where those of several servers are heard.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <utility>

namespace ruedo::client {

// A client stays with its run for as long as that is heard: what else is heard meanwhile is another
// server, at the same address. Only when nothing more comes of its own run has the other one taken
// its place. Until it shows which, samples may be of either run. For the receiving thread alone,
// but for another().
class RunWatch {
 public:
  // `say` is called once for each run of the client, with the id of a run beside it.
  explicit RunWatch(std::function<void(int64_t)> say) : say_(std::move(say)) {}

  // The client has a new run.
  void begin() {
    another_ = false;
    returns_ = 0;
  }

  void hear_own() {
    if (!another_) return;
    another_ = false;
    if (++returns_ == kReturns) say_(other_id_);
  }

  // Whether the client's own run is over.
  bool hear_another(int64_t run_id) {
    const auto now = std::chrono::steady_clock::now();
    if (!another_) {
      since_ = now;
      other_id_ = run_id;
      another_ = true;
    }
    return now - since_ >= kGone;
  }

  // The other run may be the next one of this client's.
  bool in_doubt() const { return another_ && returns_ < kReturns; }

  // The last message was of another run. From any thread.
  bool another() const { return another_; }

 private:
  static constexpr std::chrono::milliseconds kGone{1500};  // a server gives a sign each second
  static constexpr int kReturns = 3;                       // one may be a datagram that was late

  const std::function<void(int64_t)> say_;
  std::atomic<bool> another_{false};
  std::chrono::steady_clock::time_point since_;  // when the first of them was heard
  int64_t other_id_ = 0;
  int returns_ = 0;
};

}  // namespace ruedo::client
