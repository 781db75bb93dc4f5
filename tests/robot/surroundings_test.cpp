// Conveyor belts, and doors that open when somebody comes near.
#include <cmath>

#include <gtest/gtest.h>

#include "sim.h"

namespace ruedo::robot::testing {
namespace {

std::string thing(const std::string& name, const std::string& pose, const std::string& size,
                  const std::string& more) {
  return "<model name='" + name + "'><pose>" + pose +
         "</pose><link name='l'><collision name='c'><geometry><box><size>" + size +
         "</size></box></geometry></collision></link>" + more + "</model>";
}

TEST(Belt, CarriesItsLoad) {  // turned by 90 degrees: its x is the world's y
  Sim sim(plane_sdf() +
          thing("belt", "0 0 0.25 0 0 1.5707963267948966", "6 1 0.5",
                "<ruedo:belt><ruedo:velocity>0.4 0 0</ruedo:velocity></ruedo:belt>") +
          box_sdf("box", "0 -2 0.6 0 0 0", "0.2 0.2 0.2", 1.0, 0.8));
  sim.run(1.0);
  const int box = sim.body("box/l"), belt = sim.body("belt/l");
  EXPECT_NEAR(sim.state.body_twists[box].linear.y(), 0.4, 0.02);
  const double from = sim.state.bodies[box].translation.y();
  sim.run(2.0);
  const Vec3 at = sim.state.bodies[box].translation;
  EXPECT_NEAR(at.y() - from, 0.8, 0.02);
  EXPECT_NEAR(at.z(), 0.6, 0.005);
  EXPECT_EQ(sim.state.bodies[belt].translation, Vec3(0, 0, 0.25));
}

TEST(Belt, CarriesARobot) {
  Sim sim(plane_sdf() +
          thing("belt", "0 0 -0.25 0 0 0", "8 2 0.6",
                "<ruedo:belt><ruedo:velocity>0.3 0 0</ruedo:velocity></ruedo:belt>") +
          robot_sdf("r", "-2 0 0.05 0 0 0"));
  sim.run(3.0);
  EXPECT_NEAR(sim.position().x(), -2 + 0.3 * 3, 0.05);
}

TEST(Door, OpensForARobotAndClosesBehindIt) {
  const std::string door =
      thing("door", "2 0 1 0 0 0", "0.1 1 2",
            "<ruedo:door><ruedo:open>0 1.1 0 0 0 0</ruedo:open><ruedo:time>1</ruedo:time>"
            "<ruedo:distance>1.5</ruedo:distance><ruedo:hold>0.5</ruedo:hold></ruedo:door>");
  Sim sim(plane_sdf() + door + robot_sdf("r", "0 0 0 0 0 0"));
  const auto door_at = [&] { return sim.state.bodies[sim.body("door/l")].translation.y(); };
  sim.run(2.0);
  EXPECT_EQ(door_at(), 0.0);
  sim.move(Move::ADVANCE, 4.0, 0, 0.5);
  double widest = 0;
  for (int i = 0; i < 200; ++i) {
    sim.run(0.05);
    widest = std::max(widest, door_at());
    if (door_at() > 0) {
      EXPECT_GT(sim.position().x(), 0.5);
    }
  }
  EXPECT_NEAR(widest, 1.1, 1e-12);
  EXPECT_NEAR(sim.position().x(), 4.0, 1e-3);  // it went through
  EXPECT_NEAR(door_at(), 0.0, 1e-12);          // and it is closed
}

TEST(Door, TurnsAboutItsModelsOrigin) {  // the hinge
  const std::string door =
      "<model name='door'><pose>1 0.5 0 0 0 0</pose><link name='l'><pose>0 -0.5 1 0 0 0</pose>"
      "<collision name='c'><geometry><box><size>0.05 1 2</size></box></geometry></collision></link>"
      "<ruedo:door><ruedo:open>0 0 0 0 0 -1.5</ruedo:open><ruedo:time>0.5</ruedo:time></ruedo:door>"
      "</model>";
  Sim sim(plane_sdf() + door + robot_sdf("r", "0 0 0 0 0 0"));
  sim.run(1.0);
  const Pose X_WL = sim.state.bodies[sim.body("door/l")];
  EXPECT_NEAR(X_WL.translation.x(), 1 - 0.5 * std::sin(1.5), 1e-9);
  EXPECT_NEAR(X_WL.translation.y(), 0.5 - 0.5 * std::cos(1.5), 1e-9);
}

TEST(Surroundings, WrongOnesAreRefused) {
  const auto fault = [](const std::string& more) {
    try {
      Sim sim(thing("t", "0 0 0 0 0 0", "1 1 1", more));
    } catch (const InputError& error) {
      return error.message();
    }
    return std::string("nothing");
  };
  EXPECT_EQ(fault("<ruedo:belt/>"), "<ruedo:belt>: has no <ruedo:velocity>");
  EXPECT_EQ(fault("<ruedo:door/>"), "<ruedo:door>: has no <ruedo:open>");
  EXPECT_NE(fault("<ruedo:door><ruedo:open>1 0 0 0 0 0</ruedo:open><ruedo:wide/></ruedo:door>"),
            "nothing");
  EXPECT_NE(fault("<ruedo:belt><ruedo:velocity>1 0 0</ruedo:velocity></ruedo:belt><ruedo:path/>"),
            "nothing");
}

}  // namespace
}  // namespace ruedo::robot::testing
