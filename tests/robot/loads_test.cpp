// How a robot's weight is shared by more supports than rigid bodies need: as by equal springs.
#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "sim.h"

namespace ruedo::robot::testing {
namespace {

struct Stand {
  double x, y;
  bool wheel = true;  // else a rigid caster without friction
};

constexpr double kRadius = 0.1, kBody_kg = 12.0, kWheel_kg = 1.0, kGravity = 9.8;

std::string number(double value) { return std::to_string(value); }

const std::string kNoFriction =
    "<surface><friction><ode><mu>0</mu><mu2>0</mu2></ode></friction></surface>";

std::string caster(const Stand& stand, size_t index) {
  return "<collision name='caster" + std::to_string(index) + "'><pose>" + number(stand.x) + " " +
         number(stand.y) + " 0.05 0 0 0</pose><geometry><sphere><radius>0.05</radius></sphere>" +
         "</geometry>" + kNoFriction + "</collision>";
}

// A round one touches at a single point, which is known beforehand.
std::string wheel(const Stand& stand, size_t index, const std::string& mu, bool round) {
  const std::string shape =
      round ? "<sphere><radius>" + number(kRadius) + "</radius></sphere>"
            : "<cylinder><radius>" + number(kRadius) + "</radius><length>0.04</length></cylinder>";
  const std::string name = "wheel" + std::to_string(index);
  return "<link name='" + name + "'><pose>" + number(stand.x) + " " + number(stand.y) + " " +
         number(kRadius) + " -1.5707963267948966 0 0</pose><inertial><mass>" + number(kWheel_kg) +
         "</mass><inertia><ixx>0.003</ixx><iyy>0.003</iyy><izz>0.005</izz></inertia></inertial>" +
         "<collision name='c'><geometry>" + shape + "</geometry><surface><friction><ode><mu>" + mu +
         "</mu><mu2>" + mu + "</mu2></ode></friction></surface></collision></link><joint name='" +
         name + "_joint' type='continuous'><parent>base</parent><child>" + name +
         "</child><axis><xyz>0 0 1</xyz></axis></joint>";
}

// The body's own centre of mass is at (ahead, 0, 0.15).
std::string standing(const std::vector<Stand>& stands, double ahead, const std::string& pose,
                     const std::string& type, const std::string& mu = "0.8") {
  std::string casters, wheels, sides;
  for (size_t i = 0; i < stands.size(); ++i) {
    if (!stands[i].wheel) {
      casters += caster(stands[i], i);
      continue;
    }
    wheels += wheel(stands[i], i, mu, type == "kinematic");
    const std::string side = stands[i].y > 0 ? "left_joint" : "right_joint";
    sides += "<ruedo:" + side + ">wheel" + std::to_string(i) + "_joint</ruedo:" + side + ">";
  }
  return "<model name='r'><pose>" + pose + "</pose><link name='base'><inertial><pose>" +
         number(ahead) + " 0 0.15 0 0 0</pose><mass>" + number(kBody_kg) +
         "</mass><inertia><ixx>0.2</ixx><iyy>0.3</iyy><izz>0.4</izz></inertia></inertial>" +
         casters + "</link>" + wheels + "<ruedo:drive type='" + type + "'>" + sides +
         "<ruedo:watchdog>0</ruedo:watchdog>" + limits(1.0, 2.0, 1.0, 1.0, 2.0) +
         "</ruedo:drive></model>";
}

// For a body on a spring at each place: its deflection is a plane, a + b x + c y, and so are the
// loads.
std::vector<double> on_springs(const std::vector<Stand>& stands, double ahead) {
  double weight = kBody_kg, moment_x = kBody_kg * ahead, moment_y = 0.0;
  Eigen::Matrix3d stiffness = Eigen::Matrix3d::Zero();
  for (const Stand& stand : stands) {
    const Vec3 place(1.0, stand.x, stand.y);
    stiffness += place * place.transpose();
    if (!stand.wheel) continue;
    weight += kWheel_kg;
    moment_x += kWheel_kg * stand.x;
    moment_y += kWheel_kg * stand.y;
  }
  const Vec3 sinking = stiffness.inverse() * (kGravity * Vec3(weight, moment_x, moment_y));
  std::vector<double> loads;
  for (const Stand& stand : stands) loads.push_back(sinking.dot(Vec3(1.0, stand.x, stand.y)));
  return loads;
}

std::vector<double> loads(const Sim& sim, const std::vector<Stand>& stands) {
  std::vector<double> sums(stands.size(), 0.0);
  const Pose X_BaseW = sim.robot().X_WBase.inverse();
  for (const Contact& contact : sim.state.contacts) {
    const Vec3 at = X_BaseW * contact.position;
    for (size_t i = 0; i < stands.size(); ++i) {
      if (std::hypot(at.x() - stands[i].x, at.y() - stands[i].y) < 0.03) sums[i] += contact.force;
    }
  }
  return sums;
}

const std::vector<Stand> kTwoWheelsTwoCasters = {
    {0, 0.2}, {0, -0.2}, {0.2, 0, false}, {-0.2, 0, false}};
const std::vector<Stand> kSixWheels = {{0.25, 0.2}, {0.25, -0.2}, {0, 0.2},
                                       {0, -0.2},   {-0.3, 0.2},  {-0.3, -0.2}};
const std::vector<Stand> kFourWheelsAndACaster = {
    {0.2, 0.2}, {0.2, -0.2}, {-0.2, 0.2}, {-0.2, -0.2}, {0.05, 0, false}};

void expect_loads(const Sim& sim, const std::vector<Stand>& stands, double ahead) {
  const std::vector<double> is = loads(sim, stands), wanted = on_springs(stands, ahead);
  for (size_t i = 0; i < stands.size(); ++i)
    EXPECT_NEAR(is[i], wanted[i], 0.02 * wanted[i]) << "place " << i << ", ahead " << ahead;
}

TEST(Loads, AreThoseOfABodyOnEqualSprings) {
  for (const auto& stands : {kTwoWheelsTwoCasters, kSixWheels, kFourWheelsAndACaster}) {
    for (const double ahead : {0.0, 0.03, -0.05}) {
      std::vector<Stand> order = stands;
      for (int k = 0; k < 2; ++k) {
        Sim sim(plane_sdf() + standing(order, ahead, "0 0 0 0 0 0", "wheels"));
        sim.run(1.0);
        expect_loads(sim, order, ahead);
        std::reverse(order.begin(), order.end());
      }
    }
  }
}

// A kinematic robot is one body; on anything but a plane it stands on its contacts.
TEST(Loads, OfOneBodyAreSharedToo) {
  for (const auto& stands : {kTwoWheelsTwoCasters, kSixWheels}) {
    Sim sim(box_sdf("floor", "0 0 -0.1 0 0 0", "10 10 0.2") +
            standing(stands, 0.03, "0 0 0 0 0 0", "kinematic"));
    sim.run(1.0);
    expect_loads(sim, stands, 0.03);
  }
}

TEST(Loads, StayWithTheWheelsWhileTheyDrive) {
  for (const auto& stands : {kTwoWheelsTwoCasters, kFourWheelsAndACaster}) {
    Sim sim(plane_sdf() + standing(stands, 0.02, "0 0 0 0 0 0", "wheels"));
    sim.run(1.0);
    sim.velocity(0.5, 0.0);
    sim.run(2.0);
    const double begin = sim.position().x();
    sim.run(4.0);
    EXPECT_NEAR((sim.position().x() - begin) / 4.0, 0.5, 0.002);
    expect_loads(sim, stands, 0.02);
  }
  // Two wheels turn without skidding.
  Sim sim(plane_sdf() + standing(kTwoWheelsTwoCasters, 0.0, "0 0 0 0 0 0", "wheels"));
  sim.velocity(0.0, 0.5);
  sim.run(1.0);
  const double begin = sim.yaw();
  sim.run(2.0);
  EXPECT_NEAR(wrap_angle(sim.yaw() - begin), 1.0, 0.02);
}

// Half of the weight is on the wheels: friction holds it up to tan(angle) = mu / 2.
TEST(Loads, OfTheWheelsHoldItOnASlope) {
  const double mu = 0.8;
  for (const std::string type : {"wheels", "kinematic"}) {
    for (const double part : {0.9, 1.1}) {
      const double angle = std::atan(part * mu / 2);
      const std::string turn = "0 " + number(-angle) + " 0";
      Sim sim(box_sdf("slope",
                      number(0.1 * std::sin(angle)) + " 0 " + number(-0.1 * std::cos(angle)) + " " +
                          turn,
                      "40 4 0.2", 0.0, 1.0) +
              standing(kTwoWheelsTwoCasters, 0.0, "0 0 0 " + turn, type, number(mu)));
      sim.run(0.5);
      const double begin = sim.position().norm(), begin_v = sim.robot().twist.linear.norm();
      sim.run(2.0);
      const double way = sim.position().norm() - begin;
      const double slides = kGravity * (std::sin(angle) - mu / 2 * std::cos(angle));
      if (part < 1.0) {
        EXPECT_LT(std::abs(way), 1e-3) << type;
      } else {
        EXPECT_NEAR(way, 2.0 * begin_v + 2.0 * slides, 0.2) << type << " " << slides;
        EXPECT_GT(way, 0.3) << type;
      }
    }
  }
}

}  // namespace
}  // namespace ruedo::robot::testing
