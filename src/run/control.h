// Simulation control: requests in, each executed once, replies out.
//
// The bus's thread puts requests into a bounded inbox; the publisher executes them between batches. What a
// request does is the server's; who may ask, and that nothing is done twice, is seen to here.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <vector>

#include "engine/outcome.h"
#include "ruedo/reply_t.hpp"
#include "ruedo/request_t.hpp"
#include "run/sessions.h"

namespace ruedo::run {

class Control {
 public:
  static constexpr size_t kMostWaiting = 256;             // requests; more are dropped, their clients repeat them
  static constexpr size_t kMaxRequestSize = 1 << 20;      // bytes

  struct Server {
    std::function<engine::Outcome(const request_t& request, const Session& session)> execute;
    // The body of an answer that waited for its step.
    std::function<std::vector<uint8_t>()> state;
    std::function<void(const reply_t& reply)> publish;
    std::function<int64_t()> utime;
    std::function<int32_t()> epoch;
    std::function<bool()> has_state;    // false from the start, or a reset, until state 0 was published
    // Lockstep's; may be empty. early: the request waits, unanswered, until it is repeated in its turn.
    std::function<bool(const request_t& request, const Session& session)> early = {};
    std::function<void(int64_t session)> left = {};
  };

  Control(int64_t run_id, Server server) : run_id_(run_id), server_(std::move(server)) {}

  // Any thread. False for what is not a request.
  bool receive(const uint8_t* data, size_t size);

  // The publisher's: executes what waits.
  void serve();
  // Answers those that waited for a state up to `step`.
  void published(int64_t step);
  // Refuses all that wait for a state, which will not come.
  void cancel(const std::string& why);

  const Sessions& sessions() const { return sessions_; }
  void drop(int64_t session) { sessions_.leave(session); }
  uint64_t refused() const { return refused_; }

 private:
  struct Waiting {
    reply_t reply;
    int64_t after_step;
  };

  bool serve_taken();                  // false when some have to wait for a state
  void serve(const request_t& request);
  void join(const request_t& request, reply_t& reply);
  void answer(reply_t& reply, bool quiet = false);

  int64_t run_id_;
  Server server_;
  Sessions sessions_;
  std::vector<Waiting> waiting_;
  std::mutex mutex_;
  std::vector<request_t> inbox_, taken_;
  std::atomic<uint64_t> refused_{0};
};

}  // namespace ruedo::run
