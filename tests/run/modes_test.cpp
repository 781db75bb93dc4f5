// The three modes without a run: which steps each permits, with a gate that only records its limit.
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "log/writer.h"
#include "ruedo/errors.h"
#include "ruedo/fault_t.hpp"
#include "ruedo/grant_reply_t.hpp"
#include "ruedo/markers_t.hpp"
#include "ruedo/resend_request_t.hpp"
#include "ruedo/reset_request_t.hpp"
#include "ruedo/velocity_command_t.hpp"
#include "run/journal.h"
#include "run/live.h"
#include "run/lockstep/lockstep.h"
#include "run/repeat/repeating.h"
#include "running.h"

namespace ruedo::run {
namespace {

using std::chrono::seconds;

constexpr int64_t kStep_us = 5000;
const Mode::Time kStart{};

class FakeGate : public Gate {
 public:
  void set_limit(int64_t step) override { limit = step; }
  void set_limit_quietly(int64_t step) override { limit = step; }
  bool paused() const override { return is_paused; }
  int64_t limit = -100;
  bool is_paused = false;
};

// A world with a robot that takes velocities.
struct FakeWorld {
  FakeWorld() { add_robot("r"); }
  void add_robot(const std::string& name) {
    const std::string channel = name + "/velocity";
    channels.add<velocity_command_t>(channel, name, "", Rate{}, true);
    inbox.add({{channel, RobotIndex(0), engine::Input::Kind::velocity},
               {name + "/fault", RobotIndex(0), engine::Input::Kind::fault}},
              1);
  }
  void remove_robot() {
    channels.remove("r");
    inbox.remove(RobotIndex(0));
  }
  // The channels of the commands that act on the states up to that one.
  std::vector<std::string> apply(int64_t step) {
    engine::Batch batch;
    inbox.apply(robots_, faults_, step, batch);
    std::vector<std::string> names;
    for (int i = 0; i < batch.applied_count; ++i)
      names.push_back(inbox.inputs()[batch.applied[i].input].channel);
    return names;
  }
  Mode::Stage stage(SimTime base_us = 0) {
    return {&inbox, &gate, &channels, base_us, [](RobotIndex) { return std::string("r"); }};
  }
  FakeGate gate;
  engine::Channels channels;
  engine::CommandInbox inbox{{{"ruedo/markers", {}, engine::Input::Kind::markers}}, 1};

 private:
  std::shared_ptr<const world::WorldModel> world_ = load_text(robot_sdf("r", 0, 0));
  world::BodyLayout layout_{*world_};
  physics::PhysicsWorld physics_{*world_, layout_};
  std::vector<device_info_t> devices_;
  robot::Robots robots_{*world_, layout_, physics_};
  engine::Faults faults_{*world_, layout_, devices_, 1};
};

std::vector<uint8_t> forward() {
  velocity_command_t command{};
  command.vx = 0.5;
  return engine::encoded(command);
}

TEST(Live, RunsByItself) {
  FakeWorld world;
  Live live({}, kStep_us);
  live.begin(world.stage(), -1);
  EXPECT_EQ(world.gate.limit, std::numeric_limits<int64_t>::max());
  EXPECT_TRUE(live.has_room() && live.state_comes() && !live.takes_grants());
  EXPECT_FALSE(live.on_message("r/velocity", nullptr, 0));  // it acts when it comes
  EXPECT_EQ(live.attend({}, 0, kStart).next, Mode::Time::max());
  EXPECT_EQ(live.turn(0).what, Mode::Turn::What::nothing);
  EXPECT_EQ(live.refusal(request_t::RESET, false), "");
}

TEST(Live, WaitsForTheMessagesOfAChannel) {
  FakeWorld world;
  Live live({{"r/velocity", {10, 1}}}, kStep_us);
  live.begin(world.stage(), -1);
  EXPECT_EQ(world.gate.limit, 0);  // message 0 acts on state 0, message k on state 20 k
  const std::vector<uint8_t> command = forward();
  EXPECT_TRUE(live.on_message("r/velocity", command.data(), command.size()));
  EXPECT_EQ(world.gate.limit, 20);
  EXPECT_TRUE(live.on_message("r/velocity", command.data(), command.size()));
  EXPECT_EQ(world.gate.limit, 40);
  EXPECT_THAT(live.waits_for(40), testing::HasSubstr("message 2 on r/velocity"));
  EXPECT_EQ(live.waits_for(39), "");
  live.begin(world.stage(), 50);
  EXPECT_EQ(world.gate.limit, 60);
}

TEST(Live, DoesNotWaitForARemovedRobot) {
  FakeWorld world;
  Live live({{"r/velocity", {10, 1}}}, kStep_us);
  live.begin(world.stage(), -1);
  const std::vector<uint8_t> command = forward();
  live.on_message("r/velocity", command.data(), command.size());
  world.remove_robot();
  live.models_changed(world.stage(), 13);
  EXPECT_EQ(world.gate.limit, std::numeric_limits<int64_t>::max());
  EXPECT_EQ(live.waits_for(40), "");
  EXPECT_FALSE(live.on_message("r/velocity", command.data(), command.size()));
  world.add_robot("r");
  live.models_changed(world.stage(), 30);
  EXPECT_EQ(world.gate.limit, 40);
  EXPECT_TRUE(live.on_message("r/velocity", command.data(), command.size()));
  EXPECT_EQ(world.gate.limit, 60);
  EXPECT_THAT(world.apply(60), testing::ElementsAre("r/velocity"));
}

TEST(Live, CountsOnForARobotThatStays) {
  FakeWorld world;
  Live live({{"r/velocity", {10, 1}}}, kStep_us);
  live.begin(world.stage(), -1);
  const std::vector<uint8_t> command = forward();
  for (int k = 0; k < 3; ++k) live.on_message("r/velocity", command.data(), command.size());
  live.models_changed(world.stage(), 0);
  EXPECT_EQ(world.gate.limit, 60);
}

// As after a RESET of the time, or a RESTORE.
TEST(Live, RunsInAWorldWithoutTheRobot) {
  FakeWorld world;
  Live live({{"r/velocity", {10, 1}}}, kStep_us);
  live.begin(world.stage(), -1);
  world.remove_robot();
  live.begin(world.stage(), -1);
  EXPECT_EQ(world.gate.limit, std::numeric_limits<int64_t>::max());
}

TEST(Live, RefusesToWaitForAChannelThatIsNotAnInput) {
  FakeWorld world;
  Live live({{"r/velocty", {10, 1}}}, kStep_us);
  EXPECT_THROW(live.begin(world.stage(), -1), InputError);
}

class LockstepModeTest : public testing::Test {
 protected:
  void begin(int clients, LockstepOptions::Policy policy = LockstepOptions::Policy::pause) {
    lockstep_ =
        std::make_unique<Lockstep>(LockstepOptions{clients, 10.0, policy},
                                   [this](const applied_t& applied) { noted_.push_back(applied); });
    lockstep_->begin(world_.stage(), -1);
    for (int i = 0; i < clients; ++i) {
      Session session;
      session.id = i + 1;
      session.client = std::string(1, static_cast<char>('a' + i));
      session.last_heard = kStart;
      sessions_.push_back(session);
    }
  }
  static request_t granting(grant_request_t body) {
    body.ncommands = static_cast<int32_t>(body.commands.size());
    request_t request{};
    request.kind = request_t::GRANT;
    request.body = engine::encoded(body);
    return request;
  }
  static request_t granting(int64_t from, int64_t until, int64_t received = -1) {
    grant_request_t body{};
    body.granted = from;
    body.step_until = until;
    body.received = received;
    return granting(body);
  }
  static grant_command_t command(int64_t step, const std::string& channel,
                                 const std::vector<uint8_t>& data) {
    grant_command_t command{};
    command.step = step;
    command.channel = channel;
    command.data = data;
    command.size = static_cast<int32_t>(data.size());
    return command;
  }
  engine::Outcome grant(int client, int64_t from, int64_t until, int64_t received = -1) {
    return lockstep_->grant(granting(from, until, received), sessions_[client]);
  }
  engine::Outcome having(int client, int64_t received) {
    resend_request_t body{};
    body.received = received;
    request_t request{};
    request.kind = request_t::RESEND;
    request.body = engine::encoded(body);
    return lockstep_->grant(request, sessions_[client]);
  }
  void join_all() {
    for (size_t i = 0; i < sessions_.size(); ++i)
      EXPECT_EQ(grant(static_cast<int>(i), -1, -1).code, reply_t::OK);
  }
  void publish(int64_t step) {
    lockstep_->sink()->begin_step({step, step * kStep_us, 0});
    lockstep_->published(step);
  }

  FakeWorld world_;
  std::unique_ptr<Lockstep> lockstep_;
  std::vector<Session> sessions_;
  std::vector<applied_t> noted_;
};

TEST_F(LockstepModeTest, GoesToTheSmallestGrant) {
  begin(2);
  EXPECT_EQ(world_.gate.limit, -1);
  EXPECT_FALSE(lockstep_->state_comes());
  EXPECT_NE(lockstep_->refusal(request_t::GET_STATE, true), "");
  grant(0, -1, -1);
  EXPECT_EQ(world_.gate.limit, -1);
  grant(1, -1, -1);
  EXPECT_EQ(world_.gate.limit, 0);  // both are there
  EXPECT_EQ(noted_.size(), 2u);
  EXPECT_EQ(lockstep_->refusal(request_t::GET_STATE, true), "");
  EXPECT_NE(lockstep_->refusal(request_t::RESTORE, false), "");
  publish(0);
  grant(0, 0, 10);
  EXPECT_EQ(world_.gate.limit, 0);
  grant(1, 0, 4);
  EXPECT_EQ(world_.gate.limit, 4);
  EXPECT_EQ(lockstep_->granted(), 4);
  grant(1, 4, 20);
  EXPECT_EQ(world_.gate.limit, 10);
}

TEST_F(LockstepModeTest, AJoiningClientStartsAtTheGrantedStep) {
  begin(1);
  join_all();
  sessions_.push_back({});
  sessions_[1].id = 2;
  sessions_[1].client = "b";
  publish(0);
  grant(0, 0, 100);
  const engine::Outcome joined = grant(1, -1, -1);
  grant_reply_t stands{};
  ASSERT_GT(stands.decode(joined.body.data(), 0, static_cast<int>(joined.body.size())), 0);
  EXPECT_EQ(stands.granted, 100);
  EXPECT_EQ(stands.received, 100);
  EXPECT_EQ(stands.step, 0);
  // It may repeat the reply's numbers, though state 1 is missing; no more.
  EXPECT_EQ(having(1, 100).code, reply_t::OK);
  EXPECT_EQ(having(1, 101).code, reply_t::BAD_REQUEST);
  EXPECT_EQ(grant(1, 100, 101, 101).code, reply_t::BAD_REQUEST);
  EXPECT_EQ(grant(1, 100, 101, 100).code, reply_t::OK);
  EXPECT_EQ(grant(0, 100, 101, 1).code, reply_t::BAD_REQUEST);  // the other one cannot have it
}

TEST_F(LockstepModeTest, RestartsWithARebuiltWorld) {
  begin(1);
  join_all();
  publish(0);
  grant(0, 0, 50);
  lockstep_->begin(world_.stage(), -1);
  EXPECT_EQ(world_.gate.limit, 0);
  EXPECT_EQ(grant(0, 0, 3).code, reply_t::OK);  // grants stand at 0 again
}

TEST_F(LockstepModeTest, AClientsNameIsReservedUntilItIsSilent) {
  begin(1);
  join_all();
  publish(0);
  Session second = sessions_[0];
  second.id = 9;
  sessions_.push_back(second);
  EXPECT_EQ(grant(1, -1, -1).code, reply_t::REFUSED);
  lockstep_->attend(sessions_, 0, kStart + seconds(11));
  EXPECT_EQ(grant(1, -1, -1).code, reply_t::OK);
}

TEST_F(LockstepModeTest, EachClientSendsItsShareAheadAndNoMore) {
  const int clients = 64;
  const size_t share = Lockstep::kMostHeld / clients;
  begin(clients);
  join_all();
  publish(0);
  grant_request_t body{};
  body.step_until = 2000;
  grant_command_t command;
  command.channel = "r/velocity";
  command.step = 1000;
  command.data = forward();
  command.size = static_cast<int32_t>(command.data.size());
  request_t request{};
  request.kind = request_t::GRANT;
  const auto granted = [&](int client, size_t commands) {
    body.commands.assign(commands, command);
    body.ncommands = static_cast<int32_t>(commands);
    request.body = engine::encoded(body);
    return lockstep_->grant(request, sessions_[client]).code;
  };
  EXPECT_EQ(granted(0, share + 1), reply_t::REFUSED);
  EXPECT_EQ(granted(0, share), reply_t::OK);
  EXPECT_EQ(granted(1, share), reply_t::OK);
}

// Those that the inbox has already, and those for later steps.
TEST_F(LockstepModeTest, CommandsAheadGoWithTheirRobot) {
  begin(1);
  join_all();
  publish(0);
  grant_request_t body{};
  body.step_until = 600;
  body.commands = {command(10, "r/velocity", forward()), command(500, "r/velocity", forward())};
  ASSERT_EQ(lockstep_->grant(granting(body), sessions_[0]).code, reply_t::OK);
  world_.remove_robot();
  lockstep_->models_changed(world_.stage(), 0);
  world_.add_robot("other");
  lockstep_->models_changed(world_.stage(), 0);
  for (int64_t step = 1; step <= 600; ++step) {
    publish(step);
    having(0, step);
  }
  EXPECT_THAT(world_.apply(600), testing::IsEmpty());
}

// A command that the inbox refuses makes the grant fail.
TEST_F(LockstepModeTest, BadValuesRefuseTheGrant) {
  begin(1);
  join_all();
  publish(0);
  fault_t good{};
  good.kind = "kidnapped";
  good.view_end = 1.0;
  fault_t unknown = good, unplaced = good;
  unknown.kind = "nonsense";
  unplaced.x = std::numeric_limits<double>::quiet_NaN();
  grant_request_t body{};
  body.step_until = 10;
  const auto refusal = [&](const std::string& channel, const std::vector<uint8_t>& data) {
    body.commands = {command(3, "r/velocity", forward()), command(5, channel, data)};
    const engine::Outcome outcome = lockstep_->grant(granting(body), sessions_[0]);
    EXPECT_EQ(outcome.code == reply_t::OK, outcome.text.empty());
    return outcome.text;
  };
  const std::string which = "command 1 (r/fault): ";
  EXPECT_THAT(refusal("r/fault", engine::encoded(unknown)),
              testing::AllOf(testing::StartsWith(which), testing::HasSubstr("nonsense")));
  EXPECT_THAT(refusal("r/fault", engine::encoded(unplaced)), testing::StartsWith(which));
  EXPECT_THAT(refusal("ruedo/markers", engine::encoded(markers_t{})),
              testing::StartsWith("command 1 (ruedo/markers): "));
  EXPECT_EQ(refusal("r/fault", engine::encoded(good)), "");
}

TEST_F(LockstepModeTest, FewGrantsOfAClientWaitForTheOthers) {
  begin(2);
  join_all();
  publish(0);
  const auto most = static_cast<int64_t>(Lockstep::kMostGrants);
  for (int64_t step = 0; step < most; ++step) {
    EXPECT_FALSE(lockstep_->early(granting(step, step + 1), sessions_[0])) << step;
    grant(0, step, step + 1);
  }
  EXPECT_TRUE(lockstep_->early(granting(most, most + 1), sessions_[0]));
  EXPECT_FALSE(lockstep_->early(granting(0, 1), sessions_[1]));
}

TEST_F(LockstepModeTest, HasNoRoomBeforeTheMessagesAreReceived) {
  begin(1);
  join_all();
  grant(0, 0, 1000);
  const auto most = static_cast<int64_t>(KeptMessages::kMostSteps);
  for (int64_t step = 0; step < most; ++step) {
    EXPECT_TRUE(lockstep_->has_room()) << step;
    publish(step);
  }
  EXPECT_FALSE(lockstep_->has_room());
  resend_request_t body{};
  body.received = 9;
  request_t request{};
  request.kind = request_t::RESEND;
  request.body = engine::encoded(body);
  EXPECT_EQ(lockstep_->grant(request, sessions_[0]).code, reply_t::OK);
  EXPECT_TRUE(lockstep_->has_room());
  EXPECT_EQ(world_.gate.limit, most - 1 + Lockstep::kMostAhead);
}

TEST_F(LockstepModeTest, WaitsForASilentClientOrContinuesOrFails) {
  using Policy = LockstepOptions::Policy;
  for (const Policy policy : {Policy::pause, Policy::drop, Policy::fail}) {
    sessions_.clear();
    begin(2, policy);
    join_all();
    publish(0);
    grant(0, 0, 10);
    EXPECT_TRUE(lockstep_->attend(sessions_, 0, kStart + seconds(9)).dropped.empty());
    sessions_[0].last_heard = kStart + seconds(9);
    if (policy == Policy::fail) {
      EXPECT_THROW(lockstep_->attend(sessions_, 0, kStart + seconds(11)), LeaseEnded);
      continue;
    }
    const auto dropped = lockstep_->attend(sessions_, 0, kStart + seconds(11)).dropped;
    EXPECT_EQ(dropped, policy == Policy::drop ? std::vector<int64_t>{2} : std::vector<int64_t>{});
    EXPECT_EQ(world_.gate.limit, policy == Policy::drop ? 10 : 0);
    EXPECT_EQ(lockstep_->keeps(2), false);
  }
}

// A log of two epochs: a command on state 7, a reset at 20, the end at 30.
class RepeatingTest : public testing::Test {
 protected:
  RepeatingTest() {
    log::Writer writer(file_.path());
    log_header_t header{};
    header.step_us = kStep_us;
    write(writer, 0, kHeaderChannel, header);
    applied_t applied{};
    applied.channel = "r/velocity";
    applied.step = 7;
    applied.data = forward();
    applied.size = static_cast<int32_t>(applied.data.size());
    write(writer, 7 * kStep_us, kAppliedChannel, applied);
    reset_request_t reset{};
    reset.seed = -1;
    applied.channel = "ruedo/request";
    applied.kind = request_t::RESET;
    applied.step = 20;
    applied.data = engine::encoded(reset);
    applied.size = static_cast<int32_t>(applied.data.size());
    write(writer, 20 * kStep_us, kAppliedChannel, applied);
    state_hash_t hash{};
    hash.step = 30;
    hash.epoch = 1;
    hash.state_hash = 4711;
    hash.last = true;
    write(writer, 50 * kStep_us, kStateHashChannel, hash);
    writer.flush();
  }

  template <class T>
  static void write(log::Writer& writer, int64_t stamp, const std::string& channel,
                    const T& message) {
    const std::vector<uint8_t> bytes = engine::encoded(message);
    writer.write(stamp, channel, bytes.data(), bytes.size());
  }

  TemporaryFile file_{"repeating.log"};
  FakeWorld world_;
};

TEST_F(RepeatingTest, GoesFromRequestToRequestAndEnds) {
  Repeating repeating(file_.path(), nullptr);
  repeating.begin(world_.stage(), -1);
  EXPECT_EQ(world_.gate.limit, -1);
  EXPECT_EQ(repeating.turn(-1).what, Mode::Turn::What::nothing);
  EXPECT_EQ(world_.gate.limit, 20);
  const Mode::Turn reset = repeating.turn(20);
  ASSERT_EQ(reset.what, Mode::Turn::What::execute);
  EXPECT_EQ(reset.request.kind, request_t::RESET);
  repeating.begin(world_.stage(20 * kStep_us), -1);  // as that request does
  repeating.executed({});
  EXPECT_EQ(repeating.turn(-1).what, Mode::Turn::What::nothing);
  EXPECT_EQ(world_.gate.limit, 30);
  EXPECT_EQ(repeating.turn(29).what, Mode::Turn::What::nothing);
  EXPECT_EQ(repeating.turn(30).what, Mode::Turn::What::end);
  repeating.check_end(4711);
  EXPECT_THROW(repeating.check_end(4712), InputError);
}

// How long it takes is known before it begins: each reset of the time begins another count.
TEST_F(RepeatingTest, KnowsItsLength) {
  const Live after({}, kStep_us);
  const Repeating repeating(file_.path(), &after);
  EXPECT_EQ(repeating.steps(), 20 + 30);
  const auto progress = Progress::latest();
  ASSERT_TRUE(progress);
  EXPECT_EQ(progress->what, "restoring " + file_.path());
  EXPECT_EQ(progress->whole, 50);
}

TEST_F(RepeatingTest, ReportsItsProgress) {
  const Live after({}, kStep_us);
  Repeating repeating(file_.path(), &after);
  repeating.begin(world_.stage(), -1);
  repeating.turn(-1);
  repeating.turn(20);
  EXPECT_EQ(Progress::latest()->done, 20);
  repeating.begin(world_.stage(20 * kStep_us), -1);
  repeating.executed({});
  repeating.turn(-1);
  repeating.turn(7);
  EXPECT_EQ(Progress::latest()->done, 20 + 7);
}

TEST_F(RepeatingTest, IgnoresClients) {
  const Live after({}, kStep_us);
  Repeating repeating(file_.path(), &after);
  repeating.begin(world_.stage(), -1);
  const std::vector<uint8_t> command = forward();
  EXPECT_TRUE(repeating.on_message("r/velocity", command.data(), command.size()));  // and ignored
  EXPECT_NE(repeating.refusal(request_t::SPAWN, false), "");
  EXPECT_EQ(repeating.refusal(request_t::GET_STATE, true), "");
  repeating.turn(-1);
  ASSERT_EQ(repeating.turn(20).what, Mode::Turn::What::execute);
  try {
    repeating.executed(engine::Outcome::refuse(reply_t::REFUSED, "no room"));
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(),
                testing::AllOf(testing::HasSubstr(file_.path()), testing::HasSubstr("step 20"),
                               testing::HasSubstr("no room")));
  }
}

TEST_F(RepeatingTest, HandsOverToTheModeAfterIt) {
  const Live after({}, kStep_us);
  Repeating repeating(file_.path(), &after);
  repeating.begin(world_.stage(), -1);
  repeating.turn(20);
  repeating.executed({});
  repeating.begin(world_.stage(20 * kStep_us), -1);
  EXPECT_EQ(repeating.turn(30).what, Mode::Turn::What::change_mode);
}

}  // namespace
}  // namespace ruedo::run
