// E4: the paper blames errors on an overloaded host. Here the whole server runs once on an idle
// host and once beside threads that burn every core, with modules delayed at random: the bytes must
// be the same.
#include <atomic>
#include <limits>
#include <random>
#include <thread>

#include <fmt/format.h>

#include "base/whole.h"
#include "bench/experiments.h"
#include "engine/simulation.h"
#include "ruedo/move_command_t.hpp"
#include "run/pacer.h"
#include "world/load.h"

namespace ruedo::bench {
namespace {

constexpr double kDuration_s = 20;

// The fleet of one P3-AT in the arena, noise on, driving a wide arc.
std::shared_ptr<const world::WorldModel> make_world() {
  world::LoadOptions options;
  options.disabled = {"p3at/camera"};
  return world::load_world_text(
      "<sdf version='1.9'><world name='walls'><include><uri>model://ground_plane</uri></include>"
      "<include><uri>model://p3at</uri><name>p3at</name></include>"
      "<model name='wall'><static>true</static><pose>4 0 0.5 0 0 0.3</pose><link "
      "name='link'><collision name='c'><geometry>"
      "<box><size>0.2 9 1</size></box></geometry></collision></link></model>"
      "<model name='parcel'><pose>1.5 0.2 0.2 0 0 0</pose><link name='link'><collision "
      "name='c'><geometry><box><size>0.3 0.3 0.3</size></box>"
      "</geometry></collision></link></model></world></sdf>",
      "experiments", options);
}

struct Run {
  uint64_t hash =
      0xcbf29ce484222325u;  // FNV-1a of all messages, with their steps and channels, in order
  int64_t messages = 0;

  void add(const void* data, size_t size) {
    for (size_t i = 0; i < size; ++i)
      hash = (hash ^ static_cast<const uint8_t*>(data)[i]) * 0x100000001b3u;
  }
};

Run run_world(std::function<void(const std::string&)> before_batch) {
  const auto world = make_world();
  engine::Channels channels;
  Findings findings;
  engine::Wakeup finished;
  engine::SimulationOptions options;
  options.fleet.disabled = {"p3at/camera"};
  options.before_batch = std::move(before_batch);
  run::Pacer pacer(world->step_us, std::numeric_limits<double>::infinity(),
                   microseconds(kDuration_s) / world->step_us);
  engine::Simulation simulation(world, options, channels, findings, finished);

  move_command_t command{};
  command.id = 1;
  command.kind = move_command_t::ARC;
  command.value = 12.0;
  command.radius = 1.2;
  std::vector<uint8_t> bytes(static_cast<size_t>(command.getEncodedSize()));
  command.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  simulation.inbox().put("p3at/move", bytes.data(), bytes.size());

  Run run;
  simulation.start(pacer);
  for (bool last = false; !last;) {
    const engine::Batch* batch = simulation.next_batch();
    if (!batch) {
      finished.wait();
      continue;
    }
    for (int i = 0; i < batch->count; ++i) {
      simulation.messages(*batch, batch->first_step + i,
                          [&](int64_t step, int channel, const uint8_t* data, size_t size) {
                            run.add(&step, sizeof step);
                            run.add(&channel, sizeof channel);
                            run.add(data, size);
                            ++run.messages;
                          });
    }
    last = batch->last;
  }
  return run;
}

}  // namespace

void overload_experiment(Experiments& all) {
  all.progress("E4: idle host");
  const Run idle = run_world({});

  all.progress("E4: overloaded host");
  std::atomic<bool> burn{true};
  std::vector<std::thread> burners;
  for (unsigned i = 0; i < 4 * std::max(1u, std::thread::hardware_concurrency()); ++i) {
    burners.emplace_back([&burn] {
      while (burn.load(std::memory_order_relaxed)) {
      }
    });
  }
  // Modules are delayed by up to 2 ms, differently in every run.
  const Run loaded = run_world([](const std::string&) {
    thread_local std::minstd_rand random(std::random_device{}());
    if (random() % 4 == 0) std::this_thread::sleep_for(std::chrono::microseconds(random() % 2000));
  });
  burn = false;
  for (std::thread& burner : burners) burner.join();

  const bool same =
      idle.hash == loaded.hash && idle.messages == loaded.messages && idle.messages > 0;
  all.report({"E4",
              fmt::format("{:.0f} s of a P3-AT with all modules but the camera: messages that an "
                          "overloaded host changes, of {}",
                          kDuration_s, idle.messages),
              "errors blamed on it", same ? 0.0 : static_cast<double>(idle.messages), "",
              "none: the same bytes", same});
}

}  // namespace ruedo::bench
