// Many copies of a world in one process, as ruedo.Engine has them: environment steps a second, and
// what a reset, a snapshot and its restoring cost.
//
// bench_engine WORLD [COPIES] [BEAMS] [THREADS] [SECONDS]      a world with one Pioneer 3-AT named
// "robot" or "p3at"
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>
#include <vector>

#include "engine/engine.h"
#include "world/load.h"

namespace {

using ruedo::engine::Engine;

double cpu_s() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double wall_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// Seconds for one call, which gets its number; the mean over the given time.
template <class Call>
double cost_us(double seconds, const Call& call) {
  int64_t calls = 0;
  const double begin = cpu_s();
  for (; cpu_s() - begin < seconds; ++calls) call(calls);
  return 1e6 * (cpu_s() - begin) / static_cast<double>(calls);
}

constexpr int kSteps = 20;  // of 5 ms: a decision at 10 Hz

// In circles of 1 m, as in benchmarks/peers.
void turn(Engine& engine) {
  std::vector<double> commands;
  for (size_t i = 0; i < static_cast<size_t>(engine.worlds()) * engine.driven().size(); ++i)
    commands.insert(commands.end(), {0.4, 0.0, 0.4});
  engine.drive(commands);
  engine.step(kSteps);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "bench_engine WORLD [COPIES] [BEAMS] [THREADS] [SECONDS]\n");
    return 2;
  }
  const auto argument = [&](int i, double otherwise) {
    return argc > i ? std::atof(argv[i]) : otherwise;
  };
  const auto copies = static_cast<int>(argument(2, 64));
  const auto beams = static_cast<int>(argument(3, 181));
  const double seconds = argument(5, 3.0);
  ruedo::world::LoadOptions load;
  const auto plain = ruedo::world::load_world(argv[1], load);
  std::string robot;
  for (const auto& instance : plain->models)
    if (instance.is_robot()) robot = instance.name;
  load.settings.push_back(ruedo::world::parse_setting(
      robot + "/lrf.lidar.scan.horizontal.samples=" + std::to_string(beams)));
  for (const char* device : {"/camera", "/sonar_front", "/sonar_rear"})
    load.disabled.push_back(robot + device);
  const auto world = ruedo::world::load_world(argv[1], load);
  ruedo::engine::EngineOptions options;
  options.worlds = copies;
  options.threads = static_cast<int>(argument(4, 0));
  options.fleet.disabled = load.disabled;
  Engine engine(world, options);
  const auto ranges = engine.observe("lrf", "ranges"), pose = engine.observe("pose", "pos");

  int64_t decisions = 0;
  const double begin = wall_s(), cpu = cpu_s();
  for (; wall_s() - begin < seconds; decisions += copies) turn(engine);
  const double wall = wall_s() - begin, used = cpu_s() - cpu;
  std::printf("%d copies, %d beams: %.0f steps/s, %.2f us of CPU a step (%lld steps); ", copies,
              beams, static_cast<double>(decisions) / wall,
              1e6 * used / static_cast<double>(decisions), static_cast<long long>(decisions));
  const double reset = cost_us(seconds / 4, [&](int64_t i) {
    engine.reset(static_cast<int>(i % copies), 2 + static_cast<uint64_t>(i));
  });
  const auto saved = engine.save(0);
  const double save = cost_us(seconds / 4, [&](int64_t) { engine.save(0); });
  const int itself[] = {0};
  const double restore = cost_us(seconds / 4, [&](int64_t) { engine.restore(*saved, itself); });
  std::printf("us of CPU: %.1f a reset, %.1f a save, %.1f a restore\n", reset, save, restore);
}
