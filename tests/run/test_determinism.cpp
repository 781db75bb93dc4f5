// The bytes of a run depend on the world, the seed and the commands, and not on thread scheduling.
#include <random>

#include <gtest/gtest.h>

#include "ruedo/pose_t.hpp"
#include "ruedo/velocity_command_t.hpp"
#include "run/requests/control.h"
#include "running.h"

namespace ruedo::run {
namespace {

// A sensor that publishes pure noise, at 50 Hz.
class Noise : public Sensor {
 public:
  explicit Noise(const SensorSetup& setup)
      : random_(setup.random), channel_(setup.channel<pose_t>()) {}
  void sample(const SampleInput& input, Outbox& out) override {
    RandomStream stream = random_.stream(static_cast<uint64_t>(input.sample));
    pose_t message{};
    message.utime = input.snapshot.time;
    for (double& value : message.pos) value = stream.gaussian();
    out.publish(channel_, message);
  }

 private:
  RandomSource random_;
  int channel_;
};

// The same, done wrongly: all devices draw from one generator, so that the order of the threads
// shows.
class SharedNoise : public Sensor {
 public:
  explicit SharedNoise(const SensorSetup& setup) : channel_(setup.channel<pose_t>()) {}
  void sample(const SampleInput& input, Outbox& out) override {
    static std::mutex mutex;
    pose_t message{};
    message.utime = input.snapshot.time;
    if (input.sample > 0) std::this_thread::yield();
    std::lock_guard lock(mutex);
    if (input.sample == 0) generator().seed(1);
    for (double& value : message.pos) value = static_cast<double>(generator()());
    out.publish(channel_, message);
  }

 private:
  static std::mt19937& generator() {
    static std::mt19937 engine;
    return engine;
  }
  int channel_;
};

template <class S>
SensorKind kind(const char* module, const char* type) {
  return {.module = module,
          .order = 500,
          .types = {type},
          .attach_to = "",
          .device_name = "",
          .default_rate = {50, 1},
          .make = [](const SensorSetup& setup) { return std::make_unique<S>(setup); }};
}
const RegisterSensor kNoise{kind<Noise>("test_noise", "test_noise")};
const RegisterSensor kShared{kind<SharedNoise>("test_shared", "test_shared")};

std::string fleet(int robots, const std::string& type) {
  std::string models;
  for (int i = 0; i < robots; ++i) {
    std::string sensors;
    for (int k = 0; k < 4; ++k)
      sensors += "<sensor name='S" + std::to_string(k) + "' type='" + type + "'/>";
    models += robot_sdf("r" + std::to_string(i), 2.0 * i, 0.0, sensors);
  }
  return models;
}

struct Variation {
  uint64_t seed = 1;
  int threads = 0;
  int batch_steps = 0;
  bool sleeps = false;
  double rate = std::numeric_limits<double>::infinity();
};

// The log of two seconds of driving robots. The commands are queued before the first step.
std::string log_of(const std::shared_ptr<const world::WorldModel>& world,
                   const Variation& variation) {
  const TemporaryFile file("determinism.lcmlog");
  const engine::ThreadLimit limit(variation.threads);
  RunOptions options = fast(1.0, variation.seed);
  options.rate = variation.rate;
  options.record = file.path();
  options.simulation.batch_steps = variation.batch_steps;
  if (variation.sleeps) {
    options.simulation.before_batch = [](const std::string&) {
      thread_local std::mt19937 engine{std::random_device{}()};
      std::this_thread::sleep_for(std::chrono::microseconds(engine() % 2000));
    };
  }
  MemoryBus bus;
  run::Run server(world, options, bus);
  bus.on_publish = nullptr;
  velocity_command_t command{};
  command.vx = 0.4;
  command.omega = 0.3;
  server.on_message(world->models[1].name + "/velocity", engine::encoded(command));
  server.run();
  return file.bytes();
}

TEST(Determinism, SameSeedSameBytes) {
  const auto world = load_text(fleet(6, "test_noise"));
  const std::string first = log_of(world, {});
  EXPECT_GT(first.size(), 100'000u);
  EXPECT_TRUE(first == log_of(world, {}));
}

TEST(Determinism, AnotherSeedOtherBytes) {
  const auto world = load_text(fleet(6, "test_noise"));
  EXPECT_FALSE(log_of(world, {.seed = 1}) == log_of(world, {.seed = 2}));
}

TEST(Determinism, ThreadsBatchesAndSleepsChangeNothing) {
  const auto world = load_text(fleet(20, "test_noise"));
  const std::string one = log_of(world, {.threads = 1});
  EXPECT_TRUE(one == log_of(world, {.threads = 2}));
  EXPECT_TRUE(one == log_of(world, {.threads = 8}));
  EXPECT_TRUE(one == log_of(world, {.batch_steps = 1}));
  EXPECT_TRUE(one == log_of(world, {.batch_steps = 7}));
  EXPECT_TRUE(one == log_of(world, {.threads = 8, .sleeps = true}));
  EXPECT_TRUE(one == log_of(world, {.rate = 20.0}));
}

// If this failed, the comparison above would prove nothing: a module whose devices share a
// generator must give different bytes.
TEST(Determinism, SharedGeneratorIsCaught) {
  const auto world = load_text(fleet(40, "test_shared"));
  const std::string first = log_of(world, {.threads = 4, .sleeps = true});
  bool caught = false;
  for (int i = 0; i < 10 && !caught; ++i)
    caught = first != log_of(world, {.threads = 4, .sleeps = true});
  EXPECT_TRUE(caught);
}

}  // namespace
}  // namespace ruedo::run
