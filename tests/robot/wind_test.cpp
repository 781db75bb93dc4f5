// Wind and what it pushes: closed forms of dv/dt = gain (wind - v).
#include "robot/wind.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "robot/sim.h"

namespace ruedo::robot::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::string floating(const std::string& name, const std::string& pose, const std::string& more,
                     double mass = 1.0, bool gravity = false) {
  return "<model name='" + name + "'><pose>" + pose + "</pose><link name='l'><gravity>" +
         (gravity ? "true" : "false") + "</gravity>" + more + "<inertial><mass>" +
         std::to_string(mass) + "</mass></inertial></link></model>";
}

std::string plugin(const std::string& inside) {
  return "<plugin filename='gz-sim-wind-effects-system' name='gz::sim::systems::WindEffects'>" +
         inside + "</plugin>";
}

const std::string kFeels = "<enable_wind>true</enable_wind>";
const std::string kAtOnce =
    "<horizontal><magnitude><time_for_rise>0</time_for_rise></magnitude></horizontal>"
    "<vertical><time_for_rise>0</time_for_rise></vertical>";
const std::string kWind = "<wind><linear_velocity>3 0 -1</linear_velocity></wind>";

std::vector<std::string> texts(const Sim& sim) {
  std::vector<std::string> list;
  for (const Finding& finding : sim.world->findings) list.push_back(finding.text);
  return list;
}

Vec3 position(const Sim& sim, const std::string& name) {
  return sim.state.bodies.at(static_cast<size_t>(sim.body(name))).translation;
}

Twist twist(const Sim& sim, const std::string& name) {
  return sim.state.body_twists.at(static_cast<size_t>(sim.body(name)));
}

TEST(Wind, PushesLinksWithWindEnabled) {
  Sim sim(kWind + plugin(kAtOnce) + floating("light", "0 0 5 0 0 0", kFeels) +
              floating("heavy", "0 5 5 0 0 0", kFeels, 50.0) + floating("other", "0 9 5 0 0 0", ""),
          1000);
  sim.run(0.8);
  const double gone = 0.8 - (1 - std::exp(-0.8));  // of each m/s of wind
  for (const char* name : {"light/l", "heavy/l"}) {
    EXPECT_NEAR(position(sim, name).x(), 3 * gone, 3e-3) << name;
    EXPECT_NEAR(position(sim, name).z(), 5 - gone, 3e-3) << name;
  }
  EXPECT_EQ(position(sim, "other/l").x(), 0.0);
  EXPECT_THAT(texts(sim), IsEmpty());
}

// Gazebo's wind rises: w = 3 (1 - exp(-a t)) m/s, and with the gain k
// v = 3 (1 - (k exp(-a t) - a exp(-k t)) / (k - a)).
TEST(Wind, RisesAsItsPluginSays) {
  Sim sim(kWind +
              plugin("<force_approximation_scaling_factor>2.5"
                     "</force_approximation_scaling_factor><horizontal><magnitude>"
                     "<time_for_rise>0.5</time_for_rise></magnitude></horizontal>") +
              floating("kite", "0 0 5 0 0 0", kFeels),
          1000);
  EXPECT_EQ(sim.state.wind, Vec3::Zero());
  sim.run(0.8);
  const double a = 2, k = 2.5, t = 0.8;
  const double of_wind = 1 - (k * std::exp(-a * t) - a * std::exp(-k * t)) / (k - a);
  EXPECT_NEAR(twist(sim, "kite/l").linear.x(), 3 * of_wind, 5e-3);
  EXPECT_NEAR(sim.state.wind.x(), 3 * (1 - std::exp(-1.6)), 1e-12);
  EXPECT_NEAR(sim.state.wind.z(), -(1 - std::exp(-0.8)), 1e-12);  // by default within 1 s
}

// In calm air the same law is drag: what falls comes to g / k.
TEST(Wind, SlowsAFallingBody) {
  Sim sim(plugin("<force_approximation_scaling_factor>4</force_approximation_scaling_factor>") +
              floating("leaf", "0 0 50 0 0 0", kFeels, 0.01, true) +
              floating("stone", "0 5 50 0 0 0", "", 0.01, true),
          1000);
  sim.run(0.25);
  EXPECT_NEAR(twist(sim, "leaf/l").linear.z(), -9.8 / 4 * (1 - std::exp(-1.0)), 5e-3);
  sim.run(3.0);
  EXPECT_NEAR(twist(sim, "leaf/l").linear.z(), -9.8 / 4, 1e-3);
  EXPECT_NEAR(twist(sim, "stone/l").linear.z(), -9.8 * 3.25, 1e-6);
}

// 10 kg with mu 0.5 hold 49 N: 6 m/s with a gain of 0.7 push 42 N, 8 m/s 56 N. The wind reaches 8
// m/s long after everything has come to rest.
TEST(Wind, AStrongOneMovesAStandingBody) {
  const auto crate = [](const std::string& name, const std::string& pose) {
    std::string text = box_sdf(name, pose, "0.4 0.4 0.4", 10.0);
    return text.insert(text.find("<inertial>"), kFeels);
  };
  const auto world = [&](const std::string& speed) {
    return "<wind><linear_velocity>" + speed + " 0 0</linear_velocity></wind>" +
           plugin(
               "<force_approximation_scaling_factor>0.7</force_approximation_scaling_factor>"
               "<horizontal><magnitude><time_for_rise>4</time_for_rise></magnitude>"
               "</horizontal>") +
           plane_sdf() + crate("crate", "0 0 0.2 0 0 0");
  };
  Sim weak(world("6")), strong(world("8"));
  weak.run(12.0);
  EXPECT_NEAR(position(weak, "crate/l").x(), 0.0, 2e-3);
  strong.run(6.0);  // 8 (1 - exp(-1.5)) = 6.2 m/s: 43.5 N
  EXPECT_NEAR(position(strong, "crate/l").x(), 0.0, 2e-3);
  strong.run(6.0);  // 49 N at 8.3 s
  EXPECT_GT(position(strong, "crate/l").x(), 0.05);
}

// A model may enable wind for its links, and a link for itself; of links that form one body the
// enabled ones are pushed, where they are.
TEST(Wind, OfAModelAndOfOneLink) {
  const auto pair = [](const std::string& name, const std::string& of_model,
                       const std::string& of_link, const std::string& y) {
    return "<model name='" + name + "'><pose>0 " + y + " 5 0 0 0</pose>" + of_model +
           "<link name='a'><gravity>0</gravity></link><link name='b'><pose>0 1 0 0 0 "
           "0</pose><gravity>0</gravity>" +
           of_link +
           "</link><joint name='j' type='fixed'><parent>a</parent><child>b</child></joint></model>";
  };
  Sim sim(kWind + plugin(kAtOnce) + pair("all", kFeels, "", "0") +
              pair("one", kFeels, "<enable_wind>false</enable_wind>", "10"),
          1000);
  sim.run(0.1);
  EXPECT_NEAR(twist(sim, "all/a").angular.norm(), 0.0, 1e-9);
  // At first half the force, 0.5 m beside the middle of two unit masses of unit moments: the moment
  // about z is 2 (1 + 0.25), the torque 3 N times 0.5 m, towards +z.
  EXPECT_NEAR(twist(sim, "one/a").angular.z(), 0.1 * 3 * 0.5 / 2.5, 0.1 * 0.6 * 0.1);
}

TEST(Wind, WithoutItsPluginPushesNothingAndWarns) {
  Sim sim(kWind + floating("kite", "0 0 5 0 0 0", kFeels), 1000);
  sim.run(0.5);
  EXPECT_EQ(position(sim, "kite/l").x(), 0.0);
  EXPECT_EQ(sim.state.wind, Vec3(3, 0, -1));
  EXPECT_THAT(texts(sim), ElementsAre(HasSubstr("the wind pushes only with the plugin")));
}

TEST(Wind, SwingsAndTurns) {
  Sim sim("<wind><linear_velocity>0 4 0</linear_velocity></wind>" +
          plugin("<horizontal><magnitude><time_for_rise>0</time_for_rise><sin>"
                 "<amplitude_percent>0.25</amplitude_percent><period>8</period></sin></magnitude>"
                 "<direction><sin><amplitude>30</amplitude><period>12</period></sin></direction>"
                 "</horizontal>"));
  const Wind wind(sim.world->environment.wind, 1);
  // After 2 s the speed is 4 * 1.25, after 3 s the direction 90 + 30 degrees.
  EXPECT_NEAR(wind.at(2000, 1000).norm(), 5.0, 1e-12);
  const Vec3 turned = wind.at(3000, 1000);
  EXPECT_NEAR(std::atan2(turned.y(), turned.x()), 120 * M_PI / 180, 1e-12);
}

TEST(Wind, ItsNoiseIsOfTheSeedAndTheFile) {
  const std::string noise = "<noise type='gaussian'><mean>0.5</mean><stddev>0.2</stddev></noise>";
  Sim sim("<wind><linear_velocity>2 0 0</linear_velocity></wind>" +
          plugin("<horizontal><magnitude><time_for_rise>0</time_for_rise>" + noise +
                 "</magnitude></horizontal><vertical>" + noise + "</vertical>"));
  const Wind wind(sim.world->environment.wind, 7), same(sim.world->environment.wind, 7),
      other(sim.world->environment.wind, 8);
  constexpr int kDraws = 20'000;
  double sum = 0, squares = 0;
  for (int i = 0; i < kDraws; ++i) {
    const Vec3 v = wind.at(i, 1000);
    ASSERT_EQ(v, same.at(i, 1000));
    ASSERT_NE(v, other.at(i, 1000));
    const double z = (v.x() - 2.5) / 0.2;
    sum += z, squares += z * z;
  }
  EXPECT_LT(std::abs(sum), 3.29 * std::sqrt(kDraws));
  EXPECT_NEAR(squares / kDraws, 1.0, 3.29 * std::sqrt(2.0 / kDraws));
}

TEST(Wind, WarnsAboutUnsupportedElements) {
  struct Case {
    const char* inside;
    const char* text;
  };
  for (const Case& c :
       {Case{"<force_approximation_scaling_factor><k>1</k></force_approximation_scaling_factor>",
             "by places is not supported"},
        Case{"<vertical><noise type='gaussian_quantized'><stddev>1</stddev></noise></vertical>",
             "the noise 'gaussian_quantized' of the wind's vertical speed"},
        Case{"<horizontal><direction><noise type='gaussian'><bias_stddev>1</bias_stddev></noise>"
             "</direction></horizontal>",
             "<bias_stddev> of the wind's direction"},
        Case{"<vertical><time_for_rise>-1</time_for_rise></vertical>",
             "<vertical/time_for_rise>: '-1' is not allowed"}}) {
    Sim sim(kWind + plugin(c.inside));
    EXPECT_THAT(texts(sim), ElementsAre(HasSubstr(c.text)));
  }
}

}  // namespace
}  // namespace ruedo::robot::testing
