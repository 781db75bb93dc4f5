// The same world and commands give the same bits, even if the world is created again elsewhere in
// memory.
#include <cstring>
#include <vector>

#include <gtest/gtest.h>

#include "sim.h"

namespace ruedo::robot::testing {
namespace {

std::vector<Pose> ram(const std::string& type, int steps) {
  std::string text = plane_sdf();
  for (int i = 0; i < 30; ++i) {
    const std::string n = std::to_string(i);
    text += robot_sdf(
        "r" + n,
        std::to_string(i % 6) + " " + std::to_string(i / 6) + " 0 0 0 " + std::to_string(0.7 * i),
        "", type);
    text += box_sdf("b" + n,
                    std::to_string(i % 6 + 0.5) + " " + std::to_string(i / 6 + 0.5) + " 0.1 0 0 0",
                    "0.2 0.2 0.2", i % 3 == 0 ? 0.0 : 4.0);
  }
  Sim sim(text);
  std::vector<Pose> poses;
  for (int step = 0; step < steps; ++step) {
    if (step % 50 == 0) {
      for (int i = 0; i < 30; ++i)
        sim.velocity(0.3 + 0.02 * i, (i + step / 50) % 3 - 1.0, RobotIndex(i));
    }
    sim.step();
    poses.insert(poses.end(), sim.state.bodies.begin(), sim.state.bodies.end());
  }
  return poses;
}

void expect_same_bits(const std::string& type, int steps) {
  const std::vector<Pose> first = ram(type, steps);
  std::vector<std::unique_ptr<char[]>> other_memory;
  for (int i = 0; i < 5000; ++i)
    other_memory.push_back(std::make_unique<char[]>(static_cast<size_t>(16 + 37 * (i % 50))));
  for (size_t i = 0; i < other_memory.size(); i += 3) other_memory[i].reset();
  const std::vector<Pose> second = ram(type, steps);
  ASSERT_EQ(first.size(), second.size());
  const auto same = [](const Pose& a,
                       const Pose& b) {  // a Pose has padding bytes
    return std::memcmp(a.rotation.coeffs().data(), b.rotation.coeffs().data(),
                       4 * sizeof(double)) == 0 &&
           std::memcmp(a.translation.data(), b.translation.data(), 3 * sizeof(double)) == 0;
  };
  for (size_t i = 0; i < first.size(); ++i) ASSERT_TRUE(same(first[i], second[i])) << i;
  double way = 0.0;  // something happened at all
  for (size_t i = 0; i < 60; ++i)
    way += (first[first.size() - 60 + i].translation - first[i].translation).norm();
  EXPECT_GT(way, 5.0);
}

TEST(Determinism, KinematicRobotsRammingThings) { expect_same_bits("kinematic", 1000); }
TEST(Determinism, WheeledRobotsRammingThings) { expect_same_bits("wheels", 200); }

}  // namespace
}  // namespace ruedo::robot::testing
