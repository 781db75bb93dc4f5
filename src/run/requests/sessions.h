// The clients that have joined, and which of their requests were executed: each request once,
// however often it is repeated.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "ruedo/reply_t.hpp"

namespace ruedo::run {

struct Session {
  int64_t id = 0;  // random
  std::string client;
  int64_t join_sequence = 0;    // the client's own random number
  int64_t last_sequence = 0;    // executed, or being executed
  std::deque<reply_t> replies;  // the last ones, oldest first
  std::chrono::steady_clock::time_point last_heard;
  bool spoke = false;  // has sent a request since it joined
};

// Not thread safe.
class Sessions {
 public:
  using Time = std::chrono::steady_clock::time_point;
  static constexpr size_t kMostSessions = 64;
  static constexpr size_t kKeptReplies = 32;
  static constexpr auto kMaySilence = std::chrono::seconds(3);  // then its place may go to another
  static constexpr int64_t kMostJump = 1024;                    // of sequences that count up

  // The decision about a request of a session. too_far: one forged message must not end a
  // session for good.
  enum class Verdict { execute, answer_again, wait, too_old, too_far };

  Session* find(int64_t id);
  // The session of a client that joins, the same one for a repeated JOIN. When all places are
  // occupied, it replaces the most silent session, first of those that have only joined; but none
  // that `keeps`, if given, protects. Null without a place.
  Session* join(const std::string& client, int64_t sequence,
                const std::function<bool(int64_t)>& keeps = {});
  // The session was heard, with a request that was taken in at `listened`.
  void hear(Session& session) const { session.last_heard = listened_; }
  void leave(int64_t id);
  // Requests are read now. If that is long after the last time, the process could not listen
  // (stopped by a signal, busy with a request, without a processor): no client was silent then.
  void listen(Time now);
  // When requests were last taken in. A client's silence ends here, not at the clock's time: the
  // process may have been stopped since.
  Time listened() const { return listened_; }

  // answer_again: `reply` is the one to send.
  Verdict judge(const Session& session, int64_t sequence, const reply_t*& reply) const;
  void begin(Session& session, int64_t sequence) { session.last_sequence = sequence; }
  void keep(const reply_t& reply);  // by its session; nothing when that has left

  const std::vector<Session>& list() const { return sessions_; }

 private:
  std::vector<Session> sessions_;
  Time listened_ = std::chrono::steady_clock::now();
};

// A random number in [1, 2^63), from the operating system.
int64_t random_id();

}  // namespace ruedo::run
