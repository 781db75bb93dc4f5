// Lockstep over a bus that loses, duplicates and reorders: the same states and every message,
// whatever is lost.
#include <cmath>
#include <map>
#include <set>

#include <gtest/gtest.h>

#include "lockstep_client.h"
#include "ruedo/velocity_command_t.hpp"

namespace ruedo::run {
namespace {

constexpr int64_t kSteps = 240;  // 1.2 s

std::vector<uint8_t> velocity(double vx, double omega) {
  velocity_command_t command;
  command.utime = 0;
  command.vx = vx;
  command.vy = 0.0;
  command.omega = omega;
  return engine::encoded(command);
}

const char* const kSonar =
    R"(<sensor name='scan' type='ray'><update_rate>40</update_rate><ray><scan><horizontal><samples>60</samples>
  <min_angle>-1.5</min_angle><max_angle>1.5</max_angle></horizontal></scan><range><min>0.1</min><max>8</max></range>
  <noise><type>gaussian</type><stddev>0.01</stddev></noise></ray></sensor>)";

std::string robots(int count) {
  std::string models;
  for (int i = 0; i < count; ++i)
    models += robot_sdf("r" + std::to_string(i), 0.0, 1.5 * i, i == 0 ? kSonar : "");
  return models;
}

struct Result {
  int64_t hash = 0;
  std::map<int64_t, LockstepClient::Seen> seen;
  size_t lost = 0;
};

// A run with `clients` clients, each in a thread of its own and with its own grant length. Each
// drives the robot with its number, and at every 50th step all send r0 different commands.
Result run(int clients, Faults faults, unsigned seed) {
  LossyBus bus(faults, seed);
  RunOptions options = fast(1e6);
  options.lockstep.clients = clients;
  options.lockstep.lease_s = 60.0;
  run::Run server(load_text(robots(clients)), options, bus);
  std::thread running([&] { server.run(); });
  std::vector<std::map<int64_t, LockstepClient::Seen>> seen(static_cast<size_t>(clients));
  std::vector<std::thread> threads;
  for (int i = 0; i < clients; ++i) {
    threads.emplace_back([&, i] {
      // The last name comes first: the order of commands is by name, not by arrival.
      const std::string name(1, static_cast<char>('z' - i));
      LockstepClient client(bus, server.channels(), name);
      client.take_part();
      const int64_t length = i == 0 ? 1 : 5 * i + 2;
      for (int64_t step = 0; step < kSteps;) {
        const int64_t n = std::min(length, kSteps - step);
        for (int64_t k = step; k < step + n; ++k) {
          const double phase = 0.05 * static_cast<double>(k);
          if (k % 20 == 0)
            client.command(k, "r" + std::to_string(i) + "/velocity",
                           velocity(0.3 + 0.1 * i, std::sin(phase)));
          if (k % 50 == 0) client.command(k, "r0/velocity", velocity(0.1 * (i + 1), 0.2 * i));
        }
        client.step(n);
        step += n;
      }
      seen[i] = client.seen();
    });
  }
  for (std::thread& thread : threads) thread.join();
  server.stop();
  running.join();
  for (int i = 1; i < clients; ++i) {
    EXPECT_EQ(seen[i].size(), seen[0].size());
    for (const auto& [step, here] : seen[i]) {
      EXPECT_EQ(here.state_hash, seen[0][step].state_hash) << "step " << step;
      EXPECT_TRUE(here.messages == seen[0][step].messages) << "step " << step;
    }
  }
  return {seen[0].at(kSteps).state_hash, seen[0], bus.lost_to_server()};
}

class Lossy : public testing::TestWithParam<int> {};

TEST_P(Lossy, SameStatesAndNoMessageMissing) {
  const int clients = GetParam();
  const Result good = run(clients, {}, 1);
  ASSERT_EQ(good.seen.size(), static_cast<size_t>(kSteps + 1));  // state 0, too
  std::map<std::string, int> counts;
  for (const auto& [step, seen] : good.seen) {
    for (const auto& message : seen.messages) ++counts[message.first];
  }
  EXPECT_EQ(counts["r0/scan"], 49);      // 40 Hz: at 0, 25, ... 1200 ms
  EXPECT_EQ(counts["r0/pose"], 61);      // 50 Hz
  EXPECT_EQ(counts["ruedo/world"], 37);  // 30 Hz: the 36th at 1.2 s
  for (const double loss : {0.1, 0.3}) {
    const Result bad = run(clients, {loss, 0.2, 0.2}, 7);
    EXPECT_GT(bad.lost, 0u);
    EXPECT_EQ(bad.hash, good.hash) << loss;
    ASSERT_EQ(bad.seen.size(), good.seen.size());
    for (const auto& [step, seen] : good.seen) {
      EXPECT_EQ(seen.state_hash, bad.seen.at(step).state_hash)
          << "step " << step << ", loss " << loss;
      EXPECT_TRUE(seen.messages == bad.seen.at(step).messages)
          << "step " << step << ", loss " << loss;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Clients, Lossy, testing::Values(1, 3),
                         [](const auto& info) { return std::to_string(info.param) + "clients"; });

}  // namespace
}  // namespace ruedo::run
