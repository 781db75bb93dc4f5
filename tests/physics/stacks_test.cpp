// Stacks: they stand whatever their contents, and nothing elsewhere in the world changes a bit of
// them.
#include <vector>

#include <gtest/gtest.h>

#include "world.h"

namespace ruedo::physics::testing {
namespace {

// Boxes of 0.2 m, friction 0.8; the top one weighs `top` kg, the others 1 kg.
std::string stack(int boxes, double top = 1.0, const std::string& at = "0 0") {
  std::string models;
  for (int i = 0; i < boxes; ++i) {
    const double mass = i + 1 == boxes ? top : 1.0;
    models += thing("s" + std::to_string(i), at + " " + std::to_string(0.1 + 0.2 * i) + " 0 0 0",
                    kBox, mass, 0.8, mass * 0.04 / 6);
  }
  return models;
}

// The largest distance of a body from its initial place, with all bodies kept awake.
double drift(World& w, double seconds, const std::string& first = "s0/l") {
  std::vector<Vec3> start;
  for (size_t i = 0; i < w.layout.bodies.size(); ++i)
    start.push_back(w.physics.pose(BodyIndex(i)).translation);
  const int body = w.body(first);
  for (int i = 0; i < static_cast<int>(seconds * 1e6) / w.world->step_us; ++i) {
    w.physics.wake(BodyIndex(body));
    w.physics.step();
  }
  double furthest = 0.0;
  for (size_t i = 0; i < start.size(); ++i)
    furthest = std::max(furthest, (w.physics.pose(BodyIndex(i)).translation - start[i]).norm());
  return furthest;
}

// PyBullet at the same step: 22 mm for 15 boxes (multibodies, 50 iterations), and 100:1 falls.
TEST(Stacks, FifteenBoxesStandForAMinute) {
  World w(kPlane + stack(15), 5000);
  EXPECT_LT(drift(w, 5), 2e-3);  // kept awake
  w.run(55);
  EXPECT_LT((w.position("s14/l") - Vec3(0, 0, 2.9)).norm(), 3e-3);
}

TEST(Stacks, AHundredTimesTheWeightOnTopStands) {
  for (const int boxes : {2, 3}) {
    World w(kPlane + stack(boxes, 100.0), 5000);
    EXPECT_LT(drift(w, 10), 3e-3) << boxes;
    w.run(50);
    EXPECT_LT((w.position("s0/l") - Vec3(0, 0, 0.1)).norm(), 3e-3) << boxes;
  }
}

// docs/physics.md has them at the moment of their landing, too: piles that stand are solved as
// accurately as a single body.
TEST(Stacks, BoxesStandWithinAHundredthOfAMillimetre) {
  for (const int boxes : {8, 10, 15}) {
    World w(kPlane + stack(boxes), 5000);
    double furthest = 0.0;
    for (int i = 0; i < 600; ++i) {
      w.physics.step();
      for (int k = 0; k < boxes; ++k)
        furthest = std::max(
            furthest,
            (w.position("s" + std::to_string(k) + "/l") - Vec3(0, 0, 0.1 + 0.2 * k)).norm());
    }
    EXPECT_LT(furthest, 1e-5) << boxes;
  }
}

// What is placed exactly stays: all corners are found at once, and before they touch.
TEST(Stacks, AnExactlyPlacedBodyDoesNotRock) {
  World w(kPlane + stack(15), 5000);
  EXPECT_LT(drift(w, 1), 5e-5);
}

TEST(Stacks, StandAtOtherSteps) {
  for (const int64_t step_us : {1000, 10'000, 20'000}) {
    World w(kPlane + stack(8), step_us);
    EXPECT_LT(drift(w, 3), 2e-3) << step_us;
  }
}

// A wall of bricks, each upon two.
TEST(Stacks, AWallOfBricksStands) {
  std::string bricks = kPlane;
  int n = 0;
  for (int row = 0; row < 5; ++row) {
    for (int i = 0; i < 5 - row; ++i) {
      bricks += thing("s" + std::to_string(n++),
                      std::to_string(0.42 * i + 0.21 * row) + " 0 " +
                          std::to_string(0.1 + 0.2 * row) + " 0 0 0",
                      "<box><size>0.4 0.2 0.2</size></box>", 2, 0.6, 0.03);
    }
  }
  World w(bricks, 5000);
  EXPECT_LT(drift(w, 5), 2e-3);
}

// A mechanism 70 m away requests shorter substeps, for itself only.
TEST(Stacks, ADistantBodyChangesNoBit) {
  const std::string windmill =
      "<model name='mill'><pose>70 0 0 0 0 0</pose><link "
      "name='post'><inertial><mass>1</mass></inertial></link>"
      "<joint name='w' type='fixed'><parent>world</parent><child>post</child></joint><link "
      "name='arm'><pose>0 0 1 0 0 0</pose><inertial><pose>0.5 0 0 0 0 0</pose>"
      "<mass>2</mass></inertial><collision name='c'><geometry>" +
      kBall +
      "</geometry></collision></link><joint name='j' type='continuous'><parent>post</parent>"
      "<child>arm</child><axis><xyz>0 1 0</xyz></axis></joint></model>";
  const auto poses = [](const std::string& others) {
    World w(kPlane + stack(5) + others +
                thing("roller", "-70 0 0.1 0 0 0", kBall, others.empty() ? 1 : 2),
            5000);
    std::vector<Pose> result;
    for (int i = 0; i < 400; ++i) {
      if (i == 50) w.physics.apply_impulse(w.body("s4/l"), {0.8, 0.1, 0}, {0, 0, 0});
      w.physics.step();
      for (int k = 0; k < 5; ++k)
        result.push_back(w.physics.pose(w.body("s" + std::to_string(k) + "/l")));
    }
    return result;
  };
  const std::vector<Pose> alone = poses(""), with_others = poses(windmill);
  for (size_t i = 0; i < alone.size(); ++i) {
    ASSERT_TRUE(alone[i].translation == with_others[i].translation &&
                alone[i].rotation.coeffs() == with_others[i].rotation.coeffs())
        << "box " << i % 5 << " at step " << i / 5;
  }
  EXPECT_GT((alone.back().translation - alone[4].translation).norm(), 0.01);  // something happened
}

// A single sweep per substep is enough for what is at rest on a slope: it begins with the last
// friction, in the direction that this had.
TEST(Stacks, FrictionStartsFromTheLastSubstep) {
  World w(
      "<model name='slope'><static>true</static><pose>0 0 0 0 0.4 0</pose><link name='l'>"
      "<collision name='c'><geometry><plane/></geometry><surface><friction><ode><mu>0.8</mu>"
      "<mu2>0.8</mu2></ode></friction></surface></collision></link></model>" +
          thing("box", "0.0389 0 0.0921 0 0.4 0", kBox, 1, 0.8, 0.04 / 6),
      5000, "<solver><iters>1</iters></solver>");
  EXPECT_LT(drift(w, 2, "box/l"), 2e-3);
}

// The world's settings take effect: with two sweeps a stack falls that stands with the default.
TEST(Stacks, TheWorldsSolverActs) {
  World w(kPlane + stack(10), 5000, "<solver><iters>2</iters></solver>");
  EXPECT_GT(drift(w, 20), 0.05);
}

}  // namespace
}  // namespace ruedo::physics::testing
