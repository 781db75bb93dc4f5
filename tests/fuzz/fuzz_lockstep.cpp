// Conversations in lockstep: the input says which of four clients sends which request with which
// numbers. However the other three behave, the run never goes beyond what the first has granted,
// nor farther ahead than allowed; and once they have left, the first gets what it grants.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include <spdlog/spdlog.h>

#include "budget.h"
#include "engine/faults/faults.h"
#include "ruedo/decode.h"
#include "ruedo/grant_reply_t.hpp"
#include "ruedo/grant_request_t.hpp"
#include "ruedo/join_t.hpp"
#include "ruedo/resend_reply_t.hpp"
#include "ruedo/resend_request_t.hpp"
#include "ruedo/velocity_command_t.hpp"
#include "run/lockstep/lockstep.h"
#include "run/requests/control.h"
#include "run/requests/request_table.h"

// Without a world: functions that act on one are never called.
namespace ruedo::engine {
world::Fault fault_of(const fault_t&) { return {}; }
void Faults::begin(const world::Fault&, RobotIndex, int64_t) { std::abort(); }
void Faults::command(const robot::Command&, size_t, int64_t, robot::Robots&) { std::abort(); }
}  // namespace ruedo::engine

namespace ruedo::run {

// As in the run's own table: a STEP and a GET_STATE wait for the first state, a grant does not.
const RequestKind* find_request_kind(int32_t kind) {
  static constexpr RequestKind kWaits{
      "", 0, RequestKind::nothing, RequestKind::steers, RequestKind::for_state, nullptr},
      kWaitsNot{"",     0, RequestKind::nothing, RequestKind::steers, RequestKind::for_nothing,
                nullptr};
  const bool waits_not = kind == request_t::GRANT || kind == request_t::RESEND ||
                         kind == request_t::INFO || kind == request_t::QUIT;
  return waits_not ? &kWaitsNot : &kWaits;
}

namespace {

constexpr int kClients = 4;
constexpr int64_t kStep_us = 5000, kRunId = 7, kLongestGrant = 200;

[[noreturn]] void fail(const char* what) {
  std::fprintf(stderr, "lockstep: %s\n", what);
  std::abort();
}

class FakeGate : public Gate {
 public:
  void set_limit(int64_t step) override {
    if (step < limit) fail("the limit went back");
    limit = step;
  }
  void set_limit_quietly(int64_t step) override { set_limit(step); }
  bool paused() const override { return is_paused; }
  int64_t limit = -1;
  bool is_paused = false;
};

// The input, decoded; zeros after its end.
class Choices {
 public:
  Choices(const uint8_t* data, size_t size) : data_(data), end_(data + size) {}
  bool any() const { return data_ < end_; }
  uint8_t byte() { return any() ? *data_++ : uint8_t{0}; }
  // Mostly near `usual`; sometimes any number.
  int64_t number(int64_t usual) {
    const uint8_t kind = byte();
    if (kind < 160) return usual;
    if (kind < 240) return usual + kind - 200;
    uint64_t any = 0;
    for (int i = 0; i < 8; ++i) any = any << 8 | byte();
    return static_cast<int64_t>(any);
  }

 private:
  const uint8_t *data_, *end_;
};

// The run around its mode and its control, without a world.
class Conversation {
 public:
  explicit Conversation(uint8_t policy)
      : lockstep_(
            {1, 10.0, policy & 1 ? LockstepOptions::Policy::drop : LockstepOptions::Policy::pause},
            [](const applied_t&) {}),
        control_(kRunId, host()) {
    lockstep_.begin({&inbox_, &gate_, &channels_, 0, [](RobotIndex) { return std::string("r"); }},
                    -1);
    join(0);
    good_grants(-1, -1);
    if (told_ != 0) fail("the first client's grants do not stand at 0");
  }

  void turn(Choices& choices) {
    const int client = 1 + choices.byte() % (kClients - 1);
    switch (choices.byte() % 8) {
      case 0: join(client); break;
      case 1: grant(client, choices); break;
      case 2: resend(client, choices); break;
      case 3: plain(client, request_t::LEAVE, choices); break;
      case 4: plain(client, choices.byte(), choices); break;
      case 5: raw(choices); break;
      case 6: attend(choices.byte() % 30); break;
      default: good_steps(1 + choices.byte() % kLongestGrant); break;
    }
    pump();
  }

  void end() {
    for (const int64_t id : others_) {
      ids_[1] = id;
      send(request_t::LEAVE, 1, next(1), {});
    }
    attend(0);
    gate_.is_paused = false;
    for (int i = 0; i < 6; ++i) good_receives();  // more may be granted than is kept at once
    good_steps(5);
    if (published_ != granted_) fail("the good client does not get what it granted");
  }

 private:
  Control::Host host() {
    Control::Host host;
    host.execute = [this](const request_t& request, const Session& session) {
      return execute(request, session);
    };
    host.state = [] { return std::vector<uint8_t>(); };
    host.publish = [this](const reply_t& reply) { hear(reply); };
    host.utime = [this] { return published_ * kStep_us; };
    host.epoch = [] { return 0; };
    host.state_comes = [this] { return published_ < 0 && lockstep_.state_comes(); };
    host.early = [this](const request_t& request, const Session& session) {
      return lockstep_.early(request, session);
    };
    host.left = [this](int64_t session) { lockstep_.left(session); };
    host.keeps = [this](int64_t session) { return lockstep_.keeps(session); };
    return host;
  }

  engine::Outcome execute(const request_t& request, const Session& session) {
    if (std::string refusal = lockstep_.refusal(request.kind, false); !refusal.empty())
      return engine::Outcome::refuse(reply_t::REFUSED, refusal);
    switch (request.kind) {
      case request_t::GRANT:
      case request_t::RESEND: return lockstep_.grant(request, session);
      case request_t::PAUSE: gate_.is_paused = true; return engine::Outcome::after(published_);
      case request_t::RESUME: gate_.is_paused = false; return {};
      case request_t::STEP: return engine::Outcome::after(published_ + 1);
      default: return engine::Outcome::refuse(reply_t::NOT_SUPPORTED, "not in this test");
    }
  }

  void hear(const reply_t& reply) {
    if (reply.kind == request_t::JOIN && reply.code == reply_t::OK) joined_ = reply.session;
    if (reply.kind == request_t::RESEND && reply.body.size() > 60'000)
      fail("the reply to a RESEND is more than one datagram");
    if (reply.session != ids_[0] || ids_[0] == 0) return;
    last_code_ = reply.code;
    last_text_ = reply.text;
    if (reply.kind == request_t::GRANT && reply.code == reply_t::OK) {
      grant_reply_t body;
      if (decode_checked(reply.body.data(), reply.body.size(), body) != DecodeFault::none)
        fail("the reply to a GRANT cannot be read");
      told_ = body.granted;
    }
  }

  int64_t next(int client) { return ++sequences_[client]; }

  void send(int32_t kind, int client, int64_t sequence, std::vector<uint8_t> body) {
    request_t request{};
    request.run_id = kRunId;
    request.session = ids_[client];
    request.sequence = sequence;
    request.kind = kind;
    request.epoch = -1;
    request.body = std::move(body);
    request.size = static_cast<int32_t>(request.body.size());
    const std::vector<uint8_t> bytes = engine::encoded(request);
    control_.on_request(bytes.data(), bytes.size());
    control_.serve();
  }

  void join(int client) {
    join_t body{};
    body.client =
        client == 0 || client == 3 ? "good" : std::string(1, static_cast<char>('a' + client));
    request_t request{};
    request.kind = request_t::JOIN;
    request.run_id = kRunId;
    request.epoch = -1;
    request.sequence = 1'000'000 * (client + 1) + ++joins_;  // random, except in a test
    request.body = engine::encoded(body);
    request.size = static_cast<int32_t>(request.body.size());
    const std::vector<uint8_t> bytes = engine::encoded(request);
    joined_ = 0;
    control_.on_request(bytes.data(), bytes.size());
    control_.serve();
    if (joined_ == 0) return;
    ids_[client] = joined_;
    if (client != 0) others_.push_back(joined_);
    sequences_[client] = 0;
  }

  static grant_request_t granting(int64_t from, int64_t until, int64_t received) {
    grant_request_t body{};
    body.granted = from;
    body.step_until = until;
    body.received = received;
    return body;
  }

  // The first client, which behaves correctly.
  void good_grants(int64_t from, int64_t until) {
    last_code_ = reply_t::OK;  // a grant that is accepted at once has no reply
    send(request_t::GRANT, 0, next(0), engine::encoded(granting(from, until, published_)));
    if (last_code_ != reply_t::OK) fail(("a good grant is refused: " + last_text_).c_str());
  }
  void good_steps(int64_t steps) {
    // A pause delays it, and so does a client that has granted less: then its grants wait.
    if (granted_ - published_ > kLongestGrant) return;
    good_grants(granted_, granted_ + steps);
    granted_ += steps;
    pump();
    good_receives();
  }
  void good_receives() {
    resend_request_t body{};
    body.received = published_;
    send(request_t::RESEND, 0, next(0), engine::encoded(body));
    pump();
  }

  void grant(int client, Choices& choices) {
    const int64_t from = choices.number(choices.byte() & 1 ? -1 : std::max<int64_t>(published_, 0));
    grant_request_t body = granting(from, choices.number(from + 3), choices.number(published_));
    velocity_command_t velocity{};
    for (int n = choices.byte() % 4; n > 0; --n) {
      grant_command_t& command = body.commands.emplace_back();
      command.step = choices.number(from);
      command.channel = choices.byte() & 1 ? "r/velocity" : "nobody/velocity";
      velocity.vx = static_cast<double>(choices.number(1));
      command.data = engine::encoded(velocity);
      if (choices.byte() > 250) command.data.pop_back();
      command.size = static_cast<int32_t>(command.data.size());
    }
    body.ncommands = static_cast<int32_t>(body.commands.size());
    send(request_t::GRANT, client, choices.number(next(client)), engine::encoded(body));
  }

  void resend(int client, Choices& choices) {
    resend_request_t body{};
    body.received = choices.number(published_ - 2);
    for (int n = choices.byte(); n > 0; --n) {
      resend_wanted_t& wanted = body.wanted.emplace_back();
      wanted.step = choices.number(published_);
      wanted.channel_index = static_cast<int32_t>(choices.number(0));
      wanted.sequence = choices.number(published_);
      wanted.offset = static_cast<int32_t>(choices.number(0));
    }
    body.nwanted = static_cast<int32_t>(body.wanted.size());
    send(request_t::RESEND, client, choices.number(1), engine::encoded(body));
  }

  void plain(int client, int32_t kind, Choices& choices) {
    send(kind, client, choices.number(next(client)), {});
  }

  void raw(Choices& choices) {
    std::vector<uint8_t> bytes(choices.byte());
    for (uint8_t& byte : bytes) byte = choices.byte();
    control_.on_request(bytes.data(), bytes.size());
    control_.serve();
  }

  // Some seconds pass; a client that was silent for ten has lost its lease. The first one is heard.
  void attend(int seconds) {
    std::vector<Session> sessions = control_.sessions().list();
    const auto now = std::chrono::steady_clock::now() + std::chrono::seconds(clock_s_ += seconds);
    for (Session& session : sessions) {
      if (session.id == ids_[0]) session.last_heard = now;
    }
    for (const int64_t id : lockstep_.attend(sessions, published_, now).dropped) control_.drop(id);
  }

  // Computes and publishes what is granted.
  void pump() {
    while (published_ < gate_.limit && !gate_.is_paused && lockstep_.has_room()) {
      if (gate_.limit > granted_) fail("it goes beyond what the first client granted");
      if (gate_.limit > std::max<int64_t>(published_, 0) + Lockstep::kMostAhead)
        fail("it goes too far ahead");
      const int64_t step = published_ + 1;
      inbox_.clear();  // as if they had acted
      const std::vector<uint8_t> sample(step % 4 == 0 ? 5000 : 300);
      lockstep_.sink()->begin_step({step, step * kStep_us, 0});
      lockstep_.sink()->message({Kind::sample, step * kStep_us, step * kStep_us, channel_,
                                 engine::ChannelIndex(0), step, sample.data(), sample.size()});
      TickWriter tick;
      tick.begin(step * kStep_us, kRunId, 0, step);
      lockstep_.add_applied(tick, step, control_.sessions().list());
      published_ = step;
      lockstep_.published(step);
      control_.published(step);
      control_.serve();
    }
  }

  FakeGate gate_;
  engine::Channels channels_;
  engine::CommandInbox inbox_{{{"r/velocity", RobotIndex(0), engine::Input::Kind::velocity}}, 1};
  Lockstep lockstep_;
  Control control_;
  const std::string channel_ = "r/odometry";
  int64_t published_ = -1, granted_ = 0, told_ = -1, joined_ = 0;
  int64_t ids_[kClients] = {}, sequences_[kClients] = {};
  int32_t last_code_ = reply_t::OK;
  std::vector<int64_t> others_;  // sessions of the other clients
  std::string last_text_;
  int clock_s_ = 0, joins_ = 0;
};

}  // namespace
}  // namespace ruedo::run

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const bool quiet = (spdlog::set_level(spdlog::level::off), true);
  static_cast<void>(quiet);
  const Budget budget;
  ruedo::run::Choices choices(data, size);
  ruedo::run::Conversation conversation(choices.byte());
  while (choices.any()) conversation.turn(choices);
  conversation.end();
  return 0;
}
