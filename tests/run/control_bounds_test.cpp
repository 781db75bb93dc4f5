// Requests of a client are limited, and delay no other client: STEPs, sequences, sessions, texts,
// requests before the first state.
#include <gtest/gtest.h>

#include "base/utf8.h"
#include "control_client.h"
#include "ruedo/grant_reply_t.hpp"
#include "ruedo/grant_request_t.hpp"
#include "ruedo/join_t.hpp"
#include "ruedo/rate_request_t.hpp"
#include "ruedo/resend_reply_t.hpp"
#include "ruedo/resend_request_t.hpp"

namespace ruedo::run {
namespace {

const std::string kRobot = robot_sdf("r", 0, 0);

TEST(Steps, ArePaused) {
  Controlled client;
  client.begin(paused_server(), kRobot);
  const request_t endless = client.stepping(kMostSteps);
  client.send(endless);
  while (client.state().step == 0) {
  }
  const reply_t paused = client.ask(request_t::PAUSE);
  ASSERT_EQ(paused.code, reply_t::OK);
  const int64_t stands = decoded_as<state_reply_t>(paused.body).step;
  client.rewind();
  const reply_t ended = client.answer(endless);
  EXPECT_EQ(ended.code, reply_t::REFUSED);
  EXPECT_EQ(ended.text, "a PAUSE ended it at step " + std::to_string(stands));
  EXPECT_EQ(client.step(1).step, stands + 1);
}

TEST(Steps, AreBounded) {
  Controlled client;
  client.begin(paused_server(), kRobot);
  for (const int64_t steps : {INT64_MIN, int64_t{-1}, int64_t{0}, kMostSteps + 1, INT64_MAX}) {
    const reply_t reply = client.ask(client.stepping(steps));
    EXPECT_EQ(reply.code, reply_t::BAD_REQUEST);
    EXPECT_EQ(reply.text, "steps is " + std::to_string(steps) + "; 1 to 1000000000 is allowed");
  }
}

TEST(Steps, FewOfAClientWait) {
  Controlled client;
  client.begin(paused_server(), kRobot);
  client.state();  // what comes before the first state waits apart
  for (size_t i = 0; i < Control::kMostSteppings; ++i) client.send(client.stepping(kMostSteps));
  const reply_t beyond = client.ask(client.stepping(1));
  EXPECT_EQ(beyond.code, reply_t::REFUSED);
  EXPECT_NE(beyond.text.find("too many requests"), std::string::npos) << beyond.text;
  EXPECT_EQ(client.ask(request_t::PAUSE).code, reply_t::OK);
  EXPECT_EQ(client.ask(client.stepping(1)).code, reply_t::OK);  // there is room again
}

// A control without a run: STEPs are answered at step 1 000, which the test publishes.
struct Alone {
  bool state_comes = false;
  std::vector<reply_t> replies;
  Control control{
      7,
      {.execute = [](const request_t&, const Session&) { return engine::Outcome::after(1000); },
       .state = [] { return std::vector<uint8_t>{}; },
       .publish = [this](const reply_t& reply) { replies.push_back(reply); },
       .utime = [] { return 0; },
       .epoch = [] { return 0; },
       .state_comes = [this] { return state_comes; }}};
  void ask(int32_t kind, int64_t session, int64_t sequence, const std::vector<uint8_t>& body = {}) {
    request_t request{};
    request.epoch = -1;
    request.session = session;
    request.sequence = sequence;
    request.kind = kind;
    request.body = body;
    request.size = static_cast<int32_t>(body.size());
    const std::vector<uint8_t> bytes = engine::encoded(request);
    control.on_request(bytes.data(), bytes.size());
    control.serve();
  }
  // Clients that join, ask for as much as one may, and leave.
  void come_and_go(int clients) {
    join_t body;
    body.client = "hasty";
    for (int i = 1; i <= clients; ++i) {
      ask(request_t::JOIN, 0, i, engine::encoded(body));
      const int64_t session = replies.back().session;
      for (int step = 1; step <= 8; ++step) ask(request_t::STEP, session, step);
      ask(request_t::LEAVE, session, 9);
    }
    replies.clear();
  }
};

TEST(LeavingClient, DropsRequestsThatWaitForAStep) {
  Alone alone;
  alone.come_and_go(100);
  alone.control.published(1000);
  EXPECT_EQ(alone.replies.size(), 0u);
}

TEST(LeavingClient, DropsRequestsThatWaitForTheFirstState) {
  Alone alone;
  alone.state_comes = true;
  alone.come_and_go(100);
  alone.state_comes = false;
  alone.control.serve();
  EXPECT_EQ(alone.replies.size(), 0u);
}

TEST(LeavingClient, ADroppedClientCountsAsLeaving) {
  Alone alone;
  join_t body;
  body.client = "crashed";
  alone.ask(request_t::JOIN, 0, 1, engine::encoded(body));
  alone.ask(request_t::STEP, alone.replies.back().session, 1);
  alone.control.drop(alone.control.sessions().list()[0].id);  // as lockstep does
  alone.replies.clear();
  alone.control.published(1000);
  EXPECT_EQ(alone.replies.size(), 0u);
}

TEST(Sequences, JumpLittle) {
  Controlled client;
  client.begin(paused_server(), kRobot);
  request_t first = client.request(request_t::GET_STATE, engine::encoded(name_request_t{}));
  const int64_t last = first.sequence;
  ASSERT_EQ(client.ask(first).code, reply_t::OK);
  for (const int64_t sequence :
       {INT64_MIN, int64_t{-1}, int64_t{0}, last + Sessions::kMostJump + 1, INT64_MAX}) {
    request_t forged = client.request(request_t::GET_STATE);
    forged.sequence = sequence;
    const reply_t reply = client.ask(forged);
    EXPECT_EQ(reply.code, reply_t::BAD_REQUEST) << sequence;
    EXPECT_NE(reply.text.find("1 to " + std::to_string(last + Sessions::kMostJump)),
              std::string::npos)
        << reply.text;
  }
  EXPECT_EQ(client.step(1).step, 1);  // the session is as it was
}

TEST(Texts, OfRepliesAreShort) {
  Controlled client;
  client.begin(paused_server(), kRobot);
  name_request_t body;
  body.name = std::string(1'000'000, 'x') + "\033[2J";
  const reply_t reply = client.ask(request_t::GET_STATE, engine::encoded(body));
  EXPECT_EQ(reply.code, reply_t::UNKNOWN_NAME);
  EXPECT_LE(reply.text.size(), kLongestSaid + 3);
  body.name = "\033[2J";
  EXPECT_EQ(client.ask(request_t::GET_STATE, engine::encoded(body)).text,
            "there is no model or MODEL/LINK called '?[2J'");
}

TEST(Texts, NamesOfClientsReachNoTerminal) {
  Controlled client;
  client.begin(paused_server(), kRobot);
  join_t joining;
  for (const char* name : {"", "a\033[2J", "a\nb", "a\xff"}) {
    joining.client = name;
    EXPECT_EQ(client.ask(request_t::JOIN, engine::encoded(joining)).code, reply_t::BAD_REQUEST)
        << name;
  }
}

// Seconds go by, of the test's own clock, while the server listens.
void pass(Sessions& sessions, int seconds) {
  for (int i = 0; i < seconds; ++i) sessions.listen(sessions.listened() + std::chrono::seconds(1));
}

TEST(Places, GoToNewcomersWithinSeconds) {
  Sessions sessions;
  const Sessions::Time begin = sessions.listened();
  std::vector<int64_t> ids;
  for (size_t i = 0; i < Sessions::kMostSessions; ++i)
    ids.push_back(sessions.join("crashed", static_cast<int64_t>(i) + 1)->id);
  pass(sessions, 2);
  EXPECT_EQ(sessions.join("new", 1000), nullptr);
  for (size_t i = 0; i < 10;
       ++i) {  // they ask for something now and then; the others only ever joined
    Session* session = sessions.find(ids[i]);
    session->spoke = true;
    session->last_heard = begin + std::chrono::seconds(i == 3 ? 0 : 1);
  }
  pass(sessions, 2);
  const int64_t kept = ids.back();
  const auto keeps = [&](int64_t id) { return id == kept; };
  for (size_t i = 0; i < Sessions::kMostSessions - 11; ++i)
    ASSERT_NE(sessions.join("new", 1000 + static_cast<int64_t>(i), keeps), nullptr) << i;
  for (size_t i = 0; i < 10; ++i)
    EXPECT_NE(sessions.find(ids[i]), nullptr) << i;  // clients that only joined are replaced first
  ASSERT_NE(sessions.join("new", 2000, keeps), nullptr);
  EXPECT_EQ(sessions.find(ids[3]), nullptr);  // then the most silent
  for (int64_t i = 1; i < 10; ++i) ASSERT_NE(sessions.join("new", 2000 + i, keeps), nullptr) << i;
  EXPECT_EQ(sessions.join("new", 3000, keeps), nullptr);
  EXPECT_NE(sessions.find(kept), nullptr);
}

// A stopped process hears no client, wherever the stop falls between two looks at the clock.
TEST(Silence, DoesNotCountWhileTheProcessIsStopped) {
  Sessions sessions;
  Session* session = sessions.join("patient", 1);
  const auto silence = [&] { return sessions.listened() - session->last_heard; };
  pass(sessions, 1);
  EXPECT_EQ(silence(), std::chrono::seconds(1));
  sessions.listen(sessions.listened() + std::chrono::seconds(60));  // stopped for a minute
  EXPECT_EQ(silence(), std::chrono::seconds(1));
  pass(sessions, 1);
  EXPECT_EQ(silence(), std::chrono::seconds(2));
  sessions.hear(*session);
  EXPECT_EQ(silence(), std::chrono::seconds(0));
}

RunOptions in_lockstep() {
  RunOptions options = fast(1e6);
  options.lockstep.clients = 1;
  options.lockstep.lease_s = 1e6;
  return options;
}

grant_request_t grant(int64_t granted, int64_t until) {
  grant_request_t body;
  body.granted = granted;
  body.step_until = until;
  body.received = -1;
  body.ncommands = 0;
  return body;
}

// A rate that is too slow to wait for would stop the run of the clients that grant.
TEST(InLockstep, RefusesARate) {
  Controlled client;
  client.begin(in_lockstep(), kRobot);
  EXPECT_EQ(client.ask(request_t::GRANT, engine::encoded(grant(-1, -1))).code, reply_t::OK);
  rate_request_t slow;
  slow.rate = 0.001;
  const reply_t reply = client.ask(request_t::RATE, engine::encoded(slow));
  EXPECT_EQ(reply.code, reply_t::REFUSED);
  EXPECT_NE(reply.text.find("grants"), std::string::npos) << reply.text;
}

// Before its first state a lockstep run refuses what is not possible yet, and still answers
// everybody else.
TEST(BeforeLockstep, AnswersWhileItsFirstStateIsMissing) {
  Controlled client;
  client.begin(in_lockstep(), kRobot);
  request_t strange = client.request(request_t::GET_STATE, engine::encoded(name_request_t{}));
  strange.session = 0;
  EXPECT_EQ(client.ask(strange).code, reply_t::UNKNOWN_SESSION);
  constexpr int32_t kinds[] = {request_t::GET_STATE, request_t::PAUSE, request_t::RESUME,
                               request_t::SET_POSE,  request_t::SPAWN, request_t::RESET};
  for (const int32_t kind : kinds) {
    const reply_t reply = client.ask(kind);
    EXPECT_EQ(reply.code, reply_t::REFUSED) << kind;
    EXPECT_NE(reply.text.find("lockstep has not begun: call step(0)"), std::string::npos)
        << reply.text;
    EXPECT_NE(reply.text.find("1 more of 1 clients"), std::string::npos) << reply.text;
  }
  EXPECT_EQ(client.ask(request_t::STEP, engine::encoded(step_request_t{})).code,
            reply_t::BAD_REQUEST);
  EXPECT_EQ(client.ask(request_t::GRANT, engine::encoded(grant(-1, -1))).code, reply_t::OK);
  EXPECT_EQ(client.state().step, 0);  // waits for the state that comes now
  EXPECT_EQ(client.ask(request_t::QUIT).code, reply_t::OK);
}

TEST(InLockstep, APauseStopsTheRunDespiteGrants) {
  Controlled client;
  client.begin(in_lockstep(), kRobot);
  ASSERT_EQ(client.ask(request_t::GRANT, engine::encoded(grant(-1, -1))).code, reply_t::OK);
  ASSERT_EQ(client.ask(request_t::PAUSE).code, reply_t::OK);
  const request_t two = client.request(request_t::GRANT, engine::encoded(grant(0, 2)));
  client.send(two);
  EXPECT_EQ(client.ask(two).code, reply_t::OK);
  resend_request_t look;
  look.received = -1;
  look.nwanted = 0;
  const auto resent =
      decoded_as<resend_reply_t>(client.ask(request_t::RESEND, engine::encoded(look)).body);
  EXPECT_EQ(resent.step, 0);
  EXPECT_EQ(resent.waits_for, "a RESUME: it is paused");
  EXPECT_EQ(client.ask(request_t::RESUME).code, reply_t::OK);
  while (client.state().step < 2) {
  }
}

}  // namespace
}  // namespace ruedo::run
