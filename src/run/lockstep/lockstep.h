// Lockstep: the run goes as far as its clients have granted, with the commands that came with their
// grants.
//
// It keeps the participants and their grants, the commands for later steps, the messages that not
// all have received yet, and the leases. Its decisions go to the gate and the inbox.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "engine/command_inbox.h"
#include "ruedo/applied_t.hpp"
#include "ruedo/grant_request_t.hpp"
#include "run/lockstep/kept_messages.h"
#include "run/mode.h"
#include "run/requests/control.h"

namespace ruedo::run {

// A client fell silent, and the policy is that this fails the run.
class LeaseEnded : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct LockstepOptions {
  enum class Policy {
    pause,  // the run waits until the client is heard again, or another takes its place by its name
    drop,   // the run continues without it
    fail,   // the run ends with LeaseEnded
  };
  int clients = 0;        // that step 0 waits for; 0: no lockstep
  double lease_s = 10.0;  // of real time; a client that is silent for longer loses it
  Policy policy = Policy::pause;
};

class Lockstep : public Mode {
 public:
  static constexpr int64_t kMostAhead =
      128;  // steps from what is published to what may be computed
  static constexpr size_t kMostHeld =
      32'768;  // commands for steps to come, of all clients together
  static constexpr size_t kMostHeldBytes = 16u << 20;
  static constexpr size_t kMostWanted = 1024;  // entries of a RESEND that are looked at
  static constexpr size_t kMostGrants = 4096;  // of a client, for states that are not published yet

  // record: writes joins and ended leases into the log.
  Lockstep(const LockstepOptions& options, std::function<void(const applied_t&)> record);

  // Everyone's grants stand at `step`, or at 0.
  void begin(const Stage& stage, int64_t step) override;
  // Commands that were sent ahead for a robot go with it.
  void models_changed(const Stage& stage, int64_t step) override;
  // False when no more messages can be kept for clients that have not received them all.
  bool has_room() const override { return !kept_.full(); }
  bool takes_grants() const override { return true; }
  std::string waits_for(int64_t step) const override;
  int64_t granted() const override { return limit_; }
  bool state_comes() const override { return begun(); }

  void published(int64_t step) override;
  void add_applied(TickWriter& tick, int64_t step, const std::vector<Session>& sessions) override;
  Sink* sink() override { return &kept_; }

  // Ends leases by the policy. Throws LeaseEnded.
  Attended attend(const std::vector<Session>& sessions, int64_t step, Time now) override;
  void end() override { over_ = true; }
  bool finished(const std::vector<Session>& sessions,
                Time now) const override;  // all have everything, or say nothing more

  std::string refusal(int32_t kind, bool looks) const override;
  engine::Outcome grant(const request_t& request, const Session& session) override;
  bool early(const request_t& request, const Session& session) const override;
  void left(int64_t session) override;
  bool keeps(int64_t session) const override;  // it takes part and has its lease

 private:
  struct Held {  // a command for a step to come, or for one that is not published yet
    int64_t step;
    engine::InputIndex input;
    std::vector<uint8_t> bytes;
  };
  struct Grant {
    int64_t from, sequence;
  };
  struct Member {
    int64_t session;
    std::string name;
    int64_t granted = 0;    // states up to this one may be computed, as far as it is concerned
    int64_t received = -1;  // it has the messages of the states up to this one
    std::deque<Held> held;  // by step
    size_t scheduled = 0;   // the first of them, which the inbox has already
    size_t held_bytes = 0;
    std::deque<Grant> grants;  // the last one before what is published, and those after
    bool silent = false;       // its lease has ended, and the run waits
  };

  bool begun() const { return limit_ >= 0; }
  engine::Outcome resend(const request_t& request, const Session& session);
  std::vector<int64_t> check_leases(const std::vector<Session>& sessions, Time now);
  Member* find(int64_t session);
  const Member* find(int64_t session) const { return const_cast<Lockstep*>(this)->find(session); }
  engine::Outcome take_part(const Session& session);
  engine::Outcome stands(const Member& member) const;
  std::string fault_of(const grant_request_t& grant,
                       const Member& member) const;  // "": none; as the next two
  std::string fault_of(int64_t received, const Member& member) const;
  std::string take_commands(const grant_request_t& grant,
                            std::vector<Held>& held) const;  // what is wrong; "": nothing
  bool has_room(const Member& member, size_t count, size_t bytes) const;
  void advance();
  void schedule(int64_t until);
  void forget();
  void note(int32_t kind, const Member& member);  // a join or an end, into the log

  const LockstepOptions options_;
  const std::function<void(const applied_t&)> record_;
  engine::CommandInbox* inbox_ = nullptr;
  Gate* gate_ = nullptr;
  std::function<std::string(const robot::Command&)> check_possible_;
  std::vector<Member> members_;  // by name
  bool started_ = false;         // all were there once
  bool over_ = false;
  int64_t limit_ = -1;  // states up to this one may be computed
  int64_t published_ = -1;
  KeptMessages kept_;
  Time next_check_{};
};

}  // namespace ruedo::run
