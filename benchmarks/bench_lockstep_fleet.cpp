// Lockstep from C++ with the robots of a world: robot-decisions a second at 10 Hz over the local
// socket, as bench_lockstep_fleet.py measures them from Python, which writes the world, too.
//
//     bench_lockstep_fleet.py --world 64 > fleet.sdf
//     bench_lockstep_fleet WORLD [DECISIONS] [ROUNDS]      prints each round and the median
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "ruedo/client.h"

namespace rc = ruedo::client;

namespace {

double rate(const char* world, int decisions) {
  rc::LaunchOptions options;
  options.lockstep = 1;
  options.args = {"--quiet"};
  const rc::Simulation sim = rc::launch(world, options);
  const std::vector<rc::Robot> robots = sim.robots();
  std::vector<rc::Device<rc::Scan>> scanners;
  for (const rc::Robot& robot : robots) scanners.push_back(robot.lrf());
  rc::Observations seen = sim.step(20);
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < decisions; ++i) {
    std::vector<rc::Command> commands;
    for (size_t k = 0; k < robots.size(); ++k) {
      const bool near = seen.latest(scanners[k])->ranges[12] < 0.5F;
      commands.push_back(robots[k].velocity_command(near ? 0.0 : 0.2, 0.5));
    }
    seen = sim.step(20, commands);
  }
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return static_cast<double>(robots.size()) * decisions / seconds;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: bench_lockstep_fleet WORLD [DECISIONS] [ROUNDS]\n");
    return 2;
  }
  const int decisions = argc > 2 ? std::atoi(argv[2]) : 100;
  std::vector<double> rates(static_cast<size_t>(argc > 3 ? std::max(1, std::atoi(argv[3])) : 5));
  for (double& each : rates) {
    each = rate(argv[1], decisions);
    std::printf("%.0f robot-decisions/s\n", each);
  }
  std::sort(rates.begin(), rates.end());
  std::printf("median %.0f robot-decisions/s\n", rates[rates.size() / 2]);
  return 0;
}
