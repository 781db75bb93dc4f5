// Tracked vehicles whose flippers have belts, which drive what touches them.
#include <cmath>

#include <gtest/gtest.h>

#include <ruedo/joint_command_t.hpp>

#include "sim.h"

namespace ruedo::robot::testing {
namespace {

std::string belt(const std::string& name, const std::string& pose, const std::string& at,
                 const std::string& size, double mass) {
  return "<link name='" + name + "'><pose>" + pose + "</pose><inertial><pose>" + at +
         "</pose><mass>" + std::to_string(mass) +
         "</mass><inertia><ixx>0.02</ixx><iyy>0.05</iyy><izz>0.05</izz></inertia></inertial>"
         "<collision name='c'><pose>" +
         at + "</pose><geometry><box><size>" + size +
         "</size></box></geometry><surface><friction><ode><mu>0.7</mu><mu2>0.7</mu2></ode>"
         "</friction></surface></collision></link>";
}

// gz-sim's plugins: two tracks of 0.6 m, and a flipper of 0.3 m at each of their ends.
std::string crawler() {
  std::string text = "<model name='crawler'><pose>0 0 0.1 0 0 0</pose>" +
                     belt("base", "0 0 0 0 0 0", "0 0 0.1 0 0 0", "0.5 0.2 0.1", 10);
  std::string sides[2], controllers;
  for (const int side : {0, 1}) {
    const std::string s = side == 0 ? "left" : "right", y = side == 0 ? "0.2" : "-0.2";
    text += belt(s, "0 " + y + " 0 0 0 0", "0 0 0 0 0 0", "0.6 0.08 0.2", 4) + "<joint name='" + s +
            "_j' type='fixed'><parent>base</parent><child>" + s + "</child></joint>";
    sides[side] = "<" + s + "_track><link>" + s + "</link></" + s + "_track>";
    for (const bool front : {true, false}) {
      const std::string name = (front ? "front_" : "rear_") + s;
      text += belt(name,
                   (front ? "0.25 " : "-0.25 ") + std::string(side == 0 ? "0.28" : "-0.28") +
                       " 0 0 0 0",
                   front ? "0.15 0 0 0 0 0" : "-0.15 0 0 0 0 0", "0.3 0.05 0.06", 1) +
              "<joint name='" + name + "_j' type='revolute'><parent>" + s + "</parent><child>" +
              name + "</child><axis><xyz>0 1 0</xyz></axis></joint>";
      sides[side] += "<" + s + "_track><link>" + name + "</link></" + s + "_track>";
    }
  }
  return text +
         "<plugin name='gz::sim::systems::TrackedVehicle' "
         "filename='gz-sim-tracked-vehicle-system'>" +
         sides[0] + sides[1] +
         "<tracks_separation>0.4</tracks_separation></plugin><ruedo:joints/>" + "</model>";
}

// Of its joints: flippers of 0.3 m by 0.06 m, turned down by 1 rad, whose lower corners stand.
const double kOnFlippers_m = 0.3 * std::sin(1.0) + 0.03 * std::cos(1.0);

double height(const Sim& sim) { return sim.state.bodies[sim.body("crawler/base")].translation.z(); }

void stand_on_flippers(Sim& sim) {
  JointCommand command;
  for (const char* side : {"left", "right"}) {
    for (const auto& [end, angle] : {std::pair("front_", 1.0), std::pair("rear_", -1.0)}) {
      command.names.push_back(std::string(end) + side + "_j");
      command.modes.push_back(joint_command_t::POSITION);
      command.values.push_back(angle);
    }
  }
  sim.robots.apply({RobotIndex(0), command});
  sim.run(2.0);
  ASSERT_NEAR(height(sim), kOnFlippers_m, 1e-3);
}

TEST(Flippers, DriveARobotThatStandsOnThem) {
  Sim sim(plane_sdf() + crawler(), 1000);
  EXPECT_TRUE(sim.world->findings.empty());
  stand_on_flippers(sim);
  const double start = sim.position().x();
  for (int i = 0; i < 20; ++i) {
    sim.velocity(0.3, 0.0);
    sim.run(0.1);
  }
  // Friction of 0.7 takes it from rest to 0.3 m/s: v^2 / (2 mu g) are missing.
  EXPECT_NEAR(sim.position().x() - start, 0.6 - 0.0066, 1e-3);
  EXPECT_NEAR(height(sim), kOnFlippers_m, 1e-3);
  sim.velocity(0.0, 0.0);
  sim.run(0.5);
  const double yaw = sim.yaw();
  for (int i = 0; i < 20; ++i) {
    sim.velocity(0.0, 0.5);
    sim.run(0.1);
  }
  EXPECT_NEAR(sim.yaw() - yaw, 1.0, 0.01);
}

TEST(Flippers, DoNotHinderTheTracks) {
  Sim sim(plane_sdf() + crawler(), 1000);
  JointCommand up;
  for (const char* name : {"front_left_j", "front_right_j", "rear_left_j", "rear_right_j"}) {
    up.names.push_back(name);
    up.modes.push_back(joint_command_t::POSITION);
    up.values.push_back(name[0] == 'f' ? -0.8 : 0.8);
  }
  sim.robots.apply({RobotIndex(0), up});
  sim.run(1.0);
  const double start = sim.position().x();
  for (int i = 0; i < 20; ++i) {
    sim.velocity(0.3, 0.0);
    sim.run(0.1);
  }
  EXPECT_NEAR(sim.position().x() - start, 0.6, 1e-6);
}

}  // namespace
}  // namespace ruedo::robot::testing
