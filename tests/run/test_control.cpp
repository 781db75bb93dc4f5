// Requests over the bus: pause, step, reset, exactly once; and malformed commands.
#include <algorithm>
#include <atomic>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "control_client.h"
#include "ruedo/decode.h"
#include "ruedo/join_t.hpp"
#include "ruedo/joint_command_t.hpp"
#include "ruedo/move_command_t.hpp"
#include "ruedo/name_request_t.hpp"
#include "ruedo/odometry_t.hpp"
#include "ruedo/pose_t.hpp"
#include "ruedo/rate_request_t.hpp"
#include "ruedo/reset_request_t.hpp"
#include "ruedo/state_reply_t.hpp"
#include "ruedo/step_request_t.hpp"
#include "ruedo/velocity_command_t.hpp"
#include "ruedo/wheel_command_t.hpp"
#include "ruedo/world_info_t.hpp"

namespace ruedo::run {
namespace {

template <class T>
T decoded(const std::vector<uint8_t>& bytes) {
  return decoded_as<T>(bytes);
}

class ControlTest : public testing::Test, protected Controlled {
 protected:
  void begin(RunOptions options, const std::string& models = robot_sdf("r", 0, 0)) {
    start(std::move(options), models);
  }
  void join() {
    const reply_t reply = Controlled::join();
    ASSERT_EQ(reply.code, reply_t::OK) << reply.text;
    EXPECT_EQ(Controlled::join().session, reply.session);  // a repeated JOIN: the same session
  }
  reply_t step(int64_t steps) { return ask(stepping(steps)); }
  std::vector<reply_t> last_words() {
    std::vector<reply_t> found;
    for (const Message& message : bus_.messages()) {
      if (message.channel != "ruedo/reply") continue;
      const reply_t reply = decoded<reply_t>(message.bytes);
      if (reply.code == reply_t::ENDED) found.push_back(reply);
    }
    return found;
  }

  MemoryBus& bus_ = bus;
};

RunOptions paused() { return paused_server(); }

TEST_F(ControlTest, StartsPausedAndSteps) {
  begin(paused());
  join();
  reply_t reply = step(1);
  ASSERT_EQ(reply.code, reply_t::OK) << reply.text;
  EXPECT_EQ(reply.utime, 5000);
  EXPECT_EQ(decoded<state_reply_t>(reply.body).step, 1);
  reply = step(99);
  EXPECT_EQ(decoded<state_reply_t>(reply.body).step, 100);
  // All messages of the steps are out before the reply: poses at 0, 20, ... 500 ms.
  int poses = 0;
  for (const Message& message : bus_.messages()) poses += message.channel == "r/pose";
  EXPECT_EQ(poses, 26);
  reply = step(0);
  EXPECT_EQ(reply.code, reply_t::BAD_REQUEST);
}

TEST_F(ControlTest, PausesAndResumes) {
  RunOptions options;
  options.rate = std::numeric_limits<double>::infinity();
  begin(options);
  join();
  const reply_t paused = ask(request_t::PAUSE);
  ASSERT_EQ(paused.code, reply_t::OK);
  const int64_t step_then = decoded<state_reply_t>(paused.body).step;
  const auto poses = [this] {
    return std::ranges::count(bus_.messages(), std::string("r/pose"), &Message::channel);
  };
  const auto poses_then = poses();
  for (int i = 0; i < 20;
       ++i) {  // each answer is a round of the server, in which it could have gone on
    const reply_t again = ask(request_t::PAUSE);
    EXPECT_EQ(decoded<state_reply_t>(again.body).step, step_then);
  }
  EXPECT_EQ(poses(), poses_then);
  EXPECT_EQ(step(1).utime, (step_then + 1) * 5000);
  EXPECT_EQ(ask(request_t::RESUME).code, reply_t::OK);
  EXPECT_EQ(step(1).code, reply_t::REFUSED);  // not paused
}

TEST_F(ControlTest, ExecutesEachRequestOnce) {
  begin(paused());
  join();
  step_request_t body;
  body.steps = 10;
  const request_t request = this->request(request_t::STEP, engine::encoded(body));
  const reply_t first = ask(request);
  for (int i = 0; i < 5; ++i) {
    const reply_t repeated = ask(request);
    EXPECT_EQ(repeated.utime, first.utime);
    EXPECT_EQ(repeated.body, first.body);
  }
  EXPECT_EQ(decoded<state_reply_t>(step(1).body).step, 11);
  for (int i = 0; i < 40; ++i) step(1);  // more than the replies that are kept
  EXPECT_EQ(ask(request).code, reply_t::OLD_SEQUENCE);
  EXPECT_EQ(decoded<state_reply_t>(step(1).body).step, 52);
}

TEST_F(ControlTest, RefusesOtherRunsEpochsAndSessions) {
  begin(paused());
  join();
  request_t other = request(request_t::PAUSE);
  other.run_id = server().run_id() ^ 1;
  EXPECT_EQ(ask(other).code, reply_t::WRONG_RUN);
  other = request(request_t::PAUSE);
  other.epoch = 7;
  EXPECT_EQ(ask(other).code, reply_t::WRONG_EPOCH);
  other = request(request_t::PAUSE);
  other.session ^= 1;
  EXPECT_EQ(ask(other).code, reply_t::UNKNOWN_SESSION);
  EXPECT_EQ(ask(999).code, reply_t::NOT_SUPPORTED);
  EXPECT_EQ(ask(request_t::STEP, {1, 2, 3}).code, reply_t::BAD_REQUEST);
  for (const double value : {std::nan(""), 0.0, -1.0, 1e-310, 9e-5, 1.1e6, 1e308}) {
    rate_request_t rate;
    rate.rate = value;
    EXPECT_EQ(ask(request_t::RATE, engine::encoded(rate)).code, reply_t::BAD_REQUEST) << value;
  }
  name_request_t name;
  name.name = "nobody";
  EXPECT_EQ(ask(request_t::GET_STATE, engine::encoded(name)).code, reply_t::UNKNOWN_NAME);
}

TEST_F(ControlTest, ResetEqualsAFreshRun) {
  begin(paused());
  join();
  velocity_command_t command{};
  command.vx = 0.5;
  const auto drive = [&] {
    bus_.send("r/velocity", engine::encoded(command));
    return decoded<state_reply_t>(step(200).body);
  };
  const state_reply_t first = drive();
  name_request_t name;
  name.name = "r";
  EXPECT_NEAR(
      decoded<state_reply_t>(ask(request_t::GET_STATE, engine::encoded(name)).body).position[0],
      0.5, 1e-9);
  reset_request_t reset;
  reset.what = reset_request_t::ALL;
  reset.seed = -1;
  const request_t request = this->request(request_t::RESET, engine::encoded(reset));
  const reply_t reply = ask(request);
  ASSERT_EQ(reply.code, reply_t::OK) << reply.text;
  EXPECT_EQ(reply.epoch, 1);
  EXPECT_EQ(decoded<state_reply_t>(reply.body).step, 0);
  EXPECT_EQ(ask(request).epoch, 1);  // a repeated reset is not a second one
  const state_reply_t second = drive();
  EXPECT_EQ(first.step, second.step);
  EXPECT_EQ(first.state_hash, second.state_hash);
}

TEST_F(ControlTest, InfoDescribesTheWholeRun) {
  begin(paused());
  size_t from = 0;
  const auto info = decoded<world_info_t>(bus_.wait_for("ruedo/info", from).bytes);
  EXPECT_EQ(info.world, "test");
  EXPECT_EQ(info.step_us, 5000);
  EXPECT_TRUE(info.paused);
  ASSERT_EQ(info.nrobots, 1);
  EXPECT_EQ(info.robots[0].drive, "kinematic");
  EXPECT_DOUBLE_EQ(info.robots[0].wheel_radius, 0.1);
  EXPECT_DOUBLE_EQ(info.robots[0].track, 0.4);
  EXPECT_TRUE(info.features >> request_t::STEP & 1);
  EXPECT_FALSE(info.features >> request_t::SNAPSHOT & 1);
  EXPECT_GE(info.ndevices, 3);
  bool velocity = false;
  for (const channel_info_t& channel : info.channels) {
    if (channel.name != "r/velocity") continue;
    velocity = channel.input && channel.type == "velocity_command_t" &&
               channel.fingerprint == velocity_command_t::getHash();
  }
  EXPECT_TRUE(velocity);
}

std::vector<uint8_t> with_bytes(std::vector<uint8_t> bytes, size_t at,
                                const std::vector<uint8_t>& replacement) {
  std::copy(replacement.begin(), replacement.end(),
            bytes.begin() + static_cast<std::ptrdiff_t>(at));
  return bytes;
}

// Malformed messages: each is counted, nothing stops, and the last valid command stays in effect.
TEST_F(ControlTest, SurvivesHostileMessages) {
  begin(paused());
  join();
  velocity_command_t good{};
  good.vx = 0.25;
  bus_.send("r/velocity", engine::encoded(good));
  step(10);

  const std::vector<uint8_t> velocity = engine::encoded(good);
  wheel_command_t wheels_message;
  wheels_message.utime = 0;
  wheels_message.rate = {1.0, 1.0};
  wheels_message.n = 2;
  const std::vector<uint8_t> wheels = engine::encoded(wheels_message);
  const std::vector<uint8_t> move = engine::encoded(move_command_t{});
  joint_command_t joints_message;
  joints_message.utime = 0;
  joints_message.n = 1;
  joints_message.name = {"j"};
  joints_message.mode = {0};
  joints_message.value = {0.0};
  const std::vector<uint8_t> joints = engine::encoded(joints_message);
  const auto cut = [](std::vector<uint8_t> bytes, size_t size) {
    bytes.resize(size);
    return bytes;
  };
  const std::vector<std::pair<const char*, std::vector<uint8_t>>> table = {
      {"r/velocity", {}},
      {"r/velocity", {0}},
      {"r/velocity", cut(velocity, 7)},
      {"r/velocity", cut(velocity, 8)},
      {"r/velocity", cut(velocity, velocity.size() - 1)},
      {"r/velocity", cut(velocity, velocity.size() + 1)},
      {"r/velocity", std::vector<uint8_t>(40, 0xff)},
      {"r/velocity", std::vector<uint8_t>(100'000, 0)},
      {"r/velocity", with_bytes(velocity, 0, {0})},
      {"r/velocity", wheels},
      {"r/velocity", move},
      {"r/wheels", velocity},
      {"r/wheels", with_bytes(wheels, 16, {0x7f, 0xff, 0xff, 0xff})},  // n = 2^31 - 1
      {"r/wheels", with_bytes(wheels, 16, {0x80, 0, 0, 0})},           // n = -2^31
      {"r/wheels", with_bytes(wheels, 16, {0xff, 0xff, 0xff, 0xff})},  // n = -1
      {"r/wheels", with_bytes(wheels, 16, {0x20, 0, 0, 0})},           // 8 n = 2^32
      {"r/wheels", with_bytes(wheels, 16, {0, 0, 0, 3})},
      {"r/wheels", with_bytes(wheels, 16, {0, 0, 0, 1})},
      {"r/wheels", cut(wheels, 20)},
      {"r/move", cut(move, move.size() - 8)},
      {"r/move", velocity},
      {"r/move", std::vector<uint8_t>(8, 0)},
  };
  for (const auto& [channel, bytes] : table) {
    const uint64_t before = server().inbox().refused();
    bus_.send(channel, bytes);
    EXPECT_EQ(server().inbox().refused(), before + 1)
        << channel << " with " << bytes.size() << " bytes";
  }
  // On other channels, or for robots that do not exist: ignored.
  bus_.send("nobody/velocity", velocity);
  bus_.send("", {});
  bus_.send("r/joint_command", with_bytes(joints, 20, {0x7f, 0xff, 0xff, 0xff}));
  // The robot refuses values that are not finite; its last valid command stays in effect.
  for (const double bad : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
    velocity_command_t command = good;
    command.vx = bad;
    bus_.send("r/velocity", engine::encoded(command));
  }
  // Malformed requests.
  for (const auto& bytes : {std::vector<uint8_t>{}, std::vector<uint8_t>(8, 0xff), velocity})
    bus_.send("ruedo/request", bytes);
  std::vector<uint8_t> bad = engine::encoded(request(request_t::PAUSE));
  bus_.send("ruedo/request", with_bytes(bad, bad.size() - 4, {0x7f, 0xff, 0xff, 0xff}));
  bus_.send("ruedo/request", std::vector<uint8_t>(2'000'000, 1));

  ASSERT_EQ(step(190).code, reply_t::OK);
  name_request_t name;
  name.name = "r";
  const auto state = decoded<state_reply_t>(ask(request_t::GET_STATE, engine::encoded(name)).body);
  EXPECT_NEAR(state.position[0], 0.25, 1e-9);  // 1 s at 0.25 m/s, without a gap
}

// A flood displaces only the sender's own commands: the newest ones count.
TEST_F(ControlTest, KeepsTheNewestCommands) {
  begin(paused());
  join();
  velocity_command_t command{};
  for (int i = 0; i < 100'000; ++i) {
    command.vx = i == 99'999 ? 0.1 : 2.0;
    bus_.send("r/velocity", engine::encoded(command));
  }
  step(200);
  EXPECT_EQ(server().inbox().displaced(), 100'000u - engine::CommandInbox::kKeptPerRobot);
  name_request_t name;
  name.name = "r";
  EXPECT_NEAR(
      decoded<state_reply_t>(ask(request_t::GET_STATE, engine::encoded(name)).body).position[0],
      0.1, 1e-9);
}

TEST_F(ControlTest, QuitEndsTheRun) {
  RunOptions options;
  options.rate = std::numeric_limits<double>::infinity();
  begin(options);
  join();
  EXPECT_EQ(ask(request_t::QUIT).code, reply_t::OK);
  wait();
  EXPECT_EQ(last_words().size(), 1u);
}

TEST_F(ControlTest, ControlOff) {
  RunOptions options = fast(0.1);
  options.control = false;
  begin(options);
  bus_.send("ruedo/request", engine::encoded(request(request_t::PAUSE)));
  wait();
  EXPECT_EQ(last_words().size(), 1u);
  for (const Message& message : bus_.messages()) {
    if (message.channel != "ruedo/reply") continue;
    EXPECT_EQ(decoded<reply_t>(message.bytes).code, reply_t::ENDED);
  }
}

TEST_F(ControlTest, TheLastMessageOfARunReportsItsEnd) {
  begin(paused());
  join();
  const int64_t run_id = info().run_id;
  end();
  EXPECT_EQ(bus_.messages().back().channel, "ruedo/reply");
  ASSERT_EQ(last_words().size(), 1u);
  const reply_t last = last_words().front();
  EXPECT_EQ(last.run_id, run_id);
  EXPECT_EQ(last.session, 0);
  EXPECT_EQ(last.sequence, 0);
  EXPECT_EQ(last.kind, 0);
  EXPECT_THAT(last.text, testing::StartsWith("the run has ended at step "));
}

TEST_F(ControlTest, RepeatsTheLastMessageOnALossyBus) {
  bus_.loses = true;
  begin(fast(0.1));
  wait();
  EXPECT_EQ(last_words().size(), 3u);
}

// Requests that come faster than they are served.
TEST(Control, FewRequestsWait) {
  size_t executed = 0;
  std::vector<reply_t> replies;
  Control control(7, {.execute =
                          [&](const request_t&, const Session&) {
                            ++executed;
                            return engine::Outcome{};
                          },
                      .state = [] { return std::vector<uint8_t>(); },
                      .publish = [&](const reply_t& reply) { replies.push_back(reply); },
                      .utime = [] { return int64_t{0}; },
                      .epoch = [] { return 1; },
                      .state_comes = [] { return false; }});
  request_t asked{};
  asked.kind = request_t::INFO;
  const auto served = [&](size_t body, size_t times) {
    asked.body.assign(body, 0);
    asked.size = static_cast<int32_t>(body);
    const std::vector<uint8_t> bytes = engine::encoded(asked);
    for (size_t i = 0; i < times; ++i) EXPECT_TRUE(control.on_request(bytes.data(), bytes.size()));
    control.serve();
    return std::exchange(executed, 0);
  };
  EXPECT_EQ(served(0, Control::kMostWaiting + 1), Control::kMostWaiting);
  const size_t large = Control::kMaxRequestSize - 1000;
  EXPECT_EQ(served(large, 20), Control::kMostWaitingBytes / (large + 1000));
  EXPECT_EQ(served(0, 1), 1U);  // there is room again
  EXPECT_TRUE(replies.empty());
  EXPECT_EQ(served(Control::kMaxRequestSize, 1), 0U);
  ASSERT_EQ(replies.size(), 1U);
  EXPECT_EQ(replies[0].code, reply_t::BAD_REQUEST);
  EXPECT_EQ(replies[0].text, "its body has 1048576 bytes: a request has 1048576 at most");
}

// Without a server: the world's first state is late, and requests wait for it in order.
TEST(Control, WaitsForTheFirstState) {
  bool state_comes = true;
  std::vector<int32_t> executed;
  std::vector<reply_t> replies;
  Control control(7, {.execute =
                          [&](const request_t& request, const Session&) {
                            executed.push_back(request.kind);
                            return engine::Outcome{};
                          },
                      .state = [] { return std::vector<uint8_t>{}; },
                      .publish = [&](const reply_t& reply) { replies.push_back(reply); },
                      .utime = [] { return int64_t{0}; },
                      .epoch = [] { return 1; },
                      .state_comes = [&] { return state_comes; }});
  request_t request{};
  request.epoch = -1;
  const auto ask = [&](int32_t kind, const std::vector<uint8_t>& body = {}) {
    request.kind = kind;
    request.body = body;
    request.size = static_cast<int32_t>(body.size());
    ++request.sequence;
    const std::vector<uint8_t> bytes = engine::encoded(request);
    EXPECT_TRUE(control.on_request(bytes.data(), bytes.size()));
  };
  join_t joining;
  joining.client = "early";
  ask(request_t::JOIN, engine::encoded(joining));
  control.serve();
  ASSERT_EQ(replies.size(), 1U);
  request.session = replies[0].session;
  request.sequence = 0;
  ask(request_t::GET_STATE);
  ask(request_t::QUIT);
  control.serve();
  ask(request_t::SPAWN);
  control.serve();
  EXPECT_EQ(executed, std::vector<int32_t>{});
  state_comes = false;  // it is there
  control.serve();
  EXPECT_EQ(executed,
            (std::vector<int32_t>{request_t::GET_STATE, request_t::QUIT, request_t::SPAWN}));
  EXPECT_EQ(replies.size(), 4U);
  state_comes = true;  // it was reset; few requests wait, and the others have to be repeated
  executed.clear();
  for (size_t i = 0; i < Control::kMostHeld + 3; ++i) ask(request_t::GET_STATE);
  control.serve();
  state_comes = false;
  control.serve();
  EXPECT_EQ(executed.size(), Control::kMostHeld);
}

}  // namespace
}  // namespace ruedo::run
