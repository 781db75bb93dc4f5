// The view of a world from outside: outliers do not count, the floor is below the robots.
#include "scene/pictures/overview.h"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "world/load.h"

namespace ruedo::scene {
namespace {

std::string box(const std::string& name, const std::string& pose, const std::string& size) {
  return "<model name='" + name + "'><static>true</static><pose>" + pose +
         " 0 0 0</pose><link name='l'><visual name='v'><geometry><box><size>" + size +
         "</size></box></geometry></visual></link></model>";
}

std::string robot(const std::string& name, const std::string& place) {
  return "<include><uri>model://p3dx</uri><name>" + name + "</name><pose>" + place +
         " 0 0 0</pose></include>";
}

Overview overview_of(const std::string& content) {
  return overview(*world::load_world_text(
      "<sdf version='1.9'><world name='w'>" + content + "</world></sdf>", "/nowhere/w.sdf"));
}

// Walls of a room of 10 x 10 m, 3 m high, whose floor is at that height.
std::string walls(double floor) {
  const std::string z = std::to_string(floor + 1.5);
  return box("w1", "5 0 " + z, "0.2 10 3") + box("w2", "-5 0 " + z, "0.2 10 3") +
         box("w3", "0 5 " + z, "10 0.2 3") + box("w4", "0 -5 " + z, "10 0.2 3");
}

TEST(Overview, IgnoresThingsFarOutside) {
  for (const char* far : {"343582 0 0", "0 -343582 0", "1 1 343582", "0 0 -9000"}) {
    const Overview seen = overview_of(walls(0.0) + box("ball", far, "0.1 0.1 0.1"));
    EXPECT_LT((seen.shown.high - seen.shown.low).maxCoeff(), 10.3) << far;
    EXPECT_NEAR(seen.shown.low.x(), -5.1, 1e-9) << far;
  }
}

TEST(Overview, IncludesThingsBesideTheRest) {
  const Overview seen =
      overview_of(box("house", "0 0 2", "6 6 4") + box("letters", "12 0 0.5", "0.2 0.2 1"));
  EXPECT_NEAR(seen.shown.high.x(), 12.1, 1e-9);
}

TEST(Overview, AllRobotsCount) {
  std::string content = box("house", "0 0 2", "6 6 4");
  for (int i = 1; i <= 30; ++i)
    content += robot("r" + std::to_string(i), std::to_string(40 * i) + " 0 0");
  EXPECT_GT(overview_of(content).shown.high.x(), 1200.0);
}

TEST(Overview, IncludesAFloorUnlessItIsMuchLargerThanItsContents) {
  EXPECT_NEAR(overview_of(walls(0.0) + box("yard", "0 0 -0.01", "30 30 0.02")).shown.high.x(), 15.0,
              1e-9);
  EXPECT_NEAR(overview_of(walls(0.0) + box("yard", "0 0 -0.01", "900 900 0.02")).shown.high.x(),
              5.1, 1e-9);
  EXPECT_NEAR(overview_of(box("yard", "0 0 -0.01", "900 900 0.02")).shown.high.x(), 450.0, 1e-9);
}

// A room whose roof is cut off 2 m above its floor, also over a cellar, and on an upper floor.
TEST(Overview, TheFloorIsBelowTheRobots) {
  const auto room = [](double floor, const std::string& more) {
    const auto at = [&](double z) { return "0 0 " + std::to_string(floor + z); };
    return overview_of(walls(floor) + box("floor", at(-0.05), "10 10 0.1") +
                       box("roof", at(3.05), "10 10 0.1") + more);
  };
  const std::string cellar = box("cellar", "0 0 -3", "9 9 0.1");
  for (const Overview& seen : {room(0.0, ""), room(0.0, cellar), room(0.0, robot("r", "1 1 0"))}) {
    EXPECT_EQ(seen.floor, 0.0);
    EXPECT_THAT(seen.ceiling, testing::Optional(2.0));
  }
  const Overview upper = room(6.0, robot("r", "1 1 6"));
  EXPECT_EQ(upper.floor, 6.0);
  EXPECT_THAT(upper.ceiling, testing::Optional(8.0));
  EXPECT_FALSE(overview_of(walls(0.0)).ceiling) << "it is open";
}

// As gz-sim's contact_sensor.sdf: a ball that falls from 3 m over the ground covers all of itself.
TEST(Overview, AMovingBodyIsNotARoof) {
  const std::string ground =
      "<model name='g'><static>true</static><link name='l'><visual name='v'><geometry><plane>"
      "<normal>0 0 1</normal><size>100 100</size></plane></geometry></visual></link></model>";
  std::string ball = box("ball", "0 0 3", "1 1 1");
  const std::string fixed = "<static>true</static>";
  EXPECT_TRUE(overview_of(ground + ball).ceiling) << "a fixed one is";
  ball.replace(ball.find(fixed), fixed.size(), "");
  EXPECT_FALSE(overview_of(ground + ball).ceiling);
  const auto open = without_what_is_above(
      *world::load_world_text("<sdf version='1.9'><world name='w'>" + ball +
                                  box("roof", "0 0 3", "9 9 0.1") + "</world></sdf>",
                              "/nowhere/w.sdf"),
      2.0);
  EXPECT_EQ(open->models[0].model->links[0].visuals.size(), 1U);
  EXPECT_EQ(open->models[1].model->links[0].visuals.size(), 0U);
}

TEST(Overview, AWorldWithoutAnythingHasOne) {
  const Overview seen = overview_of("");
  EXPECT_LT(seen.shown.low.x(), seen.shown.high.x());
  EXPECT_FALSE(seen.ceiling);
}

}  // namespace
}  // namespace ruedo::scene
