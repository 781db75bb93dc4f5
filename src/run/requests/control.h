// Simulation control: requests in, each executed once, replies out.
//
// The bus's thread puts requests into a bounded inbox; the publisher executes them between batches.
// The server executes a request. This file checks the client's permission, and that no request is
// executed twice.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <vector>

#include "engine/outcome.h"
#include "ruedo/reply_t.hpp"
#include "ruedo/request_t.hpp"
#include "run/requests/sessions.h"

namespace ruedo::run {

// Most steps that one STEP or GRANT asks for.
inline constexpr int64_t kMostSteps = 1'000'000'000;

class Control {
 public:
  static constexpr size_t kMostWaiting =
      256;  // requests; further ones are dropped, and repeated by their clients
  static constexpr size_t kMostWaitingBytes = 16u << 20;
  static constexpr size_t kMaxRequestSize = 1 << 20;  // bytes
  static constexpr size_t kMostHeld = 8;  // requests of one session that wait for the first state
  static constexpr size_t kMostSteppings = 16;  // STEPs of one session that are not answered yet
  static constexpr size_t kMostUnanswered =
      32;  // requests of one session that are not answered yet

  // The run that it serves.
  struct Host {
    std::function<engine::Outcome(const request_t& request, const Session& session)> execute;
    // The body of an answer that waited for its step.
    std::function<std::vector<uint8_t>()> state;
    std::function<void(const reply_t& reply)> publish;
    std::function<int64_t()> utime;
    std::function<int32_t()> epoch;
    // True while there is no state, and one comes by itself: from the start, or a reset, until
    // state 0 was published.
    std::function<bool()> state_comes;
    // Lockstep's; may be empty. early: the request waits, unanswered, until it is repeated in its
    // turn. keeps: the place of this session may not be given away.
    std::function<bool(const request_t& request, const Session& session)> early = {};
    std::function<void(int64_t session)> left = {};
    std::function<bool(int64_t session)> keeps = {};
  };

  Control(int64_t run_id, Host host) : run_id_(run_id), host_(std::move(host)) {}

  // Any thread. False for what is not a request.
  bool on_request(const uint8_t* data, size_t size);

  // Executes the waiting requests; called often, by the publisher's thread. After seconds without a
  // call (a long request, a stopped process), no client is blamed for its silence.
  void serve();
  // Answers those that waited for a state up to `step`.
  void published(int64_t step);
  // Refuses all that wait, for a state that will not come or for what is made ready.
  void cancel(const std::string& why, int32_t code = reply_t::REFUSED);
  // Refuses those that wait for a state after `step`.
  void cancel_after(int64_t step, const std::string& why);
  // Of a request whose outcome was pending: false when it was refused meanwhile.
  bool is_pending(int64_t session, int64_t sequence) const;
  void finish(int64_t session, int64_t sequence, engine::Outcome outcome);

  const Sessions& sessions() const { return sessions_; }
  void drop(int64_t session);  // it leaves, and its requests are forgotten
  uint64_t refused() const { return refused_; }

 private:
  struct Waiting {
    reply_t reply;
    int64_t after_step;  // kPending: for finish()
  };
  static constexpr int64_t kPending = INT64_MAX;

  void serve(const request_t& request);
  void execute(const request_t& request, Session& session, reply_t& reply);
  Sessions::Verdict judge(const request_t& request, const Session& session, reply_t& reply);
  bool is_waiting(int64_t session, int64_t sequence) const;  // executed, and not answered yet
  bool must_wait(const request_t& request) const;
  void defer(const request_t& request);
  bool has_too_many(const request_t& request) const;
  template <class Condition>
  void refuse_waiting(const std::string& why, int32_t code, Condition condition);
  void forget_left();
  void join(const request_t& request, reply_t& reply);
  void answer(reply_t& reply, bool quiet = false);
  void publish(reply_t& reply);

  int64_t run_id_;
  Host host_;
  Sessions sessions_;
  std::vector<Waiting> waiting_;
  std::vector<request_t> held_;  // judged, and waiting for the first state
  std::mutex mutex_;             // of the next two
  std::vector<request_t> inbox_;
  size_t inbox_bytes_ = 0;
  std::vector<request_t> taken_;
  std::atomic<uint64_t> refused_{0};
};

}  // namespace ruedo::run
