// How fast the server runs one P3-AT without a camera: as a whole, and by the number of steps that
// are handed over at once. "x" is sim time per real time; messages go to a sink that counts, or
// over LCM.
#include <limits>

#include <benchmark/benchmark.h>

#include "bus/lcm_bus.h"
#include "run/run.h"
#include "world/load.h"

namespace {

using namespace ruedo;

class CountingBus : public Bus {
 public:
  void publish(const std::string&, const uint8_t*, size_t size) override { bytes_ += size; }
  void listen(const std::vector<std::string>&, Handler, const std::vector<std::string>&) override {}
  size_t bytes() const { return bytes_; }

 private:
  size_t bytes_ = 0;
};

std::shared_ptr<const world::WorldModel> arena() {
  static const auto world = [] {
    world::LoadOptions options;
    options.disabled = {"p3at/camera"};
    return world::load_world(std::string(RUEDO_SOURCE_DIR) + "/worlds/arena.sdf", options);
  }();
  return world;
}

void run(benchmark::State& state, Bus& bus, int batch_steps) {
  constexpr int64_t kSeconds = 60;
  run::RunOptions options;
  options.rate = std::numeric_limits<double>::infinity();
  options.duration_us = kSeconds * 1'000'000;
  options.simulation.batch_steps = batch_steps;
  for (auto _ : state) {
    state.PauseTiming();
    auto server = std::make_unique<run::Run>(arena(), options, bus);
    state.ResumeTiming();
    server->run();
    state.PauseTiming();
    server.reset();
    state.ResumeTiming();
  }
  const double simulated_s = static_cast<double>(kSeconds * state.iterations());
  state.counters["x"] = benchmark::Counter(simulated_s, benchmark::Counter::kIsRate);
  state.counters["us_per_step"] = benchmark::Counter(
      simulated_s * 200.0 * 1e-6, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

void BM_BatchSteps(benchmark::State& state) {
  CountingBus bus;
  run(state, bus, static_cast<int>(state.range(0)));
}
BENCHMARK(BM_BatchSteps)
    ->Arg(1)
    ->Arg(4)
    ->Arg(8)
    ->Arg(16)
    ->Arg(32)
    ->Arg(64)
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

void BM_OverMemq(benchmark::State& state) {
  bus::LcmBus bus("memq://");
  run(state, bus, 0);
}
BENCHMARK(BM_OverMemq)->UseRealTime()->Unit(benchmark::kMillisecond)->Iterations(1);

}  // namespace

BENCHMARK_MAIN();
