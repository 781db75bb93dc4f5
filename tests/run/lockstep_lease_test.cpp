// Lockstep's leases, and invalid grants.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "engine/world_state.h"
#include "lockstep_client.h"
#include "log/reader.h"
#include "ruedo/applied_t.hpp"
#include "ruedo/velocity_command_t.hpp"
#include "ruedo/wheel_command_t.hpp"
#include "witness.h"

namespace ruedo::run {
namespace {

using Policy = LockstepOptions::Policy;

std::vector<uint8_t> velocity(double vx, double vy = 0.0) {
  velocity_command_t command;
  command.utime = 0;
  command.vx = vx;
  command.vy = vy;
  command.omega = 0.0;
  return engine::encoded(command);
}

std::vector<uint8_t> wheels(double rate) {
  wheel_command_t command;
  command.utime = 0;
  command.rate = {0.0, rate};
  command.n = 2;
  return engine::encoded(command);
}

class LockstepTest : public testing::Test {
 protected:
  ~LockstepTest() override { end(); }

  void begin(int clients, Policy policy, double lease_s, const std::string& record = "") {
    over_ = false;
    RunOptions options = fast(1e6);
    options.lockstep = {clients, lease_s, policy};
    options.record = record;
    server_ = std::make_unique<run::Run>(load_text(robot_sdf("r", 0, 0)), options, bus_);
    thread_ = std::thread([this] {
      try {
        server_->run();
      } catch (const LeaseEnded& ended) {
        why_ = ended.what();
      }
      over_ = true;
    });
  }
  void end() {
    if (server_) server_->stop();
    if (thread_.joinable()) thread_.join();
    server_.reset();
  }
  LockstepClient client(const std::string& name) {
    return {bus_, server_->channels(), name, &over_};
  }

  // A client's thread that does not run for longer than its lease loses it before the test intends
  // it, and throws. If all of the machine stood still, the test restarts with a longer one.
  void with_leases(int clients, Policy policy, double lease_s,
                   const std::function<void(double)>& test) {
    for (;; lease_s *= 4.0) {
      const Witness witness;
      begin(clients, policy, lease_s);
      try {
        return test(lease_s);
      } catch (const std::runtime_error& error) {
        if (!witness.excuses("lockstep_lease_test")) throw;
        ASSERT_LT(lease_s, 60.0) << error.what();
      }
      end();
    }
  }

  // A client's steps in a thread of their own; what goes wrong there is thrown by join().
  class Stepping {
   public:
    Stepping(LockstepTest& test, LockstepClient& client, int64_t steps)
        : test_(test), thread_([this, &client, steps] {
            try {
              client.step(steps);
            } catch (const std::runtime_error& error) {
              wrong_ = error.what();
              test_.over_ = true;  // no client waits for these steps
            }
          }) {}
    ~Stepping() {
      if (!thread_.joinable()) return;
      test_.server_->stop();
      thread_.join();
    }
    void join() {
      thread_.join();
      if (!wrong_.empty()) throw std::runtime_error(wrong_);
    }

   private:
    LockstepTest& test_;
    std::string wrong_;
    std::thread thread_;  // begins last
  };

  // The newest state, as the server answers a client that has received that much.
  static int64_t newest(LockstepClient& client, int64_t received) {
    resend_request_t body;
    body.received = received;
    body.nwanted = 0;
    const reply_t reply = client.ask(request_t::RESEND, 99, engine::encoded(body));
    resend_reply_t resent;
    EXPECT_EQ(decode_checked(reply.body.data(), reply.body.size(), resent), DecodeFault::none)
        << reply.text;
    return resent.step;
  }

  LossyBus bus_{{}, 1};
  std::unique_ptr<run::Run> server_;
  std::thread thread_;
  std::string why_;
  std::atomic<bool> over_{false};
};

// Both join; then `a` steps on in a thread while `b` says nothing.
#define TWO_CLIENTS                                \
  LockstepClient a = client("a"), b = client("b"); \
  a.take_part();                                   \
  b.take_part();                                   \
  Stepping stepping(*this, a, 10);                 \
  b.step(3);

TEST_F(LockstepTest, PausesForASilentClientAndContinuesWithIt) {
  with_leases(2, Policy::pause, 0.3, [&](double) {
    TWO_CLIENTS
    // While the lease lasts no other client can use its name; after its end another one may, and
    // begins at its step.
    LockstepClient other = client("b");
    other.join();
    for (bool there = false; !there;) {
      try {
        other.begin();
        there = true;
      } catch (const std::runtime_error& refused) {
        ASSERT_NE(std::string(refused.what()).find("a client called 'b' takes part already"),
                  std::string::npos)
            << refused.what();
      }
    }
    EXPECT_EQ(newest(other, -1), 3);  // and no further
    other.step(7);
    stepping.join();
    EXPECT_EQ(a.have(), 10);
    EXPECT_EQ(other.have(), 10);
    // It gets everything that b has not acknowledged: all, or the messages after b requested a lost
    // one.
    const int64_t first = other.seen().begin()->first;
    EXPECT_LE(first, b.have() + 1);
    EXPECT_EQ(other.seen().size(), static_cast<size_t>(10 - first + 1));
    EXPECT_EQ(a.seen().at(10).state_hash, other.seen().at(10).state_hash);
  });
}

TEST_F(LockstepTest, DropsASilentClient) {
  with_leases(2, Policy::drop, 0.3, [&](double) {
    TWO_CLIENTS
    stepping.join();  // without b
    EXPECT_EQ(a.have(), 10);
    EXPECT_THROW(b.step(20), std::runtime_error);  // no such session
    b.take_part();                                 // again, from the run's current step
    EXPECT_EQ(b.have(), 10);
    Stepping again(*this, a, 2);
    b.step(2);
    again.join();
    EXPECT_EQ(a.seen().at(12).state_hash, b.seen().at(12).state_hash);
  });
}

// The server does not run while it answers, for longer than the lease: after it heard the client
// and before it checks the leases.
TEST_F(LockstepTest, BlamesNoClientWhileItsProcessIsStopped) {
  with_leases(1, Policy::fail, 1.1, [&](double lease_s) {
    LockstepClient a = client("a");
    a.take_part();
    a.step(2);
    bus_.hold_next(std::chrono::milliseconds(static_cast<int>(1000 * lease_s) + 400));
    EXPECT_EQ(newest(a, 2), 2);
    a.step(2);
    EXPECT_EQ(a.have(), 4);
    EXPECT_FALSE(over_) << why_;
  });
}

TEST_F(LockstepTest, FailsTheRun) {
  with_leases(1, Policy::fail, 0.3, [&](double lease_s) {
    LockstepClient a = client("a");
    a.take_part();
    a.step(5);
    thread_.join();
    const std::string said = fmt::format("nothing was heard from 'a' for {:g} s", lease_s);
    EXPECT_NE(why_.find(said), std::string::npos) << why_;
    EXPECT_NE(why_.find("step 5"), std::string::npos) << why_;
  });
}

TEST_F(LockstepTest, LeavingAndJoiningOnTheWayAreRecorded) {
  const TemporaryFile log("lockstep.lcm");
  begin(2, Policy::pause, 60.0, log.path());
  TWO_CLIENTS
  b.leave();
  stepping.join();
  EXPECT_EQ(a.have(), 10);
  LockstepClient c = client("c");
  c.take_part();
  EXPECT_EQ(c.have(), 10);
  end();
  std::vector<std::string> found;
  log::Reader reader(log.path());
  log::Event event;
  while (reader.next(event)) {
    applied_t applied;
    if (event.channel != "ruedo/applied" ||
        decode_checked(event.data.data(), event.data.size(), applied) != DecodeFault::none)
      continue;
    found.push_back((applied.kind == request_t::JOIN    ? "join "
                     : applied.kind == request_t::LEAVE ? "leave "
                                                        : "? ") +
                    applied.client + " " + std::to_string(applied.step));
  }
  EXPECT_EQ(found, (std::vector<std::string>{"join a 0", "join b 0", "leave b 3", "join c 10"}));
}

// A grant and its result: the code, 0 for success, -1 for no answer.
class HostileGrants : public LockstepTest {
 protected:
  int32_t code(const grant_request_t& grant) {
    const reply_t reply =
        client_->ask(request_t::GRANT, client_->next_sequence(), engine::encoded(grant));
    text_ = reply.text;
    return reply.code;
  }
  static grant_request_t grant(int64_t granted, int64_t until, int64_t received = -1) {
    grant_request_t grant;
    grant.granted = granted;
    grant.step_until = until;
    grant.received = received;
    grant.ncommands = 0;
    return grant;
  }
  static grant_request_t with(grant_request_t grant, int64_t step, const std::string& channel,
                              const std::vector<uint8_t>& bytes) {
    grant_command_t command;
    command.step = step;
    command.channel = channel;
    command.size = static_cast<int32_t>(bytes.size());
    command.data = bytes;
    grant.commands.push_back(command);
    grant.ncommands = static_cast<int32_t>(grant.commands.size());
    return grant;
  }
  void SetUp() override {
    begin(1, Policy::pause, 60.0);
    client_.emplace(bus_, server_->channels(), "hostile");
    client_->take_part();
    client_->step(4);
  }
  std::optional<LockstepClient> client_;
  std::string text_;
};

TEST_F(HostileGrants, AreRefusedWithAReason) {
  const std::vector<uint8_t> good = velocity(0.1);
  const struct {
    const char* what;
    grant_request_t grant;
    int32_t code;
    const char* text;
  } cases[] = {
      {"past", with(grant(4, 6), 3, "r/velocity", good), reply_t::BAD_REQUEST,
       "is for step 3; 4 to 5 is granted"},
      {"beyond", with(grant(4, 6), 6, "r/velocity", good), reply_t::BAD_REQUEST, "is for step 6"},
      {"least", with(grant(4, 6), INT64_MIN, "r/velocity", good), reply_t::BAD_REQUEST,
       "is for step"},
      {"channel", with(grant(4, 6), 4, "nobody/velocity", good), reply_t::BAD_REQUEST,
       "no robot takes commands"},
      {"output", with(grant(4, 6), 4, "r/pose", good), reply_t::BAD_REQUEST,
       "no robot takes commands"},
      {"no channel", with(grant(4, 6), 4, "", good), reply_t::BAD_REQUEST,
       "no robot takes commands"},
      {"bytes", with(grant(4, 6), 4, "r/velocity", {1, 2, 3}), reply_t::BAD_REQUEST, "too short"},
      {"type", with(grant(4, 6), 4, "r/wheels", good), reply_t::BAD_REQUEST, "fingerprint"},
      {"large", with(grant(4, 6), 4, "r/velocity", std::vector<uint8_t>(70'000)),
       reply_t::BAD_REQUEST, "larger than 64 kB"},
      {"backwards", grant(4, 3), reply_t::BAD_REQUEST, "below granted"},
      {"least until", grant(4, INT64_MIN), reply_t::BAD_REQUEST, "below granted"},
      {"again", grant(0, 4), reply_t::BAD_REQUEST, "granted the steps up to 4"},
      {"negative", grant(-2, 4), reply_t::BAD_REQUEST, "granted the steps up to 4"},
      {"farther than is allowed", grant(4, 5 + kMostSteps), reply_t::BAD_REQUEST,
       "at most 1000000000 steps"},
      {"most until", grant(4, INT64_MAX), reply_t::BAD_REQUEST, "at most 1000000000 steps"},
      {"no number", with(grant(4, 6), 4, "r/velocity", velocity(std::nan(""))),
       reply_t::BAD_REQUEST, "command 0 (r/velocity): a value is not finite"},
      {"infinite", with(grant(4, 6), 4, "r/velocity", velocity(-HUGE_VAL)), reply_t::BAD_REQUEST,
       "a value is not finite"},
      {"no number in the last",
       with(with(grant(4, 6), 4, "r/velocity", good), 5, "r/wheels", wheels(std::nan(""))),
       reply_t::BAD_REQUEST, "command 1 (r/wheels): a value is not finite"},
      {"sideways", with(grant(4, 6), 4, "r/velocity", velocity(0.1, 0.2)), reply_t::BAD_REQUEST,
       "command 0 (r/velocity): vy is 0.2 m/s, but r cannot move sideways"},
      {"received", grant(4, 5, 5), reply_t::BAD_REQUEST, "the newest state is 4"},
      {"most received", grant(4, 5, INT64_MAX), reply_t::BAD_REQUEST, "the newest state is 4"},
  };
  for (const auto& test : cases) {
    EXPECT_EQ(code(test.grant), test.code) << test.what;
    EXPECT_NE(text_.find(test.text), std::string::npos) << test.what << ": " << text_;
  }
  client_->step(2);  // nothing of it has done anything
  EXPECT_EQ(client_->have(), 6);
  const int64_t hash = client_->seen().at(6).state_hash;
  client_.reset();
  end();
  begin(1, Policy::pause, 60.0);
  client_.emplace(bus_, server_->channels(), "good");
  client_->take_part();
  client_->step(6);
  EXPECT_EQ(client_->seen().at(6).state_hash, hash);
}

TEST_F(HostileGrants, MoreCommandsThanAreHeldAreRefused) {
  grant_request_t many = grant(4, 2'000'000);
  for (size_t i = 0; i <= Lockstep::kMostHeld; ++i) many = with(std::move(many), 1'000'000, "", {});
  std::vector<uint8_t> bytes = engine::encoded(many);
  ASSERT_GT(bytes.size(), 1u << 19);
  EXPECT_EQ(code(many), reply_t::BAD_REQUEST);  // the first has no channel
  // 512 kB in each grant, all for a distant step: at the limit grants wait without an answer, and
  // the run continues.
  const std::vector<uint8_t> good = velocity(0.1);
  int taken = 0;
  int64_t granted = 4;
  for (; taken < 40; ++taken) {
    grant_request_t full = grant(granted, granted + 1'000'000);
    for (int i = 0; i < 4000; ++i)
      full = with(std::move(full), granted + 900'000, "r/velocity", good);
    const int64_t sequence = client_->next_sequence();
    client_->send(request_t::GRANT, sequence, engine::encoded(full));
    const reply_t stands =
        client_->ask(request_t::GRANT, client_->next_sequence(), engine::encoded(grant(-1, 0)));
    grant_reply_t reply;
    ASSERT_EQ(decode_checked(stands.body.data(), stands.body.size(), reply), DecodeFault::none);
    if (reply.granted == granted) break;
    granted = reply.granted;
  }
  EXPECT_EQ(taken, static_cast<int>(Lockstep::kMostHeld / 4000));
}

TEST_F(HostileGrants, WaitTheirTurn) {
  const int64_t first = client_->next_sequence(), second = client_->next_sequence();
  const std::vector<uint8_t> later = engine::encoded(grant(7, 9, 4));
  const auto granted = [&](const reply_t& reply) {
    grant_reply_t stands;
    EXPECT_EQ(decode_checked(reply.body.data(), reply.body.size(), stands), DecodeFault::none)
        << reply.text;
    return stands.granted;
  };
  client_->send(request_t::GRANT, second, later);  // ignored: the one before it was lost
  EXPECT_EQ(granted(client_->ask(request_t::GRANT, first, engine::encoded(grant(4, 7, 4)))), 7);
  EXPECT_EQ(granted(client_->ask(request_t::GRANT, first, engine::encoded(grant(4, 7, 4)))),
            7);  // executed once
  EXPECT_EQ(granted(client_->ask(request_t::GRANT, second, later)), 9);
  EXPECT_EQ(granted(client_->ask(request_t::GRANT, client_->next_sequence(),
                                 engine::encoded(grant(-1, 0)))),
            9);
}

TEST_F(HostileGrants, GrantingEverythingAdvancesToTheKeptMessages) {
  const auto asked = [&](int64_t received) { return newest(*client_, received); };
  client_->send(request_t::GRANT, client_->next_sequence(),
                engine::encoded(grant(4, 4 + kMostSteps, 4)));
  int64_t step = 0;
  do step = asked(4);
  while (step < 4 + static_cast<int64_t>(KeptMessages::kMostSteps));
  for (int i = 0; i < 50; ++i) EXPECT_EQ(asked(4), step);                    // full: it waits
  EXPECT_LT(step, 4 + static_cast<int64_t>(KeptMessages::kMostSteps) + 32);  // a batch more
  while (asked(step) < step + 100) {
  }  // what is received makes room
  resend_request_t body;
  body.received = 0;
  body.wanted.resize(2);
  body.wanted[0].step = INT64_MIN, body.wanted[0].channel_index = -1, body.wanted[0].sequence = 0,
  body.wanted[0].offset = -1;
  body.wanted[1].step = step + 1, body.wanted[1].channel_index = INT32_MAX,
  body.wanted[1].sequence = INT64_MAX, body.wanted[1].offset = INT32_MAX;
  body.nwanted = 2;
  EXPECT_EQ(client_->ask(request_t::RESEND, 100, engine::encoded(body)).code, reply_t::OK);
  body.wanted.resize(Lockstep::kMostWanted + 1, body.wanted[0]);
  body.nwanted = static_cast<int32_t>(body.wanted.size());
  EXPECT_EQ(client_->ask(request_t::RESEND, 101, engine::encoded(body)).code,
            reply_t::OK);  // the last one is not looked at
}

// If fragments are lost, LCM may reassemble a fragmented message wrongly.
TEST_F(HostileGrants, AReplyFitsIntoOneDatagram) {
  client_->send(request_t::GRANT, client_->next_sequence(), engine::encoded(grant(4, 5, 4)));
  while (newest(*client_, 4) < 5) {
  }
  const std::vector<engine::Channel>& channels = server_->channels().list();
  const auto tick = std::find_if(channels.begin(), channels.end(),
                                 [](const auto& channel) { return channel.type == "tick_t"; });
  resend_wanted_t small;
  small.step = 5;
  small.channel_index = static_cast<int32_t>(tick - channels.begin());
  small.sequence = small.offset = 0;
  resend_request_t body;
  body.received = 4;
  body.wanted.resize(Lockstep::kMostWanted, small);
  body.nwanted = static_cast<int32_t>(body.wanted.size());
  const reply_t reply = client_->ask(request_t::RESEND, 100, engine::encoded(body));
  ASSERT_EQ(reply.code, reply_t::OK);
  resend_reply_t resent;
  ASSERT_EQ(decode_checked(reply.body.data(), reply.body.size(), resent), DecodeFault::none);
  const size_t part = reply.body.size() / resent.parts.size();
  EXPECT_LE(reply.body.size(), engine::kMaxPartSize);
  EXPECT_GT(reply.body.size() + part, engine::kMaxPartSize);  // as many as go into it
}

}  // namespace
}  // namespace ruedo::run
