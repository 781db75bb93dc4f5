// Lockstep over the wire: steps per second from C++, one step per round trip; bench_lockstep.py
// does the same from Python.
//
//     bench_lockstep WORLD [STEPS] [ROUNDS]      starts a server of its own; prints each round and
//     the median
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "ruedo/client.h"

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: bench_lockstep WORLD [STEPS] [ROUNDS]\n");
    return 2;
  }
  const int steps = argc > 2 ? std::atoi(argv[2]) : 10'000;
  const int rounds = argc > 3 ? std::atoi(argv[3]) : 5;
  auto sim = ruedo::client::launch(
      argv[1],
      {.rate = ruedo::client::kFast, .args = {"--lockstep", "1", "--disable", "p3at/camera"}});
  const auto robot = sim.robot("p3at");
  sim.step(200);
  std::vector<double> rates;
  for (int round = 0; round < rounds; ++round) {
    size_t messages = 0;
    const auto begin = std::chrono::steady_clock::now();
    for (int i = 0; i < steps; ++i)
      messages += sim.step(1, {robot.velocity_command(0.2, 0.3)}).messages.size();
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    rates.push_back(steps / seconds);
    std::printf("%d steps, %zu messages: %.0f steps/s\n", steps, messages, rates.back());
  }
  std::sort(rates.begin(), rates.end());
  std::printf("median %.0f steps/s\n", rates[rates.size() / 2]);
  return 0;
}
