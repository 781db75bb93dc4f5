// Models that come and go while a world runs: spawn, remove, set pose and twist, over the bus.
#include <cmath>
#include <sstream>

#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include "control_client.h"
#include "ruedo/fault_t.hpp"
#include "ruedo/odometry_t.hpp"
#include "ruedo/planar_lidar_t.hpp"
#include "ruedo/pose_t.hpp"
#include "ruedo/velocity_command_t.hpp"
#include "ruedo/world_state_t.hpp"

namespace ruedo::run {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

class EditsTest : public testing::Test, public Controlled {
 protected:
  void drive(const std::string& robot, double v) {
    velocity_command_t command{};
    command.vx = v;
    bus.send(robot + "/velocity", engine::encoded(command));
  }
};

// One ray ahead from 0.1 m above the ground, 10 Hz.
std::string one_ray() {
  return "<sensor name='lrf' type='ray'><pose>0 0 0 0 0 "
         "0</pose><update_rate>10</update_rate><ray><scan><horizontal><samples>1</samples>"
         "<min_angle>0</min_angle><max_angle>0</max_angle></horizontal></scan><range><min>0.01</"
         "min><max>20</max></range></ray></sensor>";
}

std::string noisy_ray() {
  std::string ray = one_ray();
  return ray.insert(ray.find("</ray>"),
                    "<noise><type>gaussian</type><mean>0</mean><stddev>0.05</stddev></noise>");
}

// As ROS 2 and Foxglove: they get records, but the run was made without a recorder, so that it has
// no header of a log.
class Onlooker : public Sink {
 public:
  Hears hears() const override { return {.samples = false, .records = true}; }
  void message(const Published& message) override {
    headers_ += message.channel == "ruedo/header";
    changes_ += message.channel == "ruedo/applied";
  }
  int headers_ = 0, changes_ = 0;
};

TEST_F(EditsTest, AnOnlookerSeesTheChangeAndNoLogHeader) {
  Onlooker onlooker;
  begin(paused_server(), robot_sdf("r", 0, 0), &onlooker);
  step(10);
  spawn_request_t file = spawning("", 2, 1);
  file.model = "p3dx";  // of which files are read, which a log's header would name
  EXPECT_EQ(spawn(file).code, reply_t::OK);
  step(10);
  end();
  EXPECT_EQ(onlooker.changes_, 1);
  EXPECT_EQ(onlooker.headers_, 0);
}

TEST_F(EditsTest, ASpawnedRobotIsThereAndDrives) {
  begin(paused_server(), robot_sdf("r", 0, 0));
  step(10);
  const reply_t reply = spawn(as_file(robot_sdf("guest", 0, 0, one_ray())), 2, 1);
  ASSERT_EQ(reply.code, reply_t::OK) << reply.text;
  EXPECT_NEAR(state("guest").position[0], 2.0, 1e-12);  // at once, before any step
  EXPECT_NEAR(state("guest").position[1], 1.0, 1e-12);
  EXPECT_NEAR(state("guest").position[2], 0.0, 1e-9);  // its wheels are at 0.1 +- 0.1

  const world_info_t info = this->info();
  ASSERT_EQ(info.nrobots, 2);
  EXPECT_EQ(info.robots[1].name, "guest");
  int inputs = 0, devices = 0;
  for (const channel_info_t& channel : info.channels)
    inputs += channel.robot == "guest" && channel.input;
  for (const device_info_t& device : info.devices) devices += device.robot == "guest";
  EXPECT_EQ(inputs, 4);   // velocity, wheels, move, fault
  EXPECT_EQ(devices, 5);  // odometry, collisions, pose, motion, lrf

  const size_t from = bus.count();
  drive("guest", 0.5);
  step(200);
  EXPECT_NEAR(state("guest").position[0], 2.5, 1e-9);
  EXPECT_NEAR(state("r").position[0], 0.0, 1e-12);
  // Samples count from the step that first showed the robot: 11, then every 20 ms.
  const auto poses = on<pose_t>("guest/pose", from);
  ASSERT_EQ(poses.size(), 50u);
  EXPECT_EQ(poses[0].utime, 55'000);
  EXPECT_EQ(poses[1].utime, 75'000);
  const auto scans = on<planar_lidar_t>("guest/lrf", from);
  ASSERT_EQ(scans.size(), 10u);
  EXPECT_EQ(scans[1].utime, 155'000);
  EXPECT_NEAR(on<odometry_t>("guest/odometry", from).back().x,
              on<pose_t>("guest/pose", from).back().pos[0] - 2.0, 1e-9);
}

// The next robot of the same model takes the removed one's place in all lists.
TEST_F(EditsTest, EachSpawnedRobotReportsItsWatchdog) {
  std::ostringstream log;
  const auto former = spdlog::default_logger();
  spdlog::set_default_logger(std::make_shared<spdlog::logger>(
      "test", std::make_shared<spdlog::sinks::ostream_sink_mt>(log)));
  std::string sdf = robot_sdf("guest", 0, 0);
  sdf.replace(sdf.find("<ruedo:watchdog>0"), 17, "<ruedo:watchdog>0.1");
  begin(paused_server(), robot_sdf("r", 0, 0));
  step(1);
  for (const std::string name : {"first", "second", "second"}) {
    ASSERT_EQ(spawn(as_file(sdf), 2, 1, name).code, reply_t::OK);
    drive(name, 0.5);
    step(100);
    ASSERT_EQ(remove(name).code, reply_t::OK);
  }
  end();
  spdlog::set_default_logger(former);
  const auto told = [&](const std::string& name) {
    const std::string text = log.str(), words = name + " was stopped by its watchdog";
    size_t count = 0;
    for (size_t at = text.find(words); at != text.npos; at = text.find(words, at + 1)) ++count;
    return count;
  };
  EXPECT_EQ(told("first"), 1u) << log.str();
  EXPECT_EQ(told("second"), 1u) << log.str();
}

TEST_F(EditsTest, RaysHitSpawnedModelsAndNoRemovedOnes) {
  begin(paused_server(), robot_sdf("r", 0, 0, one_ray()));
  const auto range = [&] {
    const size_t from = bus.count();
    step(20);
    return on<planar_lidar_t>("r/lrf", from).back().ranges.at(0);
  };
  EXPECT_EQ(range(), static_cast<float>(kInfinity));
  ASSERT_EQ(spawn(as_file(box_sdf("wall", "0.2 2 1", true)), 3, 0).code, reply_t::OK);
  EXPECT_NEAR(range(), 2.9, 1e-6);
  ASSERT_EQ(spawn(as_file(box_sdf("crate", "0.5 0.5 0.5", false)), 1.5, 0).code, reply_t::OK);
  EXPECT_NEAR(range(), 1.25, 1e-4);  // it settles
  ASSERT_EQ(remove("crate").code, reply_t::OK);
  EXPECT_NEAR(range(), 2.9, 1e-6);
  ASSERT_EQ(remove("wall").code, reply_t::OK);
  EXPECT_EQ(range(), static_cast<float>(kInfinity));
  // In the slot of the removed one, at another place.
  ASSERT_EQ(spawn(as_file(box_sdf("wall", "0.2 2 1", true)), 5, 0).code, reply_t::OK);
  EXPECT_NEAR(range(), 4.9, 1e-6);
}

TEST_F(EditsTest, ARemovedRobotIsSilentAndItsNameFree) {
  begin(paused_server(), robot_sdf("r", 0, 0) + robot_sdf("s", 3, 0, one_ray()));
  step(20);
  ASSERT_EQ(remove("s").code, reply_t::OK);
  const size_t from = bus.count();
  step(100);
  for (const Message& message : bus.messages()) static_cast<void>(message);
  EXPECT_TRUE(on<pose_t>("s/pose", from).empty());
  EXPECT_TRUE(on<planar_lidar_t>("s/lrf", from).empty());
  for (const auto& world : on<world_state_t>("ruedo/world", from)) EXPECT_EQ(world.n, 1);
  const world_info_t info = this->info();
  EXPECT_EQ(info.nrobots, 1);
  for (const body_info_t& body : info.bodies)
    EXPECT_EQ(body.name.find("s/"), std::string::npos) << body.name;
  name_request_t name;
  name.name = "s";
  EXPECT_EQ(ask(request_t::GET_STATE, engine::encoded(name)).code, reply_t::UNKNOWN_NAME);
  EXPECT_EQ(remove("s").code, reply_t::UNKNOWN_NAME);
  ASSERT_EQ(spawn(as_file(robot_sdf("s", 0, 0)), 3, 0).code, reply_t::OK);
  step(20);
  EXPECT_FALSE(on<pose_t>("s/pose", from).empty());
}

TEST_F(EditsTest, ABodyOnARemovedModelFalls) {
  begin(paused_server(), box_sdf("table", "1 1 1", true, 0, 0, 0.5) +
                             box_sdf("cup", "0.2 0.2 0.2", false, 0, 0, 1.1) +
                             robot_sdf("r", 3, 0));
  step(600);  // 3 s: it sleeps
  EXPECT_NEAR(state("cup").position[2], 1.1, 2e-3);
  ASSERT_EQ(remove("table").code, reply_t::OK);
  step(400);
  EXPECT_NEAR(state("cup").position[2], 0.1, 2e-3);
  ASSERT_EQ(remove("ground").code,
            reply_t::OK);  // the plane that the robot stands on without a contact
  step(100);
  EXPECT_NEAR(state("r").position[2], -0.5 * 9.8 * 0.25, 0.03);  // 0.5 s of fall
}

TEST_F(EditsTest, RefusesToPutItIntoSomething) {
  begin(paused_server(), robot_sdf("r", 0, 0) + box_sdf("crate", "1 1 1", false, 3, 0, 0.5));
  const std::string robot = as_file(robot_sdf("guest", 0, 0));
  reply_t reply = spawn(robot, 0.2, 0);
  EXPECT_EQ(reply.code, reply_t::REFUSED);
  EXPECT_NE(reply.text.find("it would stand in 'r'"), std::string::npos) << reply.text;
  EXPECT_EQ(spawn(robot, 3, 0).code, reply_t::REFUSED);
  ASSERT_EQ(set_pose("crate", {6, 0, 0.5}).code,
            reply_t::OK);  // where things are now counts, not where they began
  EXPECT_EQ(spawn(robot, 6, 0).code, reply_t::REFUSED);
  EXPECT_EQ(spawn(robot, 3, 0).code, reply_t::OK);
  EXPECT_EQ(spawn(robot, -3, 0, "r").code, reply_t::REFUSED);  // taken
  EXPECT_EQ(spawn(robot, -3, 0).code, reply_t::OK);            // guest_2
  EXPECT_NEAR(state("guest_2").position[0], -3, 1e-12);
  EXPECT_EQ(info().nrobots, 3);
}

// The world that SAVE writes has the names, and a world may not have all.
TEST_F(EditsTest, RefusesNamesThatAWorldFileCannotHave) {
  begin(paused_server(), robot_sdf("r", 0, 0));
  const std::string box = as_file(box_sdf("x", "0.2 0.2 0.2", true));
  double x = 2;
  for (const char* name : {"a::b", "__model__", "world", " lead", "trail ", " "})
    EXPECT_EQ(spawn(box, x++, 0, name).code, reply_t::BAD_REQUEST) << name;
  for (const char* name : {"a:b", "__x", "it's", "in between", "<&>\""})
    EXPECT_EQ(spawn(box, x++, 0, name).code, reply_t::OK) << name;
  ASSERT_EQ(spawn(as_file(box_sdf("a::b", "0.2 0.2 0.2", true)), x, 0).code, reply_t::OK);
  EXPECT_NEAR(state("a.b").position[0], x, 1e-12);  // as in a world's file
}

TEST_F(EditsTest, APathIsThatOfOneModel) {
  begin(paused_server(), box_sdf("x", "0.2 0.2 0.2", true));
  const std::string box = as_file("<model name='b'><static>true</static><link name='y'/></model>");
  EXPECT_EQ(spawn(box, 2, 0, "fleet/a").code, reply_t::OK);
  const reply_t taken = spawn(box, 4, 0, "fleet/a/y");
  EXPECT_EQ(taken.code, reply_t::REFUSED);
  EXPECT_NE(taken.text.find("'fleet/a/y' is taken"), std::string::npos) << taken.text;
  EXPECT_EQ(spawn(box, 4, 0, "fleet/a/b").code, reply_t::OK);
  EXPECT_EQ(spawn(box, 6, 0, "fleet").code, reply_t::OK);
}

// The folder of the world is not its clients' to know.
TEST_F(EditsTest, AnErrorInATextShowsNoFolder) {
  begin(paused_server(), box_sdf("x", "0.2 0.2 0.2", true));
  const reply_t reply =
      spawn(as_file("<model name='b'><link name='y'/><ruedo:path><ruedo:waypoint>0 0 soon 0 0 0 0"
                    "</ruedo:waypoint></ruedo:path></model>"),
            2, 0);
  EXPECT_EQ(reply.code, reply_t::BAD_REQUEST);
  EXPECT_TRUE(reply.text.starts_with("the text:1: ")) << reply.text;
}

TEST_F(EditsTest, SetPoseLeavesModelsAtRest) {
  begin(paused_server(), robot_sdf("r", 0, 0) + box_sdf("box", "0.2 0.2 0.2", false, 5, 0, 0.1));
  drive("r", 0.5);
  step(100);
  const double odometry = on<odometry_t>("r/odometry").back().x;
  const Quat left(Eigen::AngleAxisd(M_PI / 2, Vec3::UnitZ()));
  ASSERT_EQ(set_pose("r", {-2, 4, 0}, left).code, reply_t::OK);
  EXPECT_NEAR(state("r").position[1], 4.0, 1e-12);
  step(100);
  const state_reply_t robot = state("r");
  EXPECT_NEAR(robot.position[0], -2.0, 1e-12);  // at rest: the command ended
  EXPECT_NEAR(robot.position[1], 4.0, 1e-12);
  EXPECT_NEAR(robot.linear[0], 0.0, 1e-12);
  EXPECT_NEAR(on<odometry_t>("r/odometry").back().x, odometry, 1e-12);  // knows nothing of it
  EXPECT_NEAR(on<pose_t>("r/pose").back().pos[1], 4.0, 1e-12);
  drive("r", 0.5);  // ahead is along y now
  step(200);
  EXPECT_NEAR(state("r").position[1], 4.5, 1e-9);
  EXPECT_NEAR(state("r").position[0], -2.0, 1e-9);

  ASSERT_EQ(set_pose("box", {5, 1, 2.1}).code, reply_t::OK);  // falls, from rest
  step(100);
  EXPECT_NEAR(state("box").position[2], 2.1 - 0.5 * 9.8 * 0.25, 0.02);
  step(400);
  EXPECT_NEAR(state("box").position[2], 0.1, 2e-3);
}

TEST_F(EditsTest, PushesThings) {
  begin(paused_server(), robot_sdf("r", 0, 0) + box_sdf("box", "0.2 0.2 0.2", false, 5, 0, 5) +
                             box_sdf("post", "1 1 1", true, 9, 9));
  ASSERT_EQ(set_twist("box", {1, 2, 4.9}, {0, 0, 1}).code, reply_t::OK);
  EXPECT_NEAR(state("box").linear[1], 2.0, 1e-12);
  step(100);  // 0.5 s of a throw: the top of it
  const state_reply_t box = state("box");
  EXPECT_NEAR(box.position[0], 5.5, 1e-6);
  EXPECT_NEAR(box.position[1], 1.0, 1e-6);
  EXPECT_NEAR(box.position[2], 5 + 0.5 * 4.9 * 0.5, 0.02);
  EXPECT_NEAR(box.linear[2], 0.0, 1e-6);
  EXPECT_NEAR(2 * std::acos(std::abs(box.orientation[0])), 0.5, 1e-3);
  const auto refused = [&](const std::string& name, const std::string& why) {
    const reply_t reply = set_twist(name, {1, 0, 0});
    EXPECT_EQ(reply.code, reply_t::REFUSED);
    EXPECT_NE(reply.text.find(why), std::string::npos) << reply.text;
  };
  refused("r", "has a drive");
  refused("post", "is static");
  EXPECT_EQ(set_twist("nobody", {1, 0, 0}).code, reply_t::UNKNOWN_NAME);
}

TEST_F(EditsTest, SetPoseMovesStaticModelsToo) {
  const std::string arm =
      "<model name='arm'><pose>0 5 0 0 0 0</pose><link name='l'><inertial><mass>1</mass></inertial>"
      "</link><joint name='j' type='fixed'><parent>world</parent><child>l</child></joint></model>";
  begin(paused_server(), robot_sdf("r", 0, 0, one_ray()) + box_sdf("post", "1 1 1", true, 9, 9) +
                             box_sdf("wall", "1 1 1", true, 5, 0, 0.5) + arm);
  step(20);
  EXPECT_NEAR(on<planar_lidar_t>("r/lrf").back().ranges[0], 4.5, 1e-5);  // to the face at x = 4.5
  ASSERT_EQ(set_pose("wall", {3, 0, 0.5}).code, reply_t::OK);
  EXPECT_NEAR(state("wall").position[0], 3.0, 1e-12);
  ASSERT_EQ(set_pose("post", {3, 0.5, 0.5}).code, reply_t::OK);  // static in static
  step(40);
  EXPECT_NEAR(on<planar_lidar_t>("r/lrf").back().ranges[0], 2.5, 1e-5);
  ASSERT_EQ(set_pose("arm", {0, 6, 0}).code, reply_t::OK);
  step(20);
  EXPECT_NEAR(state("arm").position[1], 6.0, 1e-9);
  EXPECT_EQ(info().nrobots, 1);
}

// All that the named channels carry, in order.
std::vector<std::vector<uint8_t>> bytes_of(MemoryBus& bus, const std::string& prefix) {
  std::vector<std::vector<uint8_t>> bytes;
  for (const Message& message : bus.messages()) {
    if (message.channel.starts_with(prefix)) bytes.push_back(message.bytes);
  }
  return bytes;
}

void drive(Controlled& run, const std::string& robot, double v) {
  velocity_command_t command{};
  command.vx = v;
  run.bus.send(robot + "/velocity", engine::encoded(command));
}

// Encoders that miss 0.5 s of what the wheels turn, from now on.
void stop_encoders(Controlled& run, const std::string& robot) {
  fault_t fault{};
  fault.kind = "encoder_stuck";
  fault.target = "left";
  fault.duration = 0.5;
  fault.view_end = 1.0;
  run.bus.send(robot + "/fault", engine::encoded(fault));
}

TEST(Edits, OthersHaveTheSameBytesWithAndWithoutAGuest) {
  const auto run = [](bool guest, bool faulty) {
    Controlled run;
    run.begin(paused_server(),
              robot_sdf("r", 0, 0, noisy_ray()) + box_sdf("wall", "0.2 2 1", true, 4, 0, 0.5));
    drive(run, "r", 0.2);
    if (faulty) stop_encoders(run, "r");
    run.step(137);
    if (guest) {
      EXPECT_EQ(run.spawn(as_file(robot_sdf("guest", 0, 0, noisy_ray())), 50, 50).code,
                reply_t::OK);
    }
    run.step(300);
    if (guest) {
      EXPECT_EQ(run.remove("guest").code, reply_t::OK);
    }
    run.step(100);
    run.end();
    return bytes_of(run.bus, "r/");
  };
  for (const bool faulty : {false, true}) {
    const auto without = run(false, faulty);
    EXPECT_GT(without.size(), 200u);
    EXPECT_EQ(without, run(true, faulty)) << faulty;
  }
}

// Regression: it had the encoder errors of the robot that was in its place before.
TEST(Edits, ARobotInThePlaceOfAnotherHasItsOwnFaults) {
  const std::string robot = as_file(robot_sdf("robot", 0, 0));
  const auto run = [&](bool faulty) {
    Controlled run;
    run.begin(paused_server(), "");
    EXPECT_EQ(run.spawn(robot, 0, 0, "old").code, reply_t::OK);
    drive(run, "old", 0.3);
    if (faulty) stop_encoders(run, "old");
    run.step(200);
    EXPECT_EQ(run.remove("old").code, reply_t::OK);
    EXPECT_EQ(run.spawn(robot, 2, 0, "new").code, reply_t::OK);
    run.step(100);
    run.end();
    EXPECT_EQ(run.on<odometry_t>("new/odometry").back().theta, 0.0);
    return bytes_of(run.bus, "new/");
  };
  const auto good = run(false);
  EXPECT_GT(good.size(), 20u);
  EXPECT_EQ(good, run(true));
}

TEST(Edits, ARunWithAGuestRepeatsWithAnyNumberOfThreads) {
  const auto run = [](int threads, bool sleepy) {
    const engine::ThreadLimit limit(threads);
    Controlled run;
    RunOptions options = paused_server();
    if (sleepy)
      options.simulation.before_batch = [](const std::string& module) {
        std::this_thread::sleep_for(std::chrono::microseconds(module.size() * 40));
      };
    run.begin(options, robot_sdf("r", 0, 0, noisy_ray()) +
                           box_sdf("crate", "0.3 0.3 0.3", false, 1.5, 0, 0.15));
    velocity_command_t command{};
    command.vx = 0.4;
    run.bus.send("r/velocity", engine::encoded(command));
    run.step(53);
    for (int i = 0; i < 6; ++i)
      EXPECT_EQ(run.spawn(as_file(robot_sdf("guest", 0, 0, noisy_ray())), 2, i - 3).code,
                reply_t::OK);
    run.bus.send("guest_2/velocity", engine::encoded(command));
    run.step(150);
    EXPECT_EQ(run.set_pose("crate", {0.9, 0.9, 1.0}).code, reply_t::OK);
    EXPECT_EQ(run.remove("guest_3").code, reply_t::OK);
    run.step(150);
    EXPECT_EQ(run.spawn(as_file(robot_sdf("guest", 0, 0, noisy_ray())), -3, 0, "late").code,
              reply_t::OK);
    run.step(100);
    run.end();
    std::vector<std::pair<std::string, std::vector<uint8_t>>> all;
    for (const Message& message : run.bus.messages()) {
      if (message.channel.find("ruedo/") != 0 || message.channel == "ruedo/world")
        all.emplace_back(message.channel, message.bytes);
    }
    return all;
  };
  const auto one = run(1, false);
  EXPECT_GT(one.size(), 500u);
  EXPECT_TRUE(one == run(2, true));
  EXPECT_TRUE(one == run(8, false));
}

}  // namespace
}  // namespace ruedo::run
