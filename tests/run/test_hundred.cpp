// A hundred P3-ATs with all their ray sensors: the same bytes with every number of threads, and no
// allocations in the steady state.
#include <gtest/gtest.h>

#include <thread>

#include "counting_new.h"
#include "ruedo/move_command_t.hpp"
#include "running.h"

namespace ruedo::run {
namespace {

struct Fleet {
  std::shared_ptr<const world::WorldModel> world;
  world::LoadOptions load;
};

// Two columns of walls among robots on a grid of 3 m, so that rays meet walls, robots and nothing;
// circles of 1 m touch nothing.
Fleet fleet(int robots) {
  Fleet fleet;
  std::string sdf =
      "<sdf version='1.9'><world name='w'><physics "
      "type='bullet'><max_step_size>0.005</max_step_size></physics>"
      "<include><uri>model://ground_plane</uri></include>";
  for (int i = 0; i < robots; ++i) {
    const std::string name = "r" + std::to_string(i);
    sdf += "<include><uri>model://p3at</uri><name>" + name + "</name><pose>" +
           std::to_string(3 * (i % 10)) + " " + std::to_string(3 * (i / 10)) +
           " 0 0 0 0</pose></include>";
    fleet.load.disabled.push_back(name + "/camera");
  }
  for (int i = 0; i < 20; ++i) {
    sdf +=
        "<model name='wall" + std::to_string(i) + "'><static>true</static><pose>" +
        std::to_string(i < 10 ? 7.5 : 19.5) + " " + std::to_string(3 * (i % 10)) +
        " 0.5 0 0 0</pose><link name='l'><collision name='c'><geometry><box><size>0.4 1.5 1</size>"
        "</box></geometry></collision></link></model>";
  }
  fleet.world = world::load_world_text(sdf + "</world></sdf>", "hundred.sdf", fleet.load);
  return fleet;
}

void drive_circles(run::Run& server, int robots) {
  move_command_t command{};
  command.kind = move_command_t::ARC;
  command.value = 1e6;
  command.radius = 1.0;
  command.speed = 0.4;
  for (int i = 0; i < robots; ++i)
    server.on_message("r" + std::to_string(i) + "/move", engine::encoded(command));
}

RunOptions options_for(const Fleet& fleet, double seconds) {
  RunOptions options = fast(seconds);
  options.control = false;
  options.simulation.fleet.disabled = fleet.load.disabled;
  return options;
}

std::string log_of(const Fleet& fleet, int threads) {
  const TemporaryFile file("hundred.lcmlog");
  const engine::ThreadLimit limit(threads);
  RunOptions options = options_for(fleet, 1.0);
  options.record = file.path();
  MemoryBus bus;
  bus.keep = false;
  run::Run server(fleet.world, options, bus);
  drive_circles(server, 100);
  server.run();
  return file.bytes();
}

TEST(Hundred, SameBytesForOneTwoAndEightThreads) {
  const Fleet robots = fleet(100);
  const std::string one = log_of(robots, 1);
  EXPECT_GT(one.size(), 1'000'000u);  // a second of a hundred LRFs alone is 1.5 MB
  EXPECT_TRUE(one == log_of(robots, 2));
  EXPECT_TRUE(one == log_of(robots, 8));
}

// Straight ahead, into the walls and into robots that stand there already.
void drive_into_walls(run::Run& server, int robots) {
  move_command_t command{};
  command.kind = move_command_t::ADVANCE;
  command.value = 1e6;
  command.speed = 0.4;
  for (int i = 0; i < robots; ++i)
    server.on_message("r" + std::to_string(i) + "/move", engine::encoded(command));
}

// operator new in 1 000 steps, from 5 s to 10 s of sim time, counted between two messages that only
// the publisher sends.
uint64_t allocations_in_thousand_steps(int robots, void (*drive)(run::Run&, int)) {
  const Fleet all = fleet(robots);
  MemoryBus bus;
  bus.keep = false;
  uint64_t at_start = 0, at_end = 0;
  int64_t poses = 0;
  bus.on_publish = [&](const std::string& channel) {
    if (channel != "r0/pose") return;
    ++poses;  // 50 a second
    if (poses == 251) at_start = allocations();
    if (poses == 501) at_end = allocations();
  };
  run::Run server(all.world, options_for(all, 11.0), bus);
  drive(server, robots);
  server.run();
  EXPECT_GE(poses, 501);
  EXPECT_GT(at_start, 0u);
  return at_end - at_start;
}

// On a busy machine a worker may get its first piece of work late, and allocates its buffers then.
uint64_t of_late_workers() {
  constexpr uint64_t kBuffersOfAThread = 5;
  return kBuffersOfAThread * std::thread::hardware_concurrency();
}

TEST(Hundred, OneSteadyRobotAllocatesNothing) {
  EXPECT_EQ(allocations_in_thousand_steps(1, drive_circles), 0u);
}
TEST(Hundred, AHundredSteadyRobotsAllocateNothing) {
#if defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "with the thread sanitizer a parallel loop starts threads, which allocates";
#endif
  EXPECT_LE(allocations_in_thousand_steps(100, drive_circles), of_late_workers());
}

// 0.4 m/s brings the robots at x = 6 m to the first column of walls after 2.6 s, and those at 3 m
// to their backs after about 8.5 s: there are more contacts then than ever before.
TEST(Hundred, NewContactsAllocateNothing) {
#if defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "with the thread sanitizer a parallel loop starts threads, which allocates";
#endif
  // Collision messages grow with the number of contacts: a batch's message buffer may grow once.
  EXPECT_LE(allocations_in_thousand_steps(10, drive_into_walls),
            engine::Simulation::kBatches + of_late_workers());
}

}  // namespace
}  // namespace ruedo::run
