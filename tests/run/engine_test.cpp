// The engine in the process against a server in lockstep: the same messages, byte for byte.
#include "engine/engine.h"

#include <cmath>
#include <cstring>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "counting_new.h"
#include "lockstep_client.h"
#include "ruedo/velocity_command_t.hpp"

namespace ruedo::run {
namespace {

using engine::Engine;

struct Command {
  int64_t step;
  std::string channel;
  double vx, omega;

  std::vector<uint8_t> bytes() const {
    velocity_command_t command;
    command.utime = 0;
    command.vx = vx;
    command.vy = 0.0;
    command.omega = omega;
    return engine::encoded(command);
  }
};

// One message in a form that both sides share.
using Told = std::vector<std::pair<std::string, std::vector<uint8_t>>>;

const char* const kScan =
    R"(<sensor name='scan' type='ray'><update_rate>40</update_rate><ray><scan><horizontal><samples>31</samples>
  <min_angle>-1.5</min_angle><max_angle>1.5</max_angle></horizontal></scan><range><min>0.1</min><max>8</max></range>
  <noise><type>gaussian</type><stddev>0.01</stddev></noise></ray></sensor>
  <sensor name='imu' type='imu'><update_rate>100</update_rate></sensor>)";

// Robots that meet boxes, which move, and walls, which do not.
std::string random_models(std::mt19937& random, int robots) {
  const auto between = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random()) / 4294967296.0;
  };
  std::string models;
  for (int i = 0; i < robots; ++i)
    models += robot_sdf("r" + std::to_string(i), 0.0, 1.5 * i, kScan);
  for (int i = 0; i < 6; ++i) {
    const std::string place = std::to_string(0.7 + 0.5 * i) + " " +
                              std::to_string(between(-0.5, 1.5 * robots)) + " 0.1 0 0 " +
                              std::to_string(between(-3, 3));
    models += "<model name='box" + std::to_string(i) + "'>" +
              (i % 2 ? "<static>true</static>" : "") + "<pose>" + place +
              "</pose><link name='link'><inertial><mass>0.4</mass></inertial><collision "
              "name='c'><geometry><box><size>0.2 0.3 0.2</size></box>"
              "</geometry></collision></link></model>";
  }
  return models;
}

std::vector<Command> random_commands(std::mt19937& random, int robots, int64_t steps) {
  std::vector<Command> commands;
  for (int64_t step = 0; step < steps; step += 1 + static_cast<int64_t>(random() % 25)) {
    commands.push_back(
        {step, "r" + std::to_string(random() % static_cast<unsigned>(robots)) + "/velocity",
         0.01 * static_cast<double>(random() % 100) - 0.2,
         0.01 * static_cast<double>(random() % 200) - 1.0});
  }
  return commands;
}

std::map<int64_t, Told> by_server(const std::shared_ptr<const world::WorldModel>& world,
                                  uint64_t seed, const std::vector<Command>& commands,
                                  int64_t steps) {
  LossyBus bus({}, 1);
  RunOptions options = fast(1e6, seed);
  options.lockstep.clients = 1;
  options.lockstep.lease_s = 60.0;
  run::Run server(world, options, bus);
  std::thread running([&] { server.run(); });
  LockstepClient client(bus, server.channels(), "test");
  client.take_part();
  for (const Command& command : commands)
    client.command(command.step, command.channel, command.bytes());
  client.step(steps);
  server.stop();
  running.join();
  std::map<int64_t, Told> told;
  for (const auto& [step, seen] : client.seen()) {
    if (!seen.messages.empty()) told[step] = seen.messages;
  }
  return told;
}

// Each copy of the world gets the same commands.
std::vector<std::map<int64_t, Told>> by_engine(Engine& engine, const std::vector<Command>& commands,
                                               int64_t steps) {
  std::vector<std::map<int64_t, Told>> told(static_cast<size_t>(engine.worlds()));
  engine.on_message(
      [&](int world, int64_t step, const engine::Channel& channel, std::span<const uint8_t> bytes) {
        told[world][step].emplace_back(channel.bus_name,
                                       std::vector<uint8_t>(bytes.begin(), bytes.end()));
      });
  size_t next = 0;
  for (int64_t step = 0; step < steps;) {
    for (; next < commands.size() && commands[next].step == step; ++next) {
      for (int world = 0; world < engine.worlds(); ++world)
        engine.command(world, commands[next].channel, commands[next].bytes());
    }
    const int64_t until = next < commands.size() ? commands[next].step : steps;
    engine.step(until - step);
    step = until;
  }
  engine.on_message({});
  return told;
}

class EngineEqualsServer : public testing::TestWithParam<unsigned> {};

TEST_P(EngineEqualsServer, ByteForByte) {
  std::mt19937 random(GetParam());
  const int robots = 1 + static_cast<int>(random() % 3);
  constexpr int64_t kSteps = 400;
  const auto world = load_text(random_models(random, robots));
  const std::vector<Command> commands = random_commands(random, robots, kSteps);
  engine::EngineOptions options;
  options.worlds = 3;
  options.fleet.seed = 7;
  Engine engine(world, options);
  const auto told = by_engine(engine, commands, kSteps);
  for (const int copy : {0, 2}) {
    auto expected = by_server(world, 7 + static_cast<uint64_t>(copy), commands, kSteps);
    expected.erase(0);  // which the engine computed before anybody listened
    ASSERT_EQ(told[copy].size(), expected.size());
    EXPECT_TRUE(told[copy] == expected) << "copy " << copy;
  }
  EXPECT_FALSE(told[0] == told[2]) << "other seeds have other noise";
}

INSTANTIATE_TEST_SUITE_P(Worlds, EngineEqualsServer, testing::Range(1u, 9u));

TEST(Engine, AResetCopyEqualsAFreshOne) {
  std::mt19937 random(3);
  const auto world = load_text(random_models(random, 2));
  const std::vector<Command> before = random_commands(random, 2, 300),
                             after = random_commands(random, 2, 200);
  engine::EngineOptions options;
  options.worlds = 2;
  Engine used(world, options), fresh(world, options);
  by_engine(used, before, 300);
  for (int copy = 0; copy < 2; ++copy) {
    used.reset(copy, 1 + static_cast<uint64_t>(copy));
    EXPECT_EQ(used.current_step(copy), 0);
    EXPECT_EQ(used.state_hash(copy), fresh.state_hash(copy));
  }
  EXPECT_TRUE(by_engine(used, after, 200) == by_engine(fresh, after, 200));
}

// tests/engine/test_snapshots.py compares the bytes of other worlds and devices.
TEST(Engine, ARestoredWorldContinuesEqually) {
  for (unsigned seed = 1; seed < 5; ++seed) {
    std::mt19937 random(seed);
    const auto world = load_text(random_models(random, 2));
    engine::EngineOptions options;
    options.worlds = 2;
    Engine engine(world, options);
    by_engine(engine, random_commands(random, 2, 300), 300);
    const auto saved = engine.save(1);
    const int64_t step = engine.current_step(1);
    const auto go_on = [&](int copy) {
      std::vector<uint64_t> hashes;
      const double ahead[] = {0.3, 0, 0.4, -0.2, 0, 1, 0.3, 0, 0.4, -0.2, 0, 1};
      for (int i = 0; i < 20; ++i) {
        engine.drive(ahead);
        engine.step(10);
        hashes.push_back(engine.state_hash(copy));
      }
      return hashes;
    };
    const std::vector<uint64_t> went = go_on(1);
    const int both[] = {0, 1};
    engine.restore(*saved, both);
    EXPECT_EQ(engine.current_step(0), step);
    EXPECT_EQ(go_on(0), went);
    engine.restore(*saved, both);
    EXPECT_EQ(go_on(1), went);
  }
}

// Sensors that do not define it: Noise of test_determinism.cpp.
TEST(Engine, ReportsASensorThatCannotBeCopied) {
  Engine engine(load_text(robot_sdf("a", 0, 0, "<sensor name='S' type='test_noise'/>")), {});
  engine.step(10);
  const uint64_t before = engine.state_hash(0);
  try {
    engine.save(0);
    FAIL() << "it was saved";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("the device 'a/S' is a plugin's that cannot be "
                                                 "copied: it lacks Sensor::copy_from()"));
  }
  EXPECT_EQ(engine.state_hash(0), before);
}

double value_of(const engine::FieldArray& array, size_t index) {
  double value;
  std::memcpy(&value, array.values.data() + index * sizeof value, sizeof value);
  return value;
}

// 0.3 m/s from the first step on, without limits: 0.3 m after one second. The first axis is the
// copy, the second the robot.
TEST(Engine, ArraysFollowTheRuns) {
  engine::EngineOptions options;
  options.worlds = 2;
  Engine engine(load_text(robot_sdf("a", 0, 0) + robot_sdf("b", 0, 2)), options);
  const std::shared_ptr<const engine::FieldArray> observed = engine.observe("pose", "pos");
  const engine::FieldArray& position = *observed;
  EXPECT_EQ(position.type, Primitive::float64);
  EXPECT_EQ(position.shape, (std::vector<int64_t>{2, 2, 3}));
  const double none = std::nan("");
  const double velocities[] = {0.3, 0, 0, none, none, none,  // copy 0: a drives, b gets no command
                               0,   0, 0, -0.2, 0,    0};
  engine.drive(velocities);
  engine.step(200);
  EXPECT_NEAR(value_of(position, 0), 0.3, 1e-12);
  EXPECT_NEAR(value_of(position, 3), 0.0, 1e-12);
  EXPECT_NEAR(value_of(position, 4), 2.0, 1e-12);
  EXPECT_NEAR(value_of(position, 6), 0.0, 1e-12);
  EXPECT_NEAR(value_of(position, 9), -0.2, 1e-12);
  engine.reset(0, 1);
  EXPECT_EQ(value_of(position, 0), 0.0);
}

// A faulty <sensor> costs only that sensor, and is reported; the rest of the world runs. A faulty
// element of Ruedo's own is an error.
TEST(Engine, ContinuesWithoutAMalformedSensor) {
  const std::string wrong =
      "<sensor name='laser' type='ray'><ray><scan><horizontal><samples>-3</samples></horizontal>"
      "</scan><range><min>1</min><max>2</max></range></ray></sensor>"
      "<sensor name='good' type='imu'/><sensor name='eye' type='camera'><camera><image><width>0"
      "</width><height>1</height></image></camera></sensor>";
  Engine engine(load_text(robot_sdf("a", 0, 0, wrong)), {});
  engine.step(10);
  EXPECT_EQ(engine.observe("good", "angular_velocity")->shape.back(), 3);
  EXPECT_THROW(engine.observe("laser", "ranges"), InputError);
  std::vector<std::string> told;
  for (const Finding& finding : engine.findings().list()) {
    EXPECT_EQ(finding.kind, Finding::Kind::error);
    EXPECT_GT(finding.source.line, 0);
    told.push_back(finding.element + ": " + finding.text);
  }
  EXPECT_THAT(told, testing::UnorderedElementsAre(
                        testing::AllOf(testing::StartsWith("a/laser: <horizontal/samples>"),
                                       testing::EndsWith("; the sensor is left out")),
                        testing::AllOf(testing::StartsWith("a/eye: <camera/image/width>"),
                                       testing::EndsWith("; the sensor is left out"))));
  EXPECT_THROW(
      Engine(load_text(robot_sdf(
                 "a", 0, 0, "<sensor name='i' type='imu'><ruedo:phase>x</ruedo:phase></sensor>")),
             {}),
      InputError);
}

std::vector<uint64_t> hashes(const Engine& engine) {
  std::vector<uint64_t> all;
  for (int copy = 0; copy < engine.worlds(); ++copy) all.push_back(engine.state_hash(copy));
  return all;
}

// Sixteen copies, one of which is to be reset to a world with another robot.
TEST(Engine, ARefusedResetChangesNothing) {
  std::mt19937 random(4);
  const std::string models = random_models(random, 2);
  const auto world = load_text(models), other = load_text(models + robot_sdf("more", 9, 9));
  engine::EngineOptions options;
  options.worlds = 16;
  Engine engine(world, options), fresh(world, options);
  engine.observe("scan", "ranges");
  engine.step(10);
  const std::vector<uint64_t> before = hashes(engine);
  for (int round = 0; round < 20; ++round) {
    std::vector<Engine::Reset> resets;
    for (int copy = 0; copy < 16; ++copy)
      resets.push_back({copy, 100, copy == round % 16 ? other : load_text(models)});
    EXPECT_THROW(engine.reset(resets), InputError);
    EXPECT_EQ(hashes(engine), before);
    EXPECT_EQ(engine.current_step(round % 16), 10);
  }
  std::vector<Engine::Reset> resets;
  for (int copy = 0; copy < 16; ++copy) resets.push_back({copy, 1 + static_cast<uint64_t>(copy)});
  engine.reset(resets);
  const std::vector<Command> commands = random_commands(random, 2, 100);
  EXPECT_TRUE(by_engine(engine, commands, 100) == by_engine(fresh, commands, 100));
}

TEST(Engine, AWorldOfAnotherStepSizeIsRefused) {
  const std::string models = robot_sdf("a", 0, 0);
  std::string text = world_sdf(models);
  text.replace(text.find("0.005"), 5, "0.004");
  Engine engine(load_text(models), {});
  EXPECT_THROW(engine.reset(0, 1, world::load_world_text(text, "other.sdf")), InputError);
  text.replace(text.find("0.004"), 5, "nan");  // a finding; what is usual would be taken
  EXPECT_THROW(engine.reset(0, 1, world::load_world_text(text, "other.sdf")), InputError);
}

TEST(Engine, AHandlerThatThrowsLeavesWorldsSound) {
  engine::EngineOptions options;
  options.worlds = 3;
  const auto world = load_text(robot_sdf("a", 0, 0));
  Engine engine(world, options), fresh(world, options);
  engine.on_message([](int copy, int64_t, const engine::Channel&, std::span<const uint8_t>) {
    if (copy > 0) throw std::runtime_error("from copy " + std::to_string(copy));
  });
  try {
    engine.step(50);
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "from copy 1");
  }
  fresh.step(50);
  for (int copy = 0; copy < 3; ++copy) EXPECT_EQ(engine.current_step(copy), 50);
  EXPECT_EQ(hashes(engine), hashes(fresh));
}

// Wherever memory runs out, a copy is unchanged, has executed the call, or reports its failure; and
// after a reset it is a fresh one.
TEST(Engine, SurvivesEveryFailingAllocation) {
  std::mt19937 random(5);
  engine::EngineOptions options;
  options.worlds = 2;
  options.threads = 2;
  const auto world = load_text(random_models(random, 1));
  Engine engine(world, options), fresh(world, options);
  engine.observe("scan", "ranges");
  const auto goes_on = [&](int copy) {
    const std::vector<uint8_t> which{static_cast<uint8_t>(copy == 0), static_cast<uint8_t>(copy)};
    try {
      engine.step(1, which);
    } catch (const std::runtime_error& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr("failed in an earlier call"));
    }
  };
  const std::vector<uint64_t> begin = hashes(fresh);
  for (const bool resets : {true, false}) {
    bool failed = true;
    for (uint64_t number = 1; failed; ++number) {
      {
        const FailingAllocation failing(number);
        try {
          if (resets)
            engine.reset(std::vector<Engine::Reset>{{0, 1}, {1, 2}});
          else
            engine.step(12);
        } catch (const std::bad_alloc&) {
        }
        failed = FailingAllocation::has_failed();
      }
      goes_on(0), goes_on(1);
      engine.reset(std::vector<Engine::Reset>{{0, 1}, {1, 2}});
      ASSERT_EQ(hashes(engine), begin) << "allocation " << number;
    }
  }
}

TEST(Engine, ReportsInvalidArguments) {
  engine::EngineOptions options;
  Engine engine(load_text(robot_sdf("a", 0, 0)), options);
  const auto message = [](const auto& call) {
    try {
      call();
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("nothing");
  };
  EXPECT_THAT(message([&] { engine.step(0); }), testing::HasSubstr("1 step or more, not 0"));
  EXPECT_THAT(
      message([&] { engine.observe("lrf", "ranges"); }),
      testing::HasSubstr(
          "no robot has a device 'lrf'; there are a/collisions, a/motion, a/odometry, a/pose"));
  EXPECT_THAT(
      message([&] { engine.observe("pose", "position"); }),
      testing::HasSubstr("'position' is not a field of numbers in pose_t; there are utime, pos,"));
  EXPECT_THAT(message([&] { engine.command(0, "a/pose", {}); }),
              testing::HasSubstr("no robot takes commands on 'a/pose'"));
  EXPECT_THAT(message([&] { engine.command(0, "a/velocity", {}); }),
              testing::HasSubstr("the message does not decode as the type of a/velocity"));
  const double two[] = {0, 0};
  EXPECT_THAT(message([&] { engine.drive(two); }), testing::HasSubstr("1 rows of 3"));
  options.worlds = 0;
  EXPECT_THAT(message([&] { Engine(load_text(""), options); }),
              testing::HasSubstr("1 world or more, not 0"));
}

}  // namespace
}  // namespace ruedo::run
