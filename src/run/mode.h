// The mode in which a run advances: by itself (Live), by its clients' grants (Lockstep), or by a
// log (Repeating).
//
// The run asks its mode whether it may continue, passes it the published steps, and asks when to
// call it again. States, requests and messages are the same in all modes. The
// publisher's thread calls everything here; on_message() comes from any thread, never beside
// begin() or attend().
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "engine/channels.h"
#include "engine/command_inbox.h"
#include "engine/outcome.h"
#include "ruedo/request_t.hpp"
#include "run/gate.h"
#include "run/requests/sessions.h"
#include "run/sink.h"
#include "run/tick.h"

namespace ruedo::run {

class Mode {
 public:
  using Time = std::chrono::steady_clock::time_point;

  // The world that runs; valid until begin() names another.
  struct Stage {
    engine::CommandInbox* inbox = nullptr;
    Gate* gate = nullptr;
    const engine::Channels* channels = nullptr;
    SimTime base_us = 0;  // the stamp of sim time 0
    std::function<std::string(RobotIndex robot)> robot_name;
    // Why that command can never act; "": it can.
    std::function<std::string(const robot::Command&)> check_possible = [](const robot::Command&) {
      return std::string();
    };
  };
  // The tasks of the run before it continues.
  struct Turn {
    enum class What { nothing, execute, change_mode, end };
    What what = What::nothing;
    request_t request{};  // to execute
  };
  struct Attended {
    Time next = Time::max();       // when to call attend() again, at the latest
    std::vector<int64_t> dropped;  // sessions that have ended
  };

  virtual ~Mode() = default;

  // ---- May it go on?

  // The run continues from the state `step` of that world; -1: from the start. Throws InputError.
  virtual void begin(const Stage& stage, int64_t step) = 0;
  // Models have come or gone at the state `step` of the world that runs.
  virtual void models_changed(const Stage& stage, int64_t step) {
    static_cast<void>(stage), static_cast<void>(step);
  }
  // False while a reader must catch up with published messages: no batch is taken.
  virtual bool has_room() const { return true; }
  // Clients say how far it goes: every step has its tick, and the publisher computes a few steps
  // itself.
  virtual bool takes_grants() const { return false; }
  // Which client has to do what before the state after `step` can be computed; "": none.
  virtual std::string waits_for(int64_t step) const {
    static_cast<void>(step);
    return "";
  }
  // The last state that was granted; -1: none was.
  virtual int64_t granted() const { return -1; }
  // Whether the first state comes by itself.
  virtual bool state_comes() const { return true; }

  // ---- Published steps

  // All states up to this one, with their ticks.
  virtual void published(int64_t step) { static_cast<void>(step); }
  // Call it until there is nothing to do. Throws InputError.
  virtual Turn turn(int64_t step) {
    static_cast<void>(step);
    return {};
  }
  // The outcome of the last turn's request. Throws InputError.
  virtual void executed(const engine::Outcome& outcome) { static_cast<void>(outcome); }
  // The last request of each client, for the tick of that step.
  virtual void add_applied(TickWriter& tick, int64_t step, const std::vector<Session>& sessions) {
    static_cast<void>(step);
    for (const Session& session : sessions) tick.add_applied(session.client, session.last_sequence);
  }
  // A sink that sees what is published; null: none is needed.
  virtual Sink* sink() { return nullptr; }

  // ---- When next?

  // Does what depends on real time.
  virtual Attended attend(const std::vector<Session>& sessions, int64_t step, Time now) {
    static_cast<void>(sessions), static_cast<void>(step), static_cast<void>(now);
    return {};
  }
  // No more states will come. finished(): no client waits for anything.
  virtual void end() {}
  virtual bool finished(const std::vector<Session>& sessions, Time now) const {
    static_cast<void>(sessions), static_cast<void>(now);
    return true;
  }

  // ---- Clients

  // A command as it came; true: the mode has handled it.
  virtual bool on_message(const std::string& channel, const uint8_t* data, size_t size) {
    static_cast<void>(channel), static_cast<void>(data), static_cast<void>(size);
    return false;
  }
  // Why a request of that kind is refused now; "": it is not. looks: it changes nothing.
  virtual std::string refusal(int32_t kind, bool looks) const {
    static_cast<void>(kind), static_cast<void>(looks);
    return "";
  }
  // GRANT and RESEND, where it takes grants.
  virtual engine::Outcome grant(const request_t& request, const Session& session) {
    static_cast<void>(session);
    return engine::Outcome::refuse(reply_t::NOT_SUPPORTED, "kind " + std::to_string(request.kind) +
                                                               " is for runs in lockstep");
  }
  // A grant that has to wait for one before it, or for room: it is ignored until it is repeated.
  virtual bool early(const request_t& request, const Session& session) const {
    static_cast<void>(request), static_cast<void>(session);
    return false;
  }
  virtual void left(int64_t session) { static_cast<void>(session); }
  // The place of this session may not be given away.
  virtual bool keeps(int64_t session) const {
    static_cast<void>(session);
    return false;
  }
};

}  // namespace ruedo::run
