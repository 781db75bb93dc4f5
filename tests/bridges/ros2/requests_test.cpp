// Requests of many ROS clients reach the run as those of one client.
#include "bridges/ros2/services/requests.h"

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "engine/outcome.h"
#include "ruedo/decode.h"
#include "ruedo/request_t.hpp"

namespace ruedo::ros2 {
namespace {

// A run that answers on the test's command.
struct FakeRun {
  std::vector<request_t> got;
  std::vector<int32_t> answers;  // their codes
  Requests requests{[this](const std::string&, std::span<const uint8_t> message) {
    request_t request;
    ASSERT_EQ(decode_checked(message.data(), message.size(), request), DecodeFault::none);
    got.push_back(request);
  }};

  FakeRun() { requests.listen("ruedo/request"); }
  void ask(uint64_t client, uint8_t mark = 0) {
    requests.send(client, request_t::GET_STATE, {mark},
                  [this](const reply_t& reply) { answers.push_back(reply.code); });
  }
  void answer(const request_t& request, int32_t code = reply_t::OK, int64_t session = 7) {
    reply_t reply{};
    reply.kind = request.kind;
    reply.session = session;
    reply.sequence = request.sequence;
    reply.code = code;
    requests.reply(engine::encoded(reply));
  }
  std::vector<int> marks() const {
    std::vector<int> all;
    for (const request_t& request : got) all.push_back(request.body.empty() ? -1 : request.body[0]);
    return all;
  }
  void join() {
    ask(99);
    answer(got.back());
    answer(got.back());
    got.clear();
    answers.clear();
  }
};

TEST(Requests, LimitsTheRequestsOfOneClient) {
  FakeRun run;
  run.join();
  for (int i = 0; i < 100; ++i) run.ask(1, 1);
  // 4 are with the run, 32 wait; the others are refused.
  EXPECT_EQ(run.got.size(), Requests::kMostPendingOfOne);
  EXPECT_EQ(run.answers, std::vector<int32_t>(64, reply_t::REFUSED));
  run.ask(2, 2);
  run.ask(3, 3);
  EXPECT_EQ(run.got.size(), Requests::kMostPendingOfOne + 2) << "others go before what waits";
}

TEST(Requests, ClientsTakeTurns) {
  FakeRun run;
  run.join();
  for (const uint8_t client : {1, 2, 3})
    for (int i = 0; i < 6; ++i) run.ask(client, client);
  EXPECT_EQ(run.marks(), (std::vector<int>{1, 1, 1, 1, 2, 2, 2, 2}));
  const std::vector<request_t> first = run.got;
  run.got.clear();
  for (const request_t& request : first) run.answer(request);
  EXPECT_EQ(run.marks(), (std::vector<int>{3, 1, 3, 1, 2, 3, 2, 3}));
}

TEST(Requests, StepsThatTakeForEverLeaveRoom) {
  FakeRun run;
  run.join();
  for (uint64_t client = 1; client <= 9; ++client)
    run.requests.send(client, request_t::STEP, {0}, [](const reply_t&) {});
  EXPECT_EQ(run.got.size(), Requests::kMostSteps);
  run.ask(9);
  EXPECT_EQ(run.got.size(), Requests::kMostSteps) << "behind a STEP of its own";
  run.ask(20);
  EXPECT_EQ(run.got.size(), Requests::kMostSteps + 1);
}

TEST(Requests, RepeatsUnansweredRequests) {
  FakeRun run;
  // However long this thread does not run between its calls.
  const auto before = Requests::Clock::now();
  const auto repeat_later = [&run] {
    run.requests.repeat(Requests::Clock::now() + 2 * Requests::kRepeat);
  };
  run.ask(1, 5);
  ASSERT_EQ(run.marks().size(), 1U);  // JOIN
  run.requests.repeat(before);
  EXPECT_EQ(run.got.size(), 1U) << "it is not late yet";
  repeat_later();
  ASSERT_EQ(run.got.size(), 2U);
  EXPECT_EQ(run.got[1].kind, request_t::JOIN);
  EXPECT_EQ(run.got[1].sequence, run.got[0].sequence);
  run.answer(run.got[1]);
  ASSERT_EQ(run.got.size(), 3U);
  repeat_later();
  ASSERT_EQ(run.got.size(), 4U);
  EXPECT_EQ(run.got[3].sequence, run.got[2].sequence);
  EXPECT_EQ(run.got[3].body, run.got[2].body);
  run.answer(run.got[3]);
  run.answer(run.got[3]);  // the other answer
  EXPECT_EQ(run.answers, std::vector<int32_t>{reply_t::OK});
}

TEST(Requests, ALostSessionOrRequestCostsNoAnswer) {
  FakeRun run;
  run.join();
  run.ask(1, 1);
  run.ask(2, 2);
  const std::vector<request_t> lost = run.got;
  run.got.clear();
  run.answer(lost[0], reply_t::UNKNOWN_SESSION);
  ASSERT_EQ(run.got.size(), 1U);
  EXPECT_EQ(run.got[0].kind, request_t::JOIN);
  run.answer(run.got[0], reply_t::OK, 8);
  ASSERT_EQ(run.got.size(), 2U);
  EXPECT_EQ(run.got[1].session, 8);
  EXPECT_EQ(run.marks()[1], 1);
  run.answer(lost[1], reply_t::UNKNOWN_SESSION);  // of the session before
  ASSERT_EQ(run.got.size(), 3U);
  EXPECT_EQ(run.got[2].session, 8);
  run.answer(run.got[1], reply_t::OK, 8);
  run.answer(run.got[2], reply_t::OK, 8);
  EXPECT_EQ(run.answers, std::vector<int32_t>(2, reply_t::OK));
}

TEST(Requests, RepeatsADroppedRequestOnce) {
  FakeRun run;
  run.join();
  run.ask(1, 1);
  run.answer(run.got[0], reply_t::OLD_SEQUENCE);
  ASSERT_EQ(run.got.size(), 2U);
  EXPECT_GT(run.got[1].sequence, run.got[0].sequence);
  run.answer(run.got[1], reply_t::OLD_SEQUENCE);
  EXPECT_EQ(run.answers, std::vector<int32_t>{reply_t::OLD_SEQUENCE});
}

TEST(Requests, ReportsARefusedJoin) {
  FakeRun run;
  run.ask(1);
  run.answer(run.got[0], reply_t::REFUSED);
  EXPECT_EQ(run.answers, std::vector<int32_t>{reply_t::REFUSED});
}

}  // namespace
}  // namespace ruedo::ros2
