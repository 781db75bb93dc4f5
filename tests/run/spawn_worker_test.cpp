// SPAWN: its model is prepared beside the run, and enters at a step that the log records.
#include <atomic>
#include <future>

#include <gtest/gtest.h>

#include "control_client.h"
#include "log/reader.h"
#include "ruedo/applied_t.hpp"
#include "ruedo/grant_request_t.hpp"
#include "run/repeat/verify.h"

namespace ruedo::run {
namespace {

const std::string kRobot = robot_sdf("r", 0, 0);
const std::string kBox = as_file(box_sdf("box", "0.2 0.2 0.2", false));

// Holds back models until it is opened.
struct Gate {
  std::promise<void> open;
  std::shared_future<void> opened = open.get_future().share();
  std::promise<void> reached;
  bool told = false;
  std::function<void()> wait() {
    return [this] {
      if (!told) reached.set_value(), told = true;
      opened.wait();
    };
  }
};

TEST(SpawnWorker, TheRunAndOthersContinueMeanwhile) {
  Gate gate;
  TemporaryFile log("spawned.lcm");
  Controlled client;
  RunOptions options = paused_server();
  options.record = log.path();
  options.before_model = gate.wait();
  client.begin(options, kRobot);
  const request_t spawn =
      client.request(request_t::SPAWN, engine::encoded(Controlled::spawning(kBox, 2, 0)));
  client.send(spawn);
  gate.reached.get_future().wait();
  EXPECT_EQ(client.step(7).step, 7);  // requests of the same client, too
  EXPECT_EQ(client.set_pose("r", {0, 3, 0}).code, reply_t::OK);
  client.send(spawn);  // a repeated one is not a second one
  gate.open.set_value();
  const reply_t reply = client.answer(spawn);
  ASSERT_EQ(reply.code, reply_t::OK) << reply.text;
  EXPECT_EQ(decoded_as<state_reply_t>(reply.body).name, "box");
  EXPECT_EQ(decoded_as<state_reply_t>(reply.body).step, 7);
  EXPECT_EQ(client.step(50).step, 57);
  client.end();
  log::Reader reader(log.path());
  log::Event event;
  std::vector<std::pair<int64_t, int32_t>> applied;
  while (reader.next(event)) {
    if (event.channel != "ruedo/applied") continue;
    const auto one = decoded_as<applied_t>(event.data);
    applied.emplace_back(one.step, one.kind);
  }
  EXPECT_EQ(applied, (std::vector<std::pair<int64_t, int32_t>>{{7, request_t::SET_POSE},
                                                               {7, request_t::SPAWN}}));
  Verifier verifier(log.path(), load_text(kRobot), RunOptions{});
  const Verification verdict = verifier.run();
  EXPECT_FALSE(verdict.difference);
  EXPECT_EQ(verdict.fault, "");
}

TEST(SpawnWorker, AResetCancelsUnfinishedModels) {
  Gate gate;
  Controlled client;
  RunOptions options = paused_server();
  options.before_model = gate.wait();
  client.begin(options, kRobot);
  const request_t spawn =
      client.request(request_t::SPAWN, engine::encoded(Controlled::spawning(kBox, 2, 0)));
  client.send(spawn);
  gate.reached.get_future().wait();
  ASSERT_EQ(client.reset(reset_request_t::ALL).code, reply_t::OK);
  client.rewind();
  EXPECT_EQ(client.answer(spawn).text, "the world was reset");
  gate.open.set_value();
  EXPECT_EQ(client.spawn(kBox, 2, 1, "another").code,
            reply_t::OK);  // made after the first, which is in no world
  name_request_t name;
  name.name = "box";
  EXPECT_EQ(client.ask(request_t::GET_STATE, engine::encoded(name)).code, reply_t::UNKNOWN_NAME);
}

// Models may be large: one is ready, and the next one is begun when it was taken.
TEST(SpawnWorker, OneIsReadyAtATime) {
  engine::ModelStore store("test.sdf");
  engine::Wakeup ready;
  std::atomic<int> taken{0};
  std::vector<int> taken_before;
  {
    ModelWorker worker(store, ready, [&] { taken_before.push_back(taken); });
    for (int i = 0; i < 3; ++i) {
      request_t request{};
      request.session = i + 1;
      ASSERT_TRUE(worker.add({request, Controlled::spawning(kBox, 2, i)}).pending);
    }
    while (taken < 3) {
      ready.wait();
      std::this_thread::sleep_for(std::chrono::milliseconds(50));  // the next one could begin
      ++taken;
      ASSERT_TRUE(worker.take_made());
    }
  }
  EXPECT_EQ(taken_before, (std::vector<int>{0, 1, 2}));
}

TEST(SpawnWorker, ALeavingClientGetsNoModel) {
  Gate gate;
  int made = 0;
  Controlled client;
  RunOptions options = paused_server();
  options.before_model = [&, wait = gate.wait()] {
    ++made;
    wait();
  };
  client.begin(options, kRobot);
  const auto spawning = [&](const std::string& name) {
    return client.request(request_t::SPAWN,
                          engine::encoded(Controlled::spawning(kBox, 2, 0, name)));
  };
  client.send(spawning("begun"));
  client.send(spawning("waiting"));
  gate.reached.get_future().wait();
  ASSERT_EQ(client.ask(request_t::LEAVE).code, reply_t::OK);
  client.join();
  const request_t another = spawning("another");
  client.send(another);
  client.state();  // earlier requests have arrived
  gate.open.set_value();
  ASSERT_EQ(client.answer(another).code, reply_t::OK);
  EXPECT_EQ(made, 2);
  for (const char* name : {"begun", "waiting"}) {
    name_request_t body;
    body.name = name;
    EXPECT_EQ(client.ask(request_t::GET_STATE, engine::encoded(body)).code, reply_t::UNKNOWN_NAME);
  }
}

TEST(SpawnWorker, FewWait) {
  Gate gate;
  Controlled client;
  RunOptions options = paused_server();
  options.before_model = gate.wait();
  client.begin(options, kRobot);
  const auto spawning = [&](int i) {
    return client.request(request_t::SPAWN, engine::encoded(Controlled::spawning(kBox, 2, i)));
  };
  for (size_t i = 0; i < ModelWorker::kMostOfSession; ++i)
    client.send(spawning(static_cast<int>(i)));
  const reply_t beyond = client.ask(spawning(9));
  EXPECT_EQ(beyond.code, reply_t::REFUSED);
  EXPECT_NE(beyond.text.find("are still loading"), std::string::npos) << beyond.text;
  gate.open.set_value();
}

// The end of a run never waits for the import of a mesh.
TEST(SpawnWorker, TheEndWaitsForNoModel) {
  Gate gate;
  Controlled client;
  RunOptions options = paused_server();
  options.before_model = gate.wait();
  client.begin(options, kRobot);
  const request_t spawn =
      client.request(request_t::SPAWN, engine::encoded(Controlled::spawning(kBox, 2, 0)));
  client.send(spawn);
  gate.reached.get_future().wait();
  EXPECT_EQ(client.ask(request_t::QUIT).code, reply_t::OK);
  client.rewind();
  EXPECT_EQ(client.answer(spawn).text, "the run has ended");
  gate.open.set_value();
}

// The client grants 100 steps, asks for a model while they are computed, and waits for the answer:
// the model enters at step 100.
TEST(SpawnWorker, InLockstepTheStepIsThatOfTheGrants) {
  Controlled client;
  RunOptions options = fast(1e6);
  options.lockstep.clients = 1;
  options.lockstep.lease_s = 1e6;
  client.begin(options, kRobot);
  grant_request_t grant;
  grant.granted = grant.step_until = grant.received = -1;
  grant.ncommands = 0;
  ASSERT_EQ(client.ask(request_t::GRANT, engine::encoded(grant)).code, reply_t::OK);
  grant.granted = 0;
  grant.step_until = 100;
  client.send(client.request(request_t::GRANT, engine::encoded(grant)));
  const reply_t reply = client.spawn(kBox, 2, 0);
  ASSERT_EQ(reply.code, reply_t::OK) << reply.text;
  EXPECT_EQ(decoded_as<state_reply_t>(reply.body).step, 100);
}

TEST(LoadBudget, RunsOut) {
  world::LoadBudget memory(std::chrono::seconds(1000), size_t{3} << 20);
  memory.take_time();
  memory.take_mesh(size_t{2} << 20);
  EXPECT_THROW(memory.take_mesh(size_t{2} << 20), std::runtime_error);
  EXPECT_EQ(memory.fault(), "its meshes take more than 3 MiB of memory");
  world::LoadBudget time(std::chrono::seconds(-1), 1);
  EXPECT_THROW(time.take_time(), std::runtime_error);
  world::LoadBudget left(std::chrono::seconds(1000), 1);
  left.leave_off();
  EXPECT_TRUE(left.is_over());
}

}  // namespace
}  // namespace ruedo::run
