// People: how one walks, what they avoid, and the cases that papers about crowds describe.
#include <cmath>
#include <map>

#include <gtest/gtest.h>

#include "sim.h"

namespace ruedo::robot::testing {
namespace {

std::string crowd_sdf(const std::string& name, int count, const std::string& area,
                      const std::string& more) {
  return "<ruedo:crowd name='" + name + "'><ruedo:count>" + std::to_string(count) +
         "</ruedo:count><ruedo:area>" + area + "</ruedo:area>" + more + "</ruedo:crowd>";
}

std::string goal(const std::string& at) { return "<ruedo:goal>" + at + "</ruedo:goal>"; }

// Without randomness: everybody prefers 1.3 m/s.
const char* const kAlike = "<ruedo:speed>1.3</ruedo:speed><ruedo:fluctuation>0</ruedo:fluctuation>";

class People : public Sim {
 public:
  explicit People(const std::string& models, int64_t step_us = 10'000) : Sim(models, step_us) {
    for (size_t i = 0; i < layout.bodies.size(); ++i) {
      const auto& model = *world->models[layout.bodies[i].instance].model;
      if (model.path) people.push_back(static_cast<int>(i));
    }
  }
  Vec3 at(size_t i) const { return state.bodies[people.at(i)].translation; }
  Vec3 velocity_of(size_t i) const { return state.body_twists[people.at(i)].linear; }
  bool is_of(size_t i, const std::string& crowd) const {
    return layout.bodies[people.at(i)].name.starts_with(crowd + "_");
  }
  double nearest_pair() const {
    double least = 1e9;
    for (size_t i = 0; i < people.size(); ++i)
      for (size_t k = 0; k < i; ++k) least = std::min(least, (at(i) - at(k)).norm());
    return least;
  }

  std::vector<int> people;
};

// dv/dt = (v0 - v) / 0.5 s, from rest: x = v0 (t - 0.5 (1 - exp(-2 t))).
TEST(Crowd, OneAloneComesToHisSpeed) {
  People sim(plane_sdf() + crowd_sdf("a", 1, "-0.01 -0.01 0.01 0.01", goal("50 0") + kAlike));
  const Vec3 from = sim.at(0);
  sim.run(3.0);
  const double way = 1.3 * (3.0 - 0.5 * (1.0 - std::exp(-6.0)));
  EXPECT_NEAR((sim.at(0) - from).norm(), way, 0.01);  // steps of 10 ms: half of one times 1.3 m/s
  EXPECT_NEAR(sim.velocity_of(0).norm(), 1.3, 0.01);
  EXPECT_EQ(sim.at(0).z(), 0.0);
}

TEST(Crowd, LikesToWalkAsPeopleDo) {  // 1.34 m/s in the mean, with a deviation of 0.26
  People sim(plane_sdf() + crowd_sdf("a", 200, "-50 -50 50 50",
                                     goal("1000 0") + "<ruedo:fluctuation>0</ruedo:fluctuation>"));
  sim.run(5.0);
  double sum = 0, squares = 0;
  for (size_t i = 0; i < sim.people.size(); ++i) {
    const double v = sim.velocity_of(i).norm();
    sum += v / 200;
    squares += v * v / 200;
  }
  EXPECT_NEAR(sum, 1.34, 3 * 0.26 / std::sqrt(200.0) + 0.02);
  EXPECT_NEAR(std::sqrt(squares - sum * sum), 0.26, 0.05);
}

TEST(Crowd, DependsOnTheSeedOnly) {
  const std::string text = plane_sdf() + crowd_sdf("a", 30, "-4 -4 4 4", "") +
                           crowd_sdf("b", 10, "-9 -9 -5 -5", goal("6 6"));
  const auto world = Sim(text).world;
  const auto places = [&](uint64_t seed, int64_t step_us) {
    Sim sim(text, step_us);
    Robots robots(*sim.world, sim.layout, sim.physics, seed);
    Snapshot state;
    for (int64_t t = 0; t < 6'000'000; t += step_us) robots.step();
    robots.read(state);
    std::vector<double> all;
    for (const Pose& pose : state.bodies)
      all.insert(all.end(), {pose.translation.x(), pose.translation.y()});
    return all;
  };
  const std::vector<double> first = places(3, 10'000);
  EXPECT_EQ(first, places(3, 10'000));
  EXPECT_NE(first, places(4, 10'000));
  const std::vector<double> finer = places(3, 2'000);  // they think every 10 ms, whatever the step
  for (size_t i = 0; i < first.size(); ++i) EXPECT_NEAR(first[i], finer[i], 1e-9);
}

TEST(Crowd, FindsTheDoor) {  // a room of 6 x 6 m whose door is on the side away from the goal
  const std::string walls =
      box_sdf("n", "0 3 1 0 0 0", "6.2 0.2 2") + box_sdf("s", "0 -3 1 0 0 0", "6.2 0.2 2") +
      box_sdf("e", "3 0 1 0 0 0", "0.2 6 2") + box_sdf("w1", "-3 1.9 1 0 0 0", "0.2 2.2 2") +
      box_sdf("w2", "-3 -1.9 1 0 0 0", "0.2 2.2 2");
  People sim(plane_sdf() + walls +
             crowd_sdf("a", 5, "0 -2 2 2", goal("8 0") + "<ruedo:at_end>stop</ruedo:at_end>"));
  for (int i = 0; i < 400; ++i) {
    sim.run(0.1);
    for (size_t k = 0; k < 5; ++k) {
      const Vec3 p = sim.at(k);
      const bool in_wall = std::abs(std::abs(p.y()) - 3) < 0.1 && std::abs(p.x()) < 3.1;
      EXPECT_FALSE(in_wall) << p.transpose();
    }
  }
  for (size_t k = 0; k < 5; ++k) EXPECT_GT(sim.at(k).x(), 5) << k;
}

TEST(Crowd, WalksAroundARobot) {
  const std::string person = crowd_sdf("a", 1, "-5.01 0.02 -4.99 0.04", goal("6 0") + kAlike);
  People sim(plane_sdf() + robot_sdf("r", "0 0 0 0 0 0") + person);
  double least = 1e9;
  for (int i = 0; i < 900; ++i) {
    sim.step();
    const Vec3 p = sim.at(0);
    const double dx = std::max(std::abs(p.x()) - 0.25, 0.0),
                 dy = std::max(std::abs(p.y()) - 0.23, 0.0);
    least = std::min(least, std::hypot(dx, dy));
  }
  EXPECT_GT(sim.at(0).x(), 4.0);
  EXPECT_GT(least, 0.25);  // his radius: he never touched it
  EXPECT_LT(sim.position().norm(), 1e-9);
}

TEST(Crowd, GoesToItsGoalsInTurnAndAgain) {
  People sim(plane_sdf() +
             crowd_sdf("a", 1, "-0.1 -0.1 0.1 0.1", goal("4 0") + goal("4 4") + kAlike));
  bool was_first = false, was_second = false, came_back = false;
  for (int i = 0; i < 150; ++i) {
    sim.run(0.1);
    was_first |= (sim.at(0) - Vec3(4, 0, 0)).norm() < 0.8;
    was_second |= was_first && (sim.at(0) - Vec3(4, 4, 0)).norm() < 0.8;
    came_back |= was_second && (sim.at(0) - Vec3(4, 0, 0)).norm() < 0.8;
  }
  EXPECT_TRUE(came_back);
}

// D. Helbing and P. Molnar (1995), section III: in a corridor people who walk in the same direction
// form lanes. Measured by the order parameter of M. Rex and H. Lowen (Phys. Rev. E 75 (2007)
// 051402): the mean of ((n_same - n_other) / n)^2 over the people in the same lane of 0.75 m, with
// n = n_same + n_other. Where directions mix at random each is 1 / n on average.
struct Lanes {
  double order = 0, by_chance = 0, speed = 0;
  int count = 0;
};

Lanes lanes_of(const People& sim, double half_width) {
  std::vector<size_t> within;  // the middle of the corridor
  for (size_t i = 0; i < sim.people.size(); ++i)
    if (std::abs(sim.at(i).x()) < 10) within.push_back(i);
  Lanes lanes;
  std::map<int, int> sides;  // by stretches of 0.75 m across
  const double part = 1.0 / static_cast<double>(within.size());
  for (const size_t i : within) {
    int same = 0, other = 0;
    for (const size_t k : within) {
      if (k == i || std::abs(sim.at(i).y() - sim.at(k).y()) > 0.375) continue;
      (sim.is_of(i, "east") == sim.is_of(k, "east") ? same : other)++;
    }
    const int sign = sim.is_of(i, "east") ? 1 : -1;
    if (same + other > 0) {
      const double mixed = (same - other) / static_cast<double>(same + other);
      lanes.order += part * mixed * mixed;
      lanes.by_chance += part / (same + other);
    }
    lanes.speed += part * sign * sim.velocity_of(i).x();
    sides[static_cast<int>(std::floor((sim.at(i).y() + half_width) / 0.75))] += sign;
  }
  int last = 0;
  for (const auto& [stretch, side] : sides) {
    const int sign = side > 0 ? 1 : side < 0 ? -1 : 0;
    lanes.count += sign != 0 && sign != last;
    if (sign != 0) last = sign;
  }
  return lanes;
}

TEST(Crowd, LanesForm) {
  const std::string walls =
      box_sdf("n", "0 3.1 1 0 0 0", "44 0.2 2") + box_sdf("s", "0 -3.1 1 0 0 0", "44 0.2 2");
  const std::string again = "<ruedo:at_end>again</ruedo:at_end>";
  People sim(plane_sdf() + walls +
             crowd_sdf("east", 40, "-20 -2.6 -12 2.6", goal("18 -2.6 20 2.6") + again) +
             crowd_sdf("west", 40, "12 -2.6 20 2.6", goal("-20 -2.6 -18 2.6") + again));
  sim.run(60.0);
  Lanes mean;
  int count = 0;
  constexpr int kLooks = 20;
  for (int i = 0; i < kLooks; ++i) {
    sim.run(1.0);
    const Lanes now = lanes_of(sim, 3);
    mean.order += now.order / kLooks;
    mean.by_chance += now.by_chance / kLooks;
    mean.speed += now.speed / kLooks;
    count += now.count;
    EXPECT_GT(sim.nearest_pair(), 0.35);  // two radii are 0.5 m: touching, not through each other
  }
  RecordProperty("order",
                 std::to_string(mean.order) + ", by chance " + std::to_string(mean.by_chance));
  EXPECT_GT(mean.order, 2 * mean.by_chance) << mean.order << " " << mean.by_chance;
  EXPECT_GT(mean.speed, 0.9);  // of 1.34 m/s: they pass
  EXPECT_GE(count, 2 * kLooks);
  EXPECT_LE(count, 6 * kLooks);  // in 6 m
}

// A. Seyfried and others, "New insights into pedestrian flow through bottlenecks", Transportation
// Science 43 (2009) 395: the flow grows linearly with the width, from 0.8 to 1.2 m, by 1.9 people a
// second and metre; others measured 1.3 to 2.2 (their fig. 5). Of 40 people a sixth is chance.
double flow_through(double width) {
  const double length = 4 - width / 2, middle = width / 2 + length / 2;
  const auto wall = [&](const char* name, double y) {
    return box_sdf(name, "0 " + std::to_string(y) + " 1 0 0 0",
                   "0.2 " + std::to_string(length) + " 2");
  };
  People sim(
      plane_sdf() + wall("left", middle) + wall("right", -middle) +
      box_sdf("n", "-5 4.1 1 0 0 0", "10.2 0.2 2") + box_sdf("s", "-5 -4.1 1 0 0 0", "10.2 0.2 2") +
      box_sdf("w", "-10 0 1 0 0 0", "0.2 8.4 2") +
      crowd_sdf("a", 60, "-7 -3 -1.5 3", goal("6 -1 8 1") + "<ruedo:at_end>stop</ruedo:at_end>"));
  int passed = 0, first = 10, last = 50;
  double began = 0, ended = 0;
  for (int i = 0; i < 12000 && passed < last; ++i) {
    sim.step();
    passed = 0;
    for (size_t k = 0; k < sim.people.size(); ++k) passed += sim.at(k).x() > 0;
    if (passed >= first && began == 0) began = 0.01 * i;
    ended = 0.01 * i;
  }
  EXPECT_GE(passed, last) << "of 60 people through " << width << " m";
  return (last - first) / (ended - began);
}

TEST(Crowd, FlowThroughADoorGrowsWithItsWidth) {
  const double widths[] = {0.8, 1.0, 1.2, 1.6, 2.0};
  double last = 0;
  for (const double width : widths) {
    const double flow = flow_through(width);
    RecordProperty("door_" + std::to_string(width), std::to_string(flow));
    EXPECT_GT(flow, last) << width;
    EXPECT_GT(flow / width, 1.3 * (1 - 1 / 6.)) << width;
    EXPECT_LT(flow / width, 2.2 * (1 + 1 / 6.)) << width;
    last = flow;
  }
}

}  // namespace
}  // namespace ruedo::robot::testing
