// Lockstep: the run goes as far as its clients have granted, with the commands that came with their grants.
//
// Here is who takes part and how far each has granted, the commands for steps to come, the messages that not all
// have received yet, and the leases. The publisher's, all of it; what it decides goes to the pacer and the inbox.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "ruedo/applied_t.hpp"
#include "ruedo/grant_request_t.hpp"
#include "engine/command_inbox.h"
#include "run/control.h"
#include "run/kept_messages.h"
#include "run/pacer.h"
#include "run/tick.h"

namespace ruedo::run {

// A client fell silent, and the policy is that this fails the run.
class LeaseEnded : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct LockstepOptions {
  enum class Policy {
    pause,    // the run waits until the client is heard again, or another takes its place by its name
    drop,     // the run goes on without it
    fail,     // the run ends with LeaseEnded
  };
  int clients = 0;         // that step 0 waits for; 0: no lockstep
  double lease_s = 10.0;   // of real time: who is silent for longer has lost it
  Policy policy = Policy::pause;
};

class Lockstep {
 public:
  using Time = std::chrono::steady_clock::time_point;
  static constexpr int64_t kMostAhead = 128;             // steps from what is published to what may be computed
  static constexpr size_t kMostHeld = 32'768;            // commands for steps to come, of all clients together
  static constexpr size_t kMostHeldBytes = 16u << 20;
  static constexpr size_t kMostWanted = 1024;            // entries of a RESEND that are looked at
  static constexpr size_t kMostGrants = 4096;            // of a client, for states that are not published yet

  // record: writes into the log.
  Lockstep(const LockstepOptions& options, std::function<void(const applied_t&)> record);

  // Where commands go and what is paced, for a simulation that was made anew.
  void attach(engine::CommandInbox& inbox, Pacer& pacer);
  // The world was reset: everyone's grants stand at 0 again.
  void restart();
  // The run goes on from a snapshot: everyone's grants stand at its step. Before anyone takes part.
  void begin_at(int64_t step);

  // GRANT and RESEND.
  engine::Outcome grant(const request_t& request, const Session& session);
  engine::Outcome resend(const request_t& request, const Session& session);
  // True for a grant that has to wait for one before it, or for room: it is ignored until it is repeated.
  bool early(const request_t& request, const Session& session) const;

  // A sink: what clients may have lost.
  KeptMessages& kept() { return kept_; }
  void add_applied(TickWriter& tick, int64_t step, const std::vector<Session>& sessions);
  void published(int64_t step);    // its tick is out, too
  // True when the messages that not everybody has received are as many as are kept: publish no more.
  bool full() const { return kept_.full(); }

  // Ends leases by the policy; returns the clients that were dropped. Throws LeaseEnded.
  std::vector<int64_t> check_leases(const std::vector<Session>& sessions, Time now);
  void leave(int64_t session);
  // When check_leases() wants to be called next.
  Time next_check() const { return next_check_; }

  // The run has ended: true when all have everything, or say nothing more.
  bool drained(const std::vector<Session>& sessions, Time now) const;
  void end() { over_ = true; }
  std::string waits_for() const;    // in words; "": for nobody
  bool begun() const { return limit_ >= 0; }
  int64_t limit() const { return limit_; }    // the last state that may be computed; -1 before it has begun
  // True for a client that takes part and has its lease.
  bool counts_on(int64_t session) const;

 private:
  struct Held {    // a command for a step to come, or for one that is not published yet
    int64_t step;
    int input;
    std::vector<uint8_t> bytes;
  };
  struct Grant { int64_t from, sequence; };
  struct Member {
    int64_t session;
    std::string name;
    int64_t granted = 0;       // states up to this one may be computed, as far as it is concerned
    int64_t received = -1;     // it has the messages of the states up to this one
    std::deque<Held> held;     // by step
    size_t scheduled = 0;      // the first of them, which the inbox has already
    size_t held_bytes = 0;
    std::deque<Grant> grants;  // the last one before what is published, and those after
    bool silent = false;       // its lease has ended, and the run waits
  };

  Member* find(int64_t session);
  const Member* find(int64_t session) const { return const_cast<Lockstep*>(this)->find(session); }
  engine::Outcome take_part(const Session& session);
  engine::Outcome stands(const Member& member) const;
  std::string fault_of(const grant_request_t& grant, const Member& member) const;    // "": none; as the next
  std::string take_commands(const grant_request_t& grant, std::vector<Held>& held) const;    // what is wrong; "": nothing
  bool has_room(const Member& member, size_t count, size_t bytes) const;
  void advance();
  void schedule(int64_t until);
  void forget();
  void note(int32_t kind, const Member& member);    // a join or an end, into the log

  const LockstepOptions options_;
  const std::function<void(const applied_t&)> record_;
  engine::CommandInbox* inbox_ = nullptr;
  Pacer* pacer_ = nullptr;
  std::vector<Member> members_;    // by name
  bool started_ = false;           // all were there once
  bool over_ = false;
  int64_t limit_ = -1;             // states up to this one may be computed
  int64_t published_ = -1;
  KeptMessages kept_;
  Time next_check_{};
};

}  // namespace ruedo::run
