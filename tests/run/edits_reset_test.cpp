// Resets of the time, of the poses, and of everything after models were spawned; hostile requests;
// models that come and go for a long time.
#include <cmath>
#include <fstream>

#include <unistd.h>

#include "control_client.h"
#include "log/reader.h"
#include "ruedo/applied_t.hpp"
#include "ruedo/imu_t.hpp"
#include "ruedo/odometry_t.hpp"
#include "ruedo/pose_t.hpp"
#include "ruedo/velocity_command_t.hpp"
#include "run/repeat/verify.h"

namespace ruedo::run {
namespace {

class EditsResetTest : public testing::Test, public Controlled {
 protected:
  void drive(const std::string& robot, double v) {
    velocity_command_t command{};
    command.vx = v;
    bus.send(robot + "/velocity", engine::encoded(command));
  }
};

std::string imu() { return "<sensor name='imu' type='imu'><update_rate>50</update_rate></sensor>"; }

TEST_F(EditsResetTest, AResetOfTheTimeMovesNothing) {
  begin(paused_server(),
        robot_sdf("r", 0, 0, imu()) + box_sdf("box", "0.2 0.2 0.2", false, 5, 0, 2));
  drive("r", 0.5);
  step(50);  // 0.25 s
  const state_reply_t box = state("box"), robot = state("r");
  EXPECT_LT(box.linear[2], -2.0);
  const size_t from = bus.count();
  const reply_t reply = reset(reset_request_t::TIME);
  ASSERT_EQ(reply.code, reply_t::OK) << reply.text;
  EXPECT_EQ(reply.epoch, 1);
  EXPECT_EQ(reply.utime, 0);
  EXPECT_EQ(state("box").position[2], box.position[2]);
  EXPECT_EQ(state("box").linear[2], box.linear[2]);
  EXPECT_EQ(state("r").position[0], robot.position[0]);
  step(50);  // as if nothing had been: the box falls on, the robot drives on
  EXPECT_EQ(state().utime, 250'000);
  EXPECT_NEAR(state("box").position[2], 2 - 0.5 * 9.8 * 0.25, 0.02);
  EXPECT_NEAR(state("r").position[0], 0.25, 1e-9);
  const auto odometry = on<odometry_t>("r/odometry", from);
  ASSERT_GE(odometry.size(), 13u);
  EXPECT_EQ(odometry[0].utime, 0);
  EXPECT_NEAR(odometry[0].x, 0.125, 1e-9);  // it continues, too
  EXPECT_EQ(odometry[1].utime, 20'000);
  EXPECT_NEAR(odometry[1].x, 0.135, 1e-9);
  for (const imu_t& sample : on<imu_t>("r/imu", from))
    EXPECT_NEAR(sample.linear_acceleration[2], 9.8, 1e-6);
  int64_t last = -1;
  for (const pose_t& pose : on<pose_t>("r/pose", from)) {
    EXPECT_EQ(pose.utime, last < 0 ? 0 : last + 20'000);
    last = pose.utime;
  }
}

TEST_F(EditsResetTest, ThePosesAloneAreAsTheyWere) {
  begin(paused_server(), robot_sdf("r", 0, 0) + box_sdf("box", "0.2 0.2 0.2", false, 5, 0, 2));
  drive("r", 0.5);
  step(100);
  ASSERT_EQ(spawn(as_file(robot_sdf("guest", 0, 0)), -3, 1).code, reply_t::OK);
  drive("guest", -0.5);
  step(100);
  EXPECT_NEAR(state("guest").position[0], -3.25, 1e-9);
  const double odometry = on<odometry_t>("r/odometry").back().x;
  const reply_t reply = reset(reset_request_t::POSES);
  ASSERT_EQ(reply.code, reply_t::OK) << reply.text;
  EXPECT_EQ(reply.epoch, 0);
  EXPECT_EQ(reply.utime, 1'000'000);  // continues
  EXPECT_EQ(state("box").position[2], 2.0);
  EXPECT_EQ(state("box").linear[2], 0.0);
  EXPECT_NEAR(state("r").position[0], 0.0, 1e-12);
  EXPECT_NEAR(state("guest").position[0], -3.0, 1e-12);
  step(100);
  EXPECT_NEAR(state("r").position[0], 0.0, 1e-12);  // at rest
  EXPECT_NEAR(state("box").position[2], 2 - 0.5 * 9.8 * 0.25, 0.02);
  EXPECT_NEAR(on<odometry_t>("r/odometry").back().x, odometry, 1e-12);
}

TEST_F(EditsResetTest, AResetOfAllTakesGuestsAwayAndEqualsAFreshRun) {
  const auto go = [this] {
    drive("r", 0.5);
    return step(150).state_hash;
  };
  begin(paused_server(), robot_sdf("r", 0, 0) + box_sdf("box", "0.2 0.2 0.2", false, 2, 0, 0.1));
  const int64_t fresh = go();
  ASSERT_EQ(spawn(as_file(robot_sdf("guest", 0, 0)), -3, 1).code, reply_t::OK);
  ASSERT_EQ(remove("box").code, reply_t::OK);
  ASSERT_EQ(reset(reset_request_t::TIME).code, reply_t::OK);
  step(20);
  ASSERT_EQ(reset(reset_request_t::ALL).code, reply_t::OK);
  EXPECT_EQ(info().nrobots, 1);
  EXPECT_EQ(go(), fresh);
  EXPECT_NEAR(state("box").position[0], 2.0, 1e-3);
}

TEST_F(EditsResetTest, TheLogHoldsEachChangeWithItsStep) {
  const TemporaryFile log("edits.lcm");
  RunOptions options = paused_server();
  options.record = log.path();
  begin(options, robot_sdf("r", 0, 0));
  step(10);
  spawn(as_file(robot_sdf("guest", 0, 0)), -3, 1);
  spawn("<sdf", 0, 0);  // refused: not in the log
  step(5);
  set_pose("guest", {-4, 1, 0});
  reset(reset_request_t::TIME);
  step(5);
  remove("guest");
  end();
  log::Reader reader(log.path());
  log::Event event;
  std::vector<std::tuple<int32_t, int32_t, int64_t>> applied;  // kind, epoch, step
  int64_t last = 0;
  while (reader.next(event)) {
    EXPECT_GE(event.timestamp_us, last) << event.channel;  // never backwards
    last = event.timestamp_us;
    if (event.channel != "ruedo/applied") continue;
    const auto entry = decoded_as<applied_t>(event.data);
    applied.emplace_back(entry.kind, entry.epoch, entry.step);
  }
  const std::vector<std::tuple<int32_t, int32_t, int64_t>> expected = {{request_t::SPAWN, 0, 10},
                                                                       {request_t::SET_POSE, 0, 15},
                                                                       {request_t::RESET, 0, 15},
                                                                       {request_t::REMOVE, 1, 5}};
  EXPECT_EQ(applied, expected);
}

// Spawns, commands to spawned robots, poses, twists, partial and full resets: repeated from the
// log, they give the same bytes.
TEST_F(EditsResetTest, ARunWithChangesIsRepeatedFromItsLog) {
  const std::string models =
      robot_sdf("r", 0, 0, imu()) + box_sdf("box", "0.2 0.2 0.2", false, 2, 0, 0.1);
  const TemporaryFile log("repeat.lcm");
  RunOptions options = paused_server();
  options.record = log.path();
  begin(options, models);
  for (int epoch = 0; epoch < 2; ++epoch) {
    drive("r", 0.4);
    step(33);
    spawn(as_file(robot_sdf("guest", 0, 0, imu())), -3, 1);
    drive("guest", 0.3);
    step(50);
    set_twist("box", {0.5, 0.5, 2});
    step(20);
    set_pose("guest", {-4, 1, 0});
    drive("guest", 0.2);
    step(20);
    reset(reset_request_t::TIME);
    step(30);
    reset(reset_request_t::POSES);
    drive("guest", 0.1);
    step(30);
    remove("guest");
    spawn(as_file(robot_sdf("guest", 0, 0, imu())), 5, 1, "late");
    step(30);
    if (epoch == 0) reset(reset_request_t::ALL, 7);
  }
  end();
  RunOptions again;
  again.simulation.fleet.seed = 1;
  const Verification verification = Verifier(log.path(), load_text(models), again).run();
  EXPECT_EQ(verification.fault, "");
  EXPECT_FALSE(verification.difference)
      << verification.difference->channel << " at step " << verification.difference->step << ": "
      << verification.difference->field << " " << verification.difference->logged << " / "
      << verification.difference->repeated;
  EXPECT_GT(verification.messages, 300);
}

// The robot that the run waits for is removed and restored, and the time is reset meanwhile: the
// run continues, and no further than the messages allow while the robot exists.
TEST_F(EditsResetTest, WaitsForARobotThatIsRemovedAndRestored) {
  const TemporaryFile log("waits.lcm");
  RunOptions options = fast(1e6);
  options.wait_for = {{"r/velocity", {10, 1}}};  // each 20th step
  options.record = log.path();
  begin(options, robot_sdf("r", 0, 0));
  const auto drive_on = [&](int64_t from) {
    for (int k = 0; k < 3; ++k) drive("r", 0.5);
    const int64_t until = (from + 19) / 20 * 20 + 60;
    while (state().step < until) std::this_thread::yield();
    EXPECT_EQ(state().step, until);
  };
  const auto come_back = [&] {
    const reply_t reply = spawn(as_file(robot_sdf("r", 0, 0)), 0, 0, "r");
    EXPECT_EQ(reply.code, reply_t::OK) << reply.text;
    drive_on(decoded_as<state_reply_t>(reply.body).step);
    EXPECT_GT(state("r").position[0], 0.05);
  };
  drive_on(0);
  remove("r");
  while (state().step < 500) std::this_thread::yield();
  come_back();
  remove("r");
  EXPECT_EQ(reset(reset_request_t::TIME).code, reply_t::OK);
  come_back();
  end();
  const Verification verification =
      Verifier(log.path(), load_text(robot_sdf("r", 0, 0)), RunOptions()).run();
  EXPECT_EQ(verification.fault, "");
  EXPECT_FALSE(verification.difference);
}

// Each is answered with its error; nothing stops, and nothing changes.
TEST_F(EditsResetTest, HostileRequestsGetAnErrorText) {
  begin(paused_server(), robot_sdf("r", 0, 0) + box_sdf("box", "0.2 0.2 0.2", false, 2, 0, 0.1));
  step(10);
  const state_reply_t before = state();
  const double nan = std::nan("");
  struct Case {
    reply_t reply;
    int32_t code;
    std::string words;
  };
  const std::string good = as_file(robot_sdf("guest", 0, 0));
  const auto with = [&](auto change) {
    spawn_request_t body = spawning(good, 5, 5);
    change(body);
    return spawn(body);
  };
  std::string deep, many;
  for (int i = 0; i < 20'000; ++i) deep += "<model name='a'>";
  for (int i = 0; i < 3'000; ++i) many += "<link name='l" + std::to_string(i) + "'/>";
  const std::vector<Case> cases = {
      {spawn("", 0, 0), reply_t::BAD_REQUEST, "either a model's name or file, or a text"},
      {with([](auto& body) { body.model = "p3at"; }), reply_t::BAD_REQUEST, "either"},
      {spawn("garbage", 5, 5), reply_t::BAD_REQUEST, "the text"},
      {spawn("<sdf version='1.9'>\n<model name='m'>\n<link></link></model></sdf>", 5, 5),
       reply_t::BAD_REQUEST, "one without a link"},
      {spawn("<sdf version='1.9'></sdf>", 5, 5), reply_t::BAD_REQUEST, "holds no <model>"},
      {spawn("<sdf version='1.9'><world name='w'/></sdf>", 5, 5), reply_t::BAD_REQUEST,
       "is a world"},
      {spawn(as_file("<light name='lamp' type='point'/>"), 5, 5), reply_t::BAD_REQUEST,
       "holds a <light> and no <model>"},
      {spawn(as_file("<actor name='walker'/>"), 5, 5), reply_t::BAD_REQUEST,
       "holds an <actor> and no <model>"},
      {spawn("<html/>", 5, 5), reply_t::BAD_REQUEST, "the text:1"},
      {spawn("<robot name='r'></robot>", 5, 5), reply_t::BAD_REQUEST, "the text"},
      {spawn("<!DOCTYPE a [<!ENTITY b 'cc'>]><sdf version='1.9'>&b;</sdf>", 5, 5),
       reply_t::BAD_REQUEST, "the text"},
      {spawn(as_file(deep), 5, 5), reply_t::BAD_REQUEST, "the text"},
      {spawn(as_file("<model name='m'>" + many + "</model>"), 5, 5), reply_t::BAD_REQUEST,
       "allowed are 1000"},
      {spawn(as_file(robot_sdf(
                 "guest", 0, 0,
                 "<sensor name='s' type='ray'><ruedo:nonsense>1</ruedo:nonsense><ray/></sensor>")),
             5, 5),
       reply_t::BAD_REQUEST, "nonsense"},
      {spawn(as_file(robot_sdf("guest", 0, 0,
                               "<sensor name='" + std::string(70, 's') + "' type='imu'/>")),
             5, 5),
       reply_t::BAD_REQUEST, "63"},
      {with([](auto& body) { body.text.clear(), body.model = "/etc/passwd"; }),
       reply_t::BAD_REQUEST, "folders that are searched"},
      {with([](auto& body) { body.text.clear(), body.model = "../../../../etc/passwd"; }),
       reply_t::BAD_REQUEST, "folders that are searched"},
      {with([](auto& body) { body.text.clear(), body.model = "file:///etc/passwd"; }),
       reply_t::BAD_REQUEST, "folders that are searched"},
      {with([](auto& body) { body.text.clear(), body.model = "nosuchrobot"; }),
       reply_t::BAD_REQUEST, "nosuchrobot"},
      {with([](auto& body) { body.name = "ruedo"; }), reply_t::BAD_REQUEST, "reserved for Ruedo"},
      {with([](auto& body) { body.name = "a/b"; }), reply_t::BAD_REQUEST, "not fit for a channel"},
      {with([](auto& body) { body.name = "a b"; }), reply_t::BAD_REQUEST, "not fit for a channel"},
      {with([](auto& body) { body.name = "\xff\xfe"; }), reply_t::BAD_REQUEST, "not UTF-8 text"},
      {with([](auto& body) { body.name = "a\nb"; }), reply_t::BAD_REQUEST, "not UTF-8 text"},
      {with([](auto& body) { body.name = std::string(256, 'n'); }), reply_t::BAD_REQUEST,
       "256 bytes"},
      {with([](auto& body) { body.name = std::string(60, 'n'); }), reply_t::BAD_REQUEST, "63"},
      {with([](auto& body) { body.name = "r"; }), reply_t::REFUSED, "taken"},
      {with([&](auto& body) { body.position[1] = nan; }), reply_t::BAD_REQUEST, "finite"},
      {with([&](auto& body) { body.position[0] = 1e300; }), reply_t::BAD_REQUEST,
       "up to 1000000 m"},
      {with([&](auto& body) { body.orientation[0] = 0; }), reply_t::BAD_REQUEST, "unit quaternion"},
      {with([&](auto& body) { body.orientation[2] = nan; }), reply_t::BAD_REQUEST,
       "unit quaternion"},
      {set_pose("nobody", {0, 0, 0}), reply_t::UNKNOWN_NAME, "nobody"},
      {set_pose("box", {nan, 0, 0}), reply_t::BAD_REQUEST, "finite"},
      {set_pose("box", {0, 0, 0}, Quat(2, 0, 0, 0)), reply_t::BAD_REQUEST, "unit quaternion"},
      {set_twist("box", {HUGE_VAL, 0, 0}), reply_t::BAD_REQUEST, "finite"},
      {set_twist("box", {0, 2e3, 0}), reply_t::BAD_REQUEST, "up to 1000 m/s"},
      {set_twist("box", {0, 0, 0}, {0, 0, 1e9}), reply_t::BAD_REQUEST, "rad/s"},
      {remove("nobody"), reply_t::UNKNOWN_NAME, "nobody"},
      {remove(""), reply_t::UNKNOWN_NAME, ""},
      {reset(7), reply_t::BAD_REQUEST, "kind 7"},
      {reset(reset_request_t::POSES, 5), reply_t::BAD_REQUEST, "seed"},
      {ask(request_t::SPAWN, {1, 2, 3}), reply_t::BAD_REQUEST, "spawn_request_t"},
      {ask(request_t::SET_POSE, std::vector<uint8_t>(100, 0xff)), reply_t::BAD_REQUEST,
       "set_pose_request_t"},
      {ask(request_t::SET_TWIST), reply_t::BAD_REQUEST, "set_twist_request_t"},
      {ask(request_t::REMOVE), reply_t::BAD_REQUEST, "name_request_t"},
  };
  for (size_t i = 0; i < cases.size(); ++i) {
    EXPECT_EQ(cases[i].reply.code, cases[i].code) << i << ": " << cases[i].reply.text;
    EXPECT_NE(cases[i].reply.text.find(cases[i].words), std::string::npos)
        << i << ": " << cases[i].reply.text;
  }
  EXPECT_EQ(state().state_hash, before.state_hash);
  EXPECT_EQ(info().nrobots, 1);
  EXPECT_EQ(spawn(good, 5, 5).code, reply_t::OK);  // and it still executes requests
  EXPECT_EQ(step(10).step, 20);
}

size_t resident_kB() {
  std::ifstream file("/proc/self/statm");
  size_t pages = 0, resident = 0;
  file >> pages >> resident;
  return resident * static_cast<size_t>(::sysconf(_SC_PAGESIZE)) / 1024;
}

TEST_F(EditsResetTest, ModelsComeAndGoWithoutGrowth) {
  begin(paused_server(), robot_sdf("r", 0, 0));
  bus.keep = true;
  const auto cycle = [&](int i) {
    ASSERT_EQ(
        spawn(as_file(robot_sdf("guest", 0, 0, imu())), 3, 0, "guest" + std::to_string(i)).code,
        reply_t::OK);
    ASSERT_EQ(spawn(as_file(box_sdf("box", "1 1 1", true)), 6, i % 5).code, reply_t::OK);
    step(2);
    ASSERT_EQ(remove("guest" + std::to_string(i)).code, reply_t::OK);
    ASSERT_EQ(remove("box").code, reply_t::OK);
    if (i % 20 == 0) bus.forget(), rewind();
  };
  for (int i = 0; i < 40; ++i) cycle(i);
  const world_info_t then = info();
  const size_t memory_then = resident_kB();
  for (int i = 40; i < 240; ++i) cycle(i);
  const world_info_t now = info();
  EXPECT_EQ(now.nbodies, then.nbodies);
  EXPECT_EQ(now.nchannels, then.nchannels);
  EXPECT_EQ(now.nrobots, 1);
#if !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)  // they keep what was freed for a while, and shadows of it
  EXPECT_LT(resident_kB(), memory_then + 4096);
#endif
}

}  // namespace
}  // namespace ruedo::run
