// Loads of rigid bodies on more contacts than necessary: as on equal springs, whatever the order.
#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "world.h"

namespace ruedo::physics::testing {
namespace {

std::string number(double value) { return std::to_string(value); }

// A ball of 2 cm that stands on the ground at (x, y).
std::string foot(size_t index, double x, double y) {
  return "<collision name='foot" + std::to_string(index) + "'><pose>" + number(x) + " " +
         number(y) + " 0.02 0 0 0</pose><geometry><sphere><radius>0.02</radius></sphere>" +
         "</geometry></collision>";
}

std::string inertial(double mass, double x, double y, double z) {
  return "<inertial><pose>" + number(x) + " " + number(y) + " " + number(z) +
         " 0 0 0</pose><mass>" + number(mass) +
         "</mass><inertia><ixx>0.5</ixx><iyy>0.5</iyy><izz>0.5</izz></inertia></inertial>";
}

double load_at(const World& world, const std::string& body, double x, double y) {
  double sum = 0.0;
  for (const Contact& contact : world.physics.contacts(world.body(body))) {
    if (std::hypot(contact.position.x() - x, contact.position.y() - y) < 0.03) sum += contact.force;
  }
  return sum;
}

using Places = std::vector<std::pair<double, double>>;

// For a weight at (x, y) on a spring at each place.
std::vector<double> on_springs(const Places& places, double weight, double x, double y) {
  Eigen::Matrix3d stiffness = Eigen::Matrix3d::Zero();
  for (const auto& [px, py] : places) {
    const Vec3 place(1.0, px, py);
    stiffness += place * place.transpose();
  }
  const Vec3 sinking = stiffness.inverse() * (weight * Vec3(1.0, x, y));
  std::vector<double> loads;
  for (const auto& [px, py] : places) loads.push_back(sinking.dot(Vec3(1.0, px, py)));
  return loads;
}

const Places kTable = {{0.4, 0.3}, {-0.4, 0.3}, {-0.4, -0.3}, {0.4, -0.3}};
const Places kSeven = {{0.4, 0.3}, {-0.4, 0.3}, {-0.4, -0.3}, {0.4, -0.3},
                       {0.0, 0.3}, {0.1, -0.3}, {0.0, 0.0}};

TEST(Loads, OfATableAreThoseOfEqualSprings) {
  for (Places places : {kTable, kSeven}) {
    for (int k = 0; k < 3; ++k) {
      std::string feet;
      for (size_t i = 0; i < places.size(); ++i) feet += foot(i, places[i].first, places[i].second);
      World world(kPlane + "<model name='table'><link name='l'>" + inertial(20, 0.1, 0.05, 0.4) +
                  feet + "</link></model>");
      world.run(0.5);
      const std::vector<double> wanted = on_springs(places, 200.0, 0.1, 0.05);
      for (size_t i = 0; i < places.size(); ++i) {
        EXPECT_NEAR(load_at(world, "table/l", places[i].first, places[i].second), wanted[i],
                    0.01 * wanted[i])
            << i << " of " << places.size() << ", order " << k;
      }
      std::rotate(places.begin(), places.begin() + 1, places.end());
      std::reverse(places.begin() + 1, places.end());
    }
  }
}

// So many contacts share nothing out, and cost no more than they have to.
TEST(Loads, OfAThousandFeet) {
  std::string feet;
  for (size_t i = 0; i < 1000; ++i) {
    feet += "<collision name='foot" + std::to_string(i) + "'><pose>" +
            number(0.1 * static_cast<double>(i % 40)) + " " +
            number(0.1 * static_cast<double>(i / 40)) +
            " 0.02 0 0 0</pose><geometry><box><size>0.04 0.04 0.04</size></box></geometry>"
            "</collision>";
  }
  World world(kPlane + "<model name='table'><link name='l'>" + inertial(20, 2.0, 1.2, 0.4) + feet +
              "</link></model>");
  world.run(0.1);
  double sum = 0.0;
  for (const Contact& contact : world.physics.contacts(world.body("table/l"))) sum += contact.force;
  EXPECT_NEAR(sum, 200.0, 2.0);
  EXPECT_NEAR(world.position("table/l").z(), 0.0, 1e-3);
}

// Two bodies that no joint connects each share their load among their own contacts: a table on top
// of another.
TEST(Loads, OfATableOnATable) {
  std::string feet;
  for (size_t i = 0; i < kTable.size(); ++i) feet += foot(i, kTable[i].first, kTable[i].second);
  const std::string top =
      "<collision name='top'><pose>0 0 0.42 0 0 0</pose><geometry><box><size>1.2 1 "
      "0.04</size></box>"
      "</geometry></collision>";
  World world(kPlane + "<model name='lower'><link name='l'>" + inertial(20, 0.1, 0.05, 0.4) + feet +
              top +
              "</link></model><model name='upper'><pose>0 0 0.44 0 0 0</pose><link name='l'>" +
              inertial(20, 0.1, 0.05, 0.2) + feet + "</link></model>");
  world.run(0.5);
  const std::vector<double> wanted = on_springs(kTable, 200.0, 0.1, 0.05);
  for (size_t i = 0; i < kTable.size(); ++i) {
    const auto& [x, y] = kTable[i];
    EXPECT_NEAR(load_at(world, "upper/l", x, y), wanted[i], 0.01 * wanted[i]) << i;
    // The lower table's foot bears both tables, and the upper one's foot stands above it.
    EXPECT_NEAR(load_at(world, "lower/l", x, y), 3 * wanted[i], 0.03 * wanted[i]) << i;
  }
}

// Set down with one foot first, and once after sliding: the history is forgotten.
TEST(Loads, DoNotRememberHowItCameThere) {
  std::string feet;
  for (size_t i = 0; i < kTable.size(); ++i) feet += foot(i, kTable[i].first, kTable[i].second);
  World world(kPlane + "<model name='table'><pose>0 0 0.03 0.03 -0.05 0</pose><link name='l'>" +
              inertial(20, 0.1, 0.05, 0.2) + feet + "</link></model>");
  world.run(3.0);
  const Pose X = world.physics.pose(world.body("table/l"));
  const std::vector<double> wanted = on_springs(kTable, 200.0, 0.1, 0.05);
  for (size_t i = 0; i < kTable.size(); ++i) {
    const Vec3 at = X * Vec3(kTable[i].first, kTable[i].second, 0.0);
    EXPECT_NEAR(load_at(world, "table/l", at.x(), at.y()), wanted[i], 0.01 * wanted[i]) << i;
  }
}

// Three supports in a line are one too many, too.
TEST(Loads, OfAPlankOnThreeSupports) {
  const Places places = {{-1.0, 0.0}, {0.0, 0.0}, {0.5, 0.0}};
  std::string feet;
  for (size_t i = 0; i < 3; ++i) feet += foot(i, places[i].first, 0.0);
  World world(kPlane + "<model name='plank'><link name='l'>" + inertial(10, -0.1, 0, 0.02) + feet +
              "</link></model>");
  world.run(0.5);
  // Springs at x_i under 100 N at -0.1: F_i = a + b x_i, sums 3 a - 0.5 b = 100 and
  // -0.5 a + 1.25 b = -10.
  const double b = (50.0 - 30.0) / (3.0 * 1.25 - 0.25), a = (100.0 + 0.5 * b) / 3.0;
  for (size_t i = 0; i < 3; ++i) {
    const double wanted = a + b * places[i].first;
    EXPECT_NEAR(load_at(world, "plank/l", places[i].first, 0.0), wanted, 0.01 * wanted) << i;
  }
}

// A cart without a drive: its four wheels are bodies of their own, connected by joints.
TEST(Loads, OfACartsWheels) {
  const Places places = {{0.3, 0.2}, {0.3, -0.2}, {-0.2, 0.2}, {-0.2, -0.2}};
  for (const bool reversed : {false, true}) {
    std::string wheels;
    for (size_t k = 0; k < 4; ++k) {
      const size_t i = reversed ? 3 - k : k;
      const std::string name = "w" + std::to_string(i);
      wheels += "<link name='" + name + "'><pose>" + number(places[i].first) + " " +
                number(places[i].second) + " 0.1 0 0 0</pose><inertial><mass>0.5</mass><inertia>" +
                "<ixx>0.002</ixx><iyy>0.002</iyy><izz>0.002</izz></inertia></inertial>" +
                "<collision name='c'><geometry><sphere><radius>0.1</radius></sphere></geometry>" +
                "</collision></link><joint name='j" + name +
                "' type='revolute'><parent>base</parent><child>" + name +
                "</child><axis><xyz>0 1 0</xyz></axis></joint>";
    }
    World world(kPlane + "<model name='cart'><link name='base'>" + inertial(20, 0.1, -0.05, 0.2) +
                "</link>" + wheels + "</model>");
    world.run(0.5);
    const double x = (20 * 0.1 + 2 * 0.05) / 22, y = 20 * -0.05 / 22;
    const std::vector<double> wanted = on_springs(places, 220.0, x, y);
    for (size_t i = 0; i < 4; ++i) {
      EXPECT_NEAR(load_at(world, "cart/w" + std::to_string(i), places[i].first, places[i].second),
                  wanted[i], 0.01 * wanted[i])
          << i << (reversed ? ", reversed" : "");
    }
  }
}

// A rocker on each side and a ball in front: five contacts whose loads are determined, since a
// rocker distributes by its levers. 20 kg at x = 0.1, pivots at 0, ball at 0.5: 40 N on the ball,
// and 80 N on each rocker, split 1 to 3 between its feet at 0.15 and -0.05.
TEST(Loads, OfARockerGoByItsLevers) {
  const auto rocker = [](const std::string& name, double y) {
    return "<link name='" + name + "'><pose>0 " + number(y) + " 0 0 0 0</pose>" +
           "<inertial><pose>0 0 0.02 0 0 0</pose><mass>0.001</mass><inertia><ixx>1e-5</ixx>" +
           "<iyy>1e-5</iyy><izz>1e-5</izz></inertia></inertial>" + foot(0, 0.15, 0) +
           foot(1, -0.05, 0) + "</link><joint name='j" + name +
           "' type='revolute'><parent>base</parent><child>" + name +
           "</child><axis><xyz>0 1 0</xyz></axis></joint>";
  };
  World world(kPlane + "<model name='cart'><link name='base'>" + inertial(20, 0.1, 0, 0.1) +
              foot(2, 0.5, 0) + "</link>" + rocker("left", 0.3) + rocker("right", -0.3) +
              "</model>");
  world.run(0.5);
  EXPECT_NEAR(load_at(world, "cart/base", 0.5, 0), 40.0, 0.4);
  for (const auto& [name, y] : {std::pair("cart/left", 0.3), std::pair("cart/right", -0.3)}) {
    EXPECT_NEAR(load_at(world, name, 0.15, y), 20.0, 0.4) << name;
    EXPECT_NEAR(load_at(world, name, -0.05, y), 60.0, 0.8) << name;
  }
}

// How firmly a thing is clamped between two others is no share of a load, and stays: jaws with a
// spring of 30 N each.
TEST(Loads, AGripStays) {
  const auto jaw = [](const std::string& name, double x, double sign) {
    return "<model name='" + name + "'><link name='l'><pose>" + number(x) +
           " 0 0.5 0 0 0</pose><inertial><mass>1</mass><inertia><ixx>0.01</ixx><iyy>0.01</iyy>" +
           "<izz>0.01</izz></inertia></inertial><collision name='c'><geometry>" + kBox +
           "</geometry></collision></link><joint name='slide' type='prismatic'>" +
           "<parent>world</parent><child>l</child><axis><xyz>" + number(sign) +
           " 0 0</xyz><dynamics><spring_stiffness>100</spring_stiffness>" +
           "<spring_reference>0.3</spring_reference><damping>20</damping></dynamics></axis>" +
           "</joint></model>";
  };
  World world(jaw("left", -0.2, 1) + jaw("right", 0.2, -1) +
              thing("box", "0 0 0.5 0 0 0", kBox, 1.0, 0.8, 0.01));
  world.run(3.0);
  EXPECT_NEAR(world.position("box/l").z(), 0.5, 1e-3);  // 2 x 30 N x 0.8 hold 10 N
}

}  // namespace
}  // namespace ruedo::physics::testing
