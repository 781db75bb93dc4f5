// Mechanisms: pendulums against their periods and energies, an arm that holds a load.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "world.h"

namespace ruedo::physics::testing {
namespace {

std::string inertial(const std::string& pose, double mass, double ixx, double iyy, double izz) {
  return "<inertial><pose>" + pose + "</pose><mass>" + std::to_string(mass) +
         "</mass><inertia><ixx>" + std::to_string(ixx) + "</ixx><iyy>" + std::to_string(iyy) +
         "</iyy><izz>" + std::to_string(izz) + "</izz></inertia></inertial>";
}
std::string hinge(const std::string& name, const std::string& parent, const std::string& child,
                  const std::string& axis, const std::string& more = "") {
  return "<joint name='" + name + "' type='revolute'><parent>" + parent + "</parent><child>" +
         child + "</child><axis><xyz>" + axis + "</xyz>" + more + "</axis></joint>";
}

// The exact period of a pendulum of that amplitude: 4 sqrt(J / m g r) K(sin(a / 2)), by the
// arithmetic-geometric mean.
double period(double J, double mgr, double amplitude) {
  double a = 1.0, b = std::cos(amplitude / 2);
  for (int i = 0; i < 30; ++i) {
    const double mean = (a + b) / 2;
    b = std::sqrt(a * b);
    a = mean;
  }
  return 2 * M_PI * std::sqrt(J / mgr) / a;
}

// Released at an amplitude, it is back there after its period.
TEST(Articulated, APendulumHasItsPeriodAtAnyAmplitude) {
  for (const double amplitude : {0.1, 1.5, 3.0}) {
    // Hangs from (0, 0, 1); at 0 the arm's centre is at x = 0.5, so the start is amplitude - pi / 2
    // about y.
    World w("<model name='m'><link name='arm'><pose>0 0 1 0 " +
                std::to_string(M_PI / 2 - amplitude) + " 0</pose>" +
                inertial("0.5 0 0 0 0 0", 2, 0.01, 0.1, 0.1) + "</link>" +
                hinge("j", "world", "arm", "0 1 0") + "</model>",
            5000);
    const double expected = period(0.1 + 2 * 0.25, 2 * 10 * 0.5, amplitude);
    double last = 0.0, crossed = 0.0;
    int crossings = 0;
    double first_crossing = 0.0;
    for (int i = 1; i < 6000 && crossings < 3; ++i) {  // through the lowest point, each half period
      w.physics.step();
      const double angle = w.physics.joint_position(JointIndex(0)) - amplitude;
      if (last < 0.0 && angle >= 0.0) {
        crossed = 0.005 * (i - angle / (angle - last));
        if (crossings++ == 0) first_crossing = crossed;
      }
      last = angle;
    }
    ASSERT_GE(crossings, 2);
    EXPECT_NEAR((crossed - first_crossing) / (crossings - 1) / expected, 1.0, 5e-3) << amplitude;
  }
}

TEST(Articulated, ADoublePendulumKeepsItsEnergy) {
  World w("<model name='m'><link name='a'><pose>0 0 2 0 -1 0</pose>" +
              inertial("0.25 0 0 0 0 0", 1, 0.001, 0.02, 0.02) +
              "</link>"
              "<link name='b'><pose relative_to='a'>0.5 0 0 0 0.5 0</pose>" +
              inertial("0.25 0 0 0 0 0", 1, 0.001, 0.02, 0.02) + "</link>" +
              hinge("j", "world", "a", "0 1 0") + hinge("k", "a", "b", "0 1 0") + "</model>",
          5000);
  const auto energy = [&] {
    double sum = 0.0;
    for (const int body : {0, 1}) {
      const Vec3 centre = w.physics.center_of_mass(BodyIndex(body));
      const Twist& twist = w.physics.twist(BodyIndex(body));
      const Vec3 v =
          twist.linear + twist.angular.cross(centre - w.physics.pose(BodyIndex(body)).translation);
      sum += 0.5 * v.squaredNorm() +
             0.5 * twist.angular.dot(w.physics.inertia(BodyIndex(body)) * twist.angular) +
             10 * (centre.z() - 2);
    }
    return sum;
  };
  const double before = energy(), lowest = -10 * (0.25 + 0.75);
  w.run(20);
  EXPECT_NEAR(energy(), before, 0.02 * (before - lowest));
}

// Six links of 0.2 m and 1 kg, and 5 kg at the tip, stretched out; every second joint turns about
// z, the others lift.
std::string arm() {
  std::string text = "<model name='m'>";
  for (int i = 0; i < 6; ++i) {
    const std::string n = std::to_string(i);
    text += "<link name='l" + n + "'><pose>" + std::to_string(0.2 * i) + " 0 1 0 0 0</pose>" +
            inertial("0.1 0 0 0 0 0", i == 5 ? 6 : 1, 0.001, 0.004, 0.004) + "</link>" +
            hinge("j" + n, i == 0 ? "world" : "l" + std::to_string(i - 1), "l" + n,
                  i % 2 == 0 ? "0 1 0" : "0 0 1", "<limit><effort>500</effort></limit>");
  }
  return text + "</model>";
}

TEST(Articulated, AnArmHoldsItsLoadWithoutCreeping) {
  World w(arm(), 5000);
  for (int i = 0; i < 6; ++i) w.physics.drive_joint_velocity(JointIndex(i), 0.0, 500.0);
  w.run(1.0);
  const double before = w.physics.joint_position(JointIndex(0));
  w.run(10.0);
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(w.physics.joint_velocity(JointIndex(i)), 0.0, 1e-4);
  EXPECT_NEAR(w.physics.joint_position(JointIndex(0)), before, 1e-3);  // 1e-4 rad/s
  EXPECT_LT(std::abs(w.physics.joint_position(JointIndex(0))), 1e-3);
  // 5 links of 1 kg and the last of 6 kg: 10 (0.1 + 0.3 + 0.5 + 0.7 + 0.9 + 6 * 1.1) N m at the
  // shoulder.
  EXPECT_NEAR(w.physics.joint_effort(JointIndex(0)), -10 * (2.5 + 6.6), 0.5);
}

// Its joints have turned by the commanded angles in total, and its tip is where these put it: at
// the product of the joints' rotations.
TEST(Articulated, AnArmFollowsItsMotorCommands) {
  for (const int64_t step_us : {5000, 10000}) {
    World w(arm(), step_us);
    const double step_s = static_cast<double>(step_us) * 1e-6;
    double told[6] = {};
    for (int k = 0; k * step_s < 1.5; ++k) {
      for (int i = 0; i < 6; ++i) {
        const double rate = 0.5 * std::sin(4.0 * k * step_s + i);
        w.physics.drive_joint_velocity(JointIndex(i), rate, 500.0);
        told[i] += rate * step_s;
      }
      w.physics.step();
      for (int i = 0; i < 6; ++i)
        ASSERT_NEAR(w.physics.joint_position(JointIndex(i)), told[i], 2e-4)
            << i << " at " << step_us;
    }
    Pose tip{Quat::Identity(), {0, 0, 1}};
    for (int i = 0; i < 6; ++i) {
      const Vec3 axis = i % 2 == 0 ? Vec3::UnitY() : Vec3::UnitZ();
      if (i > 0) tip = tip * Pose{Quat::Identity(), {0.2, 0, 0}};
      tip = tip * Pose{Quat(Eigen::AngleAxisd(told[i], axis)), Vec3::Zero()};
    }
    EXPECT_LT((w.physics.pose(BodyIndex(5)).translation - tip.translation).norm(), 3e-4) << step_us;
  }
}

// A spring of 40 N m/rad under 2 kg at 0.5 m: k x = m g r cos x; the joint's friction brings it to
// rest.
// A motor at its limit gives exactly its limit, whatever it is commanded, and the others hold. From
// the second step on: in the first there is a torque already, but the middle has no velocity yet.
TEST(Articulated, AMotorAtItsLimitGivesThat) {
  const auto motor = [](const char* effort) {
    return std::string("<limit><effort>") + effort + "</effort></limit>";
  };
  World w("<model name='m'><link name='a'><pose>0 0 1 0 0 0</pose>" +
              inertial("0.5 0 0 0 0 0", 2, 0.1, 0.1, 0.1) +
              "</link><link name='b'><pose>1 0 1 0 0 0</pose>" +
              inertial("0.5 0 0 0 0 0", 1, 0.1, 0.1, 0.1) + "</link>" +
              hinge("j", "world", "a", "0 1 0", motor("15")) +
              hinge("k", "a", "b", "0 1 0", motor("100")) + "</model>",
          1000);
  for (const JointIndex joint : {JointIndex(0), JointIndex(1)})
    w.physics.drive_joint_velocity(joint, 0.0, 1e6);
  for (int i = 0; i < 3; ++i) w.physics.step();
  // As one body: 10 N m of a's weight and 15 N m of b's, about what turns J.
  const double J = 0.1 + 2 * 0.25 + 0.1 + 1.5 * 1.5;
  EXPECT_NEAR(w.physics.joint_velocity(JointIndex(0)), 0.003 * (25.0 - 15.0) / J, 1e-7);
  EXPECT_NEAR(w.physics.joint_effort(JointIndex(0)), -15.0, 1e-9);
  EXPECT_NEAR(w.physics.joint_velocity(JointIndex(1)), 0.0, 1e-9);
  // b is accelerated at its middle, 1.5 m from the hinge, and turned; the joint bears the rest.
  const double turns = (25.0 - 15.0) / J;
  EXPECT_NEAR(w.physics.joint_effort(JointIndex(1)), -(5.0 - 0.1 * turns - 0.5 * 1.5 * turns),
              1e-3);
}

// Motors that drive into their stops: the stops hold, and the motors give what they can.
TEST(Articulated, StopsHoldAgainstMotors) {
  const std::string limit =
      "<limit><lower>-0.2</lower><upper>0.2</upper><effort>50</effort></limit>";
  World w("<model name='m'><link name='a'><pose>0 0 1 0 0 0</pose>" +
              inertial("0.5 0 0 0 0 0", 2, 0.1, 0.1, 0.1) +
              "</link><link name='b'><pose>1 0 1 0 0 0</pose>" +
              inertial("0.5 0 0 0 0 0", 1, 0.1, 0.1, 0.1) + "</link>" +
              hinge("j", "world", "a", "0 1 0", limit) + hinge("k", "a", "b", "0 1 0", limit) +
              "</model>",
          5000);
  for (const double rate : {0.5, -0.5}) {
    for (const JointIndex joint : {JointIndex(0), JointIndex(1)})
      w.physics.drive_joint_velocity(joint, rate, 1e6);
    w.run(3.0);
    for (const JointIndex joint : {JointIndex(0), JointIndex(1)}) {
      EXPECT_NEAR(w.physics.joint_position(joint), 0.4 * rate, 1e-4) << joint;
      EXPECT_NEAR(w.physics.joint_effort(joint), 100.0 * rate, 1e-6) << joint;
    }
  }
}

std::string chain(int n, const std::string& limit) {
  std::string model = "<model name='m'>", before = "world";
  for (int i = 0; i < n; ++i) {
    const std::string name = "l" + std::to_string(i);
    model += "<link name='" + name + "'><pose>" + std::to_string(0.1 * i) + " 0 1 0 0 0</pose>" +
             inertial("0.05 0 0 0 0 0", 0.1, 1e-4, 1e-4, 1e-4) + "</link>" +
             hinge("j" + std::to_string(i), before, name, "0 1 0",
                   "<limit><lower>-" + limit + "</lower><upper>" + limit + "</upper></limit>");
    before = name;
  }
  return model + "</model>";
}

// A chain droops until each joint is at its stop, and rests there: that costs about what swinging
// does (it was 39 times as much, and did not come to rest, while stops were relaxed one by one).
TEST(Articulated, StopsOfAChainAreSolvedAtOnce) {
  constexpr int kLinks = 60, kSteps = 100;
  constexpr double kLimit = 0.002, kFactor = 8.0;
  World stopped(chain(kLinks, "0.002"), 5000), swinging(chain(kLinks, "3"), 5000);
  for (World* w : {&stopped, &swinging}) w->run(0.1);
  EXPECT_LT(stopped.seconds_of(kSteps), kFactor * swinging.seconds_of(kSteps));
  stopped.run(1.4);
  for (const JointIndex i : stopped.layout.joints.indices()) {
    EXPECT_NEAR(stopped.physics.joint_position(i), kLimit, 2e-4) << i;
    EXPECT_NEAR(stopped.physics.joint_velocity(i), 0.0, 1e-6) << i;
  }
}

// Base and pendulum swing about their common centre of mass, which stays where it is.
TEST(Articulated, APendulumOnAnUprightBaseSwingsWithIt) {
  constexpr double kMass = 1.0, kBase = 2.0, kLength = 0.5, kMoment = 0.01, kStart = 0.02;
  World w("<model name='m'><pose>0 0 1 0 0 0.7</pose><link name='base'>" +
              inertial("0 0 0 0 0 0", kBase, 0.1, 0.2, 0.3) +
              "</link><link name='arm'><pose>0 0 0 0 " + std::to_string(kStart) + " 0</pose>" +
              inertial("0 0 -0.5 0 0 0", kMass, kMoment, kMoment, kMoment) + "</link>" +
              hinge("j", "base", "arm", "0 1 0") + "</model>",
          1000);
  w.physics.set_support(w.body("m/base"), Support::plane);
  const double moment = kMoment + kMass * kLength * kLength * (1.0 - kMass / (kMass + kBase));
  const double period = 2 * M_PI / std::sqrt(kMass * 10 * kLength / moment);
  const double whole = 2 * kStart * kMass * kLength / (kMass + kBase);  // from end to end, m
  w.run(std::round(500 * period) / 1000);
  EXPECT_NEAR(w.physics.joint_position(JointIndex(0)), -2 * kStart, 0.005 * kStart);
  EXPECT_NEAR(w.position("m/base").x(), -whole * std::cos(0.7), 0.005 * whole);
  EXPECT_NEAR(w.position("m/base").y(), -whole * std::sin(0.7), 0.005 * whole);
  EXPECT_EQ(w.position("m/base").z(), 1.0);
}

// A hand on a robot that a drive keeps upright.
TEST(Articulated, AnUprightBaseCostsNoMoreThanAFreeOne) {
  constexpr int kFingers = 12, kSteps = 100;
  std::string hand = "<model name='m'><pose>0 0 1 0 0 0</pose><link name='base'>" +
                     inertial("0 0 0 0 0 0", 20, 1, 1, 1) + "</link>";
  for (int i = 0; i < kFingers; ++i) {
    std::string before = "base";
    for (int j = 0; j < 4; ++j) {
      const std::string name = "f" + std::to_string(i) + std::to_string(j);
      hand += "<link name='" + name + "'><pose>" + std::to_string(0.1 * (j + 1)) + " " +
              std::to_string(0.05 * i) + " 0 0 0 0</pose>" +
              inertial("0.05 0 0 0 0 0", 0.1, 0.001, 0.001, 0.001) + "</link>" +
              hinge("j" + name, before, name, "0 1 0");
      before = name;
    }
  }
  hand += "</model>";
  World upright(hand, 5000), falling(hand, 5000);
  upright.physics.set_support(upright.body("m/base"), Support::plane);
  constexpr double kFactor = 2.0;  // 4 while its joints were rows
  EXPECT_LT(upright.seconds_of(kSteps), kFactor * falling.seconds_of(kSteps));
}

// A bar of ten links that friction holds, hinged at one end, falls on its light tip: the ground
// bears the heavy link behind it.
TEST(Articulated, ALightTipBearsTheBarBehindIt) {
  const std::string held = "<dynamics><friction>1000000</friction></dynamics>";
  std::string model = kPlane + "<model name='m'><pose>0 0 0.1 0 0 0</pose>";
  std::string before = "world";
  for (int i = 0; i < 10; ++i) {
    const std::string name = "l" + std::to_string(i);
    const double mass = i == 8 ? 200.0 : 0.02;
    model += "<link name='" + name + "'><pose>" + std::to_string(0.1 * i) + " 0 0 0 0 0</pose>" +
             inertial("0.05 0 0 0 0 0", mass, 1e-3 * mass, 1e-3 * mass, 1e-3 * mass);
    if (i == 9)
      model +=
          "<collision name='c'><pose>0.1 0 0 0 0 0</pose><geometry><box><size>0.04 0.3 0.04"
          "</size></box></geometry></collision>";
    model += "</link>" + hinge("j" + name, before, name, "0 1 0", i == 0 ? "" : held);
    before = name;
  }
  World w(model + "</model>", 5000);
  double bends = 0.0;  // rad/s
  for (int i = 0; i < 200; ++i) {
    w.physics.step();
    for (int j = 1; j < 10; ++j)
      bends = std::max(bends, std::abs(w.physics.joint_velocity(JointIndex(j))));
  }
  EXPECT_LT(bends, 1e-6);
  // The far lower edge of the tip is on the ground.
  double sine = 0.0;
  for (int i = 0; i < 20; ++i) sine = (0.1 - 0.02 * std::sqrt(1.0 - sine * sine)) / 1.02;
  EXPECT_NEAR(w.position("m/l9").z(), 0.1 - 0.9 * sine, 1e-6);
}

// A motor without a maximum that drives into a stop gives nothing there, one that holds a load off
// it gives what the load needs.
TEST(Articulated, AMotorAtAStopGivesTheNeededEffort) {
  const auto arm = [](const std::string& limit) {
    return "<model name='m'><link name='a'><pose>0 0 1 0 0 0</pose>" +
           inertial("0.5 0 0 0 0 0", 2, 0.1, 0.1, 0.1) + "</link>" +
           hinge("j", "world", "a", "0 1 0", limit) + "</model>";
  };
  for (const double rate : {0.3, -0.3}) {  // downwards, upwards
    World w(arm("<limit><lower>-0.1</lower><upper>0.1</upper></limit>"), 5000);
    w.physics.drive_joint_velocity(JointIndex(0), rate, std::numeric_limits<double>::infinity());
    w.run(2.0);
    const double load = 2 * 10 * 0.5 * std::cos(0.1);  // N m
    EXPECT_NEAR(w.physics.joint_position(JointIndex(0)), std::copysign(0.1, rate), 1e-4);
    EXPECT_NEAR(w.physics.joint_effort(JointIndex(0)), rate > 0.0 ? 0.0 : -load, 1e-2);
  }
}

// Newton's cradle, with a millimetre between its balls: the first one's height is the last one's.
TEST(Articulated, ACradlePassesTheSpeedOn) {
  constexpr double kReleased_rad = 0.5;
  std::string balls;
  for (int i = 0; i < 5; ++i) {
    balls += "<model name='m" + std::to_string(i) + "'><pose>" + std::to_string(0.101 * i) +
             " 0 1.2 0 " + std::to_string(i == 0 ? kReleased_rad : 0.0) +
             " 0</pose><link name='l'><pose>0 0 -1 0 0 0</pose>" +
             inertial("0 0 0 0 0 0", 1, 0.001, 0.001, 0.001) +
             "<collision name='c'><geometry><sphere><radius>0.05</radius></sphere></geometry>"
             "<surface><bounce><restitution_coefficient>1</restitution_coefficient>"
             "<threshold>0</threshold></bounce><friction><ode><mu>0</mu><mu2>0</mu2></ode>"
             "</friction></surface></collision></link><joint name='j' type='revolute'>"
             "<pose>0 0 1 0 0 0</pose><parent>world</parent><child>l</child><axis><xyz>0 1 0</xyz>"
             "</axis></joint></model>";
  }
  World w(balls, 1000);
  double highest = 0.0;
  for (int i = 0; i < 1100; ++i) {  // half a period after a quarter of it
    w.physics.step();
    highest = std::max(highest, w.position("m4/l").z() - 0.2);
  }
  EXPECT_NEAR(highest / (1 - std::cos(kReleased_rad)), 1.0, 0.03);
  for (int i = 0; i < 4; ++i)
    EXPECT_LT(w.position("m" + std::to_string(i) + "/l").z() - 0.2, 1e-3) << i;
}

// Pages on a common axis through y, which `spine` carries, and of which each lies beside the next:
// dozens of contacts within one mechanism.
class Book {
 public:
  static constexpr int kPages = 24;
  // from its axis, m
  static constexpr double kInner = 0.1, kLength = 0.3, kCentre = kInner + kLength / 2;

  // Page i is turned about y by i times that angle, and lies that much higher than page i - 1.
  static std::string pages(const std::string& spine, double turned, double higher, double mu) {
    std::string text = "<self_collide>true</self_collide>";
    for (int i = 0; i < kPages; ++i) {
      const std::string n = std::to_string(i), friction = std::to_string(mu);
      text += "<link name='p" + n + "'><pose>0 0 " + std::to_string(i * higher) + " 0 " +
              std::to_string(-i * turned) + " 0</pose>" +
              inertial(std::to_string(kCentre) + " 0 0 0 0 0", mass(i), 0.004 * mass(i),
                       0.008 * mass(i), 0.011 * mass(i)) +
              "<collision name='c'><pose>" + std::to_string(kCentre) +
              " 0 0 0 0 0</pose><geometry><box><size>" + std::to_string(kLength) +
              " 0.2 0.01</size></box></geometry><surface><friction><ode><mu>" + friction +
              "</mu><mu2>" + friction + "</mu2></ode></friction></surface></collision></link>" +
              hinge("j" + n, spine, "p" + n, "0 1 0");
    }
    return text;
  }
  // A heavy one lies on light ones.
  static double mass(int page) { return page == kPages - 1 ? 5.0 : 0.05 * (1 + page % 3); }
};

// The moments of all pages about their axes, which only the floor bears, are those of their
// weights: forces between pages cancel.
TEST(Articulated, PagesOfABookBearEachOther) {
  for (const int64_t step_us : {1000, 5000}) {
    World w(kPlane + "<model name='m'><pose>0 0 0.005 0 0 0</pose>" +
                Book::pages("world", 0.0, 0.0101, 0.0) + "</model>",
            step_us);
    w.run(1.0);
    double weights = 0.0, borne = 0.0;
    for (int i = 0; i < Book::kPages; ++i) weights += 10 * Book::mass(i) * Book::kCentre;
    Snapshot snapshot;
    w.physics.read(snapshot);
    size_t within = 0;
    for (const Contact& contact : snapshot.contacts) {
      EXPECT_LT(contact.depth, 2e-4);
      if (contact.body_a.valid() && contact.body_b.valid())
        ++within;
      else
        borne += contact.force * contact.position.x();
    }
    EXPECT_GT(within, 32u);
    EXPECT_NEAR(borne, weights, 2e-3 * weights) << step_us;
  }
}

// A fan that closes while it flies keeps its momenta, and gains no energy.
TEST(Articulated, ABookThatClosesInFlightKeepsItsMomenta) {
  constexpr double kSpine = 0.4;
  World w("<model name='m'><pose>0 0 50 0 0 0</pose><link name='spine'>" +
              inertial("0 0 0 0 0 0", kSpine, 0.002, 0.002, 0.002) + "</link>" +
              Book::pages("spine", 0.12, 0.0, 1.0) + "</model>",
          1000);
  const Vec3 start(1.0, -2.0, 3.0), spin(0.5, 0.2, -0.8);
  const auto each = [&](const auto& act) {
    act(w.body("m/spine"), kSpine);
    for (int i = 0; i < Book::kPages; ++i) act(w.body("m/p" + std::to_string(i)), Book::mass(i));
  };
  each([&](BodyIndex body, double) { w.physics.set_twist(body, {start, spin}); });
  for (int i = 0; i < Book::kPages; ++i)  // they close towards the middle
    w.physics.set_twist(w.body("m/p" + std::to_string(i)),
                        {start, spin + Vec3(0, 0.2 * (i - Book::kPages / 2.0), 0)});
  struct Sums {
    double mass = 0.0, energy = 0.0;
    Vec3 centre = Vec3::Zero(), momentum = Vec3::Zero(), turning = Vec3::Zero();
  };
  const auto sums = [&] {
    Sums sums;
    each([&](BodyIndex body, double mass) {
      const Vec3 place = w.physics.center_of_mass(body);
      const Twist& twist = w.physics.twist(body);
      const Vec3 v = twist.linear + twist.angular.cross(place - w.physics.pose(body).translation);
      const Vec3 turning = w.physics.inertia(body) * twist.angular;
      sums.mass += mass;
      sums.centre += mass * place;
      sums.momentum += mass * v;
      sums.turning += turning + mass * place.cross(v);
      sums.energy +=
          0.5 * mass * v.squaredNorm() + 0.5 * turning.dot(twist.angular) + 10 * mass * place.z();
    });
    sums.centre /= sums.mass;
    sums.turning -= sums.centre.cross(sums.momentum);
    return sums;
  };
  w.run(0.005);  // the joints take what the twists above do not fit
  const Sums first = sums();
  Sums last = first;
  size_t most = 0;
  for (int i = 1; i <= 1500; ++i) {
    w.physics.step();
    const Sums now = sums();
    EXPECT_LT(now.energy, last.energy + 1e-3) << i;
    last = now;
    Snapshot snapshot;
    w.physics.read(snapshot);
    most = std::max<size_t>(most, snapshot.contacts.size());
    for (const Contact& contact : snapshot.contacts) EXPECT_LT(contact.depth, 1e-3) << i;
  }
  EXPECT_GT(most, 32u);
  EXPECT_LT((last.momentum - first.momentum - 1.5 * first.mass * Vec3(0, 0, -10)).norm(),
            1e-6 * first.mass);
  EXPECT_LT((last.turning - first.turning).norm(), 0.01 * first.turning.norm());
}

// Two weights below each other on vertical sliders, with dampers of any size: each sinks at (weight
// that it bears - friction) / damping, relative to what it hangs on, and stays where the friction
// bears all.
TEST(Articulated, DampersSinkAtTheRateOfTheirLoad) {
  struct Case {
    double damping, friction;
  };
  for (const Case& c :
       {Case{10, 0}, {2e4, 0}, {1e5, 0}, {1e8, 0}, {2e4, 30}, {1e5, 30}, {1e5, 60}}) {
    for (const int64_t step_us : {1000, 2000, 5000, 10'000, 20'000}) {
      const auto slider = [&](const std::string& name, const std::string& on) {
        return "<link name='" + name + "'><pose>0 0 1 0 0 0</pose>" +
               inertial("0.3 0.1 0 0 0 0", 5, 0.01, 0.1, 0.1) + "</link><joint name='j" + name +
               "' type='prismatic'><parent>" + on + "</parent><child>" + name +
               "</child><axis><xyz>0 0 1</xyz><dynamics><damping>" + std::to_string(c.damping) +
               "</damping><friction>" + std::to_string(c.friction) +
               "</friction></dynamics></axis></joint>";
      };
      World w("<model name='m'>" + slider("a", "world") + slider("b", "a") + "</model>", step_us);
      w.run(c.damping < 100 ? 10.0 : 1.0);
      const double of_a = std::max(0.0, 100 - c.friction) / c.damping,
                   of_b = std::max(0.0, 50 - c.friction) / c.damping;
      EXPECT_NEAR(w.physics.joint_velocity(JointIndex(0)), -of_a, 1e-3 * of_a) << c.damping;
      EXPECT_NEAR(w.physics.joint_velocity(JointIndex(1)), -of_b, 1e-3 * of_b + 1e-9) << c.damping;
      if (c.damping < 100) continue;
      EXPECT_NEAR(w.physics.joint_position(JointIndex(0)), -of_a, 0.01 * of_a) << c.damping;
    }
  }
}

// The same in a loop, and with a servo at its limit beside the damper.
TEST(Articulated, DampersAddUpAndBearTheRestOfAServosLoad) {
  for (const int64_t step_us : {1000, 5000, 20'000}) {
    const auto slider = [](const std::string& name, double damping) {
      return "<joint name='" + name +
             "' type='prismatic'><parent>world</parent><child>a</child>"
             "<axis><xyz>0 0 1</xyz><dynamics><damping>" +
             std::to_string(damping) + "</damping></dynamics></axis></joint>";
    };
    const std::string weight =
        "<link name='a'>" + inertial("0 0 0 0 0 0", 5, 0.01, 0.1, 0.1) + "</link>";
    World loop(
        "<model name='m'>" + weight + slider("left", 2e4) + slider("right", 3e4) + "</model>",
        step_us);
    loop.run(1.0);
    EXPECT_NEAR(loop.physics.joint_velocity(JointIndex(0)), -50 / 5e4, 1e-3 * 50 / 5e4);
    World served("<model name='m'>" + weight + slider("only", 2e4) + "</model>", step_us);
    served.physics.servo_joint(JointIndex(0), {0.5, 1e5, -20.0, 20.0});
    served.run(1.0);
    EXPECT_NEAR(served.physics.joint_velocity(JointIndex(0)), -30 / 2e4, 1e-3 * 30 / 2e4);
    EXPECT_NEAR(served.physics.joint_effort(JointIndex(0)), 20.0, 1e-6);
  }
}

// A heavy top in a gimbal of two rings (outer: Io about the vertical, inner: a), released at an
// angle to the vertical: the conserved momenta about its axis and the vertical, and the energy,
// make 2 m g l (Io + a + I1 sin^2) = (I3 s)^2 (cos(start) - cos) at the lowest point of its
// nutation.
class Top {
 public:
  static constexpr double kMass = 2.0, kLever = 0.065, kRing = 1e-4, kStart = 0.5, kI3 = 0.006,
                          kI1 = 0.004;  // about its centre of mass
  explicit Top(double spin, int64_t step_us) : w_(text(), step_us) {
    const Vec3 axis = w_.physics.pose(rotor()).rotation * Vec3::UnitZ();
    w_.physics.set_twist(rotor(), {Vec3::Zero(), spin * axis});
  }
  void step() { w_.physics.step(); }
  double tilt() const { return std::acos((w_.physics.pose(rotor()).rotation * Vec3::UnitZ()).z()); }
  // Of all parts, about the vertical through the pivot.
  double momentum() const {
    double sum = 0.0;
    for (const BodyIndex i : w_.layout.bodies.indices()) {
      const Twist& twist = w_.physics.twist(i);
      const Vec3 arm = w_.physics.center_of_mass(i) - Vec3(0, 0, 1),
                 v = twist.linear + twist.angular.cross(w_.physics.center_of_mass(i) -
                                                        w_.physics.pose(i).translation);
      sum += (w_.physics.inertia(i) * twist.angular + w_.physics.mass(i) * arm.cross(v)).z();
    }
    return sum;
  }
  static double lowest(double spin) {
    const double I1 = kI1 + kMass * kLever * kLever;
    const auto missing = [&](double tilt) {
      const double s = std::sin(tilt);
      return 2 * kMass * 10 * kLever * (2 * kRing + I1 * s * s) -
             std::pow(kI3 * spin, 2) * (std::cos(kStart) - std::cos(tilt));
    };
    double low = kStart, high = M_PI / 2;
    for (int i = 0; i < 60; ++i) (missing((low + high) / 2) > 0 ? low : high) = (low + high) / 2;
    return low;
  }

 private:
  BodyIndex rotor() const { return w_.body("m/rotor"); }
  static std::string text() {
    const std::string tilted = "<pose>0 0 1 " + std::to_string(kStart) + " 0 0</pose>";
    return "<model name='m'><link name='outer'><pose>0 0 1 0 0 0</pose>" +
           inertial("0 0 0 0 0 0", 0.1, kRing, kRing, kRing) + "</link><link name='inner'>" +
           tilted + inertial("0 0 0 0 0 0", 0.1, kRing, kRing, kRing) +
           "</link><link name='rotor'>" + tilted +
           inertial("0 0 " + std::to_string(kLever) + " 0 0 0", kMass, kI1, kI1, kI3) + "</link>" +
           hinge("z", "world", "outer", "0 0 1") + hinge("x", "outer", "inner", "1 0 0") +
           hinge("spin", "inner", "rotor", "0 0 1") + "</model>";
  }
  World w_;
};

TEST(Articulated, ATopNutatesAsItsMomentaAllow) {
  for (const double spin : {60.0, 150.0, 400.0}) {
    for (const int64_t step_us : {1000, 5000, 20'000}) {
      Top top(spin, step_us);
      const double momentum = Top::kI3 * spin * std::cos(Top::kStart);
      double lowest = 0.0, least = 0.0, most = 0.0;
      for (int64_t t = 0; t < 4'000'000; t += step_us) {
        top.step();
        lowest = std::max(lowest, top.tilt());
        least = std::min(least, top.momentum() - momentum);
        most = std::max(most, top.momentum() - momentum);
      }
      const double nutation = Top::lowest(spin) - Top::kStart;
      EXPECT_NEAR((lowest - Top::kStart) / nutation, 1.0, 0.03) << spin << " " << step_us;
      EXPECT_LT(most - least, 5e-3 * momentum) << spin << " " << step_us;
    }
  }
}

TEST(Articulated, AJointsSpringHolds) {
  World w("<model name='m'><link name='arm'><pose>0 0 1 0 0 0</pose>" +
              inertial("0.5 0 0 0 0 0", 2, 0.01, 0.1, 0.1) + "</link>" +
              hinge("j", "world", "arm", "0 1 0",
                    "<dynamics><damping>3</damping><spring_stiffness>40</"
                    "spring_stiffness><spring_reference>0</spring_reference></dynamics>") +
              "</model>",
          5000);
  w.run(5.0);
  double x = 0.25;
  for (int i = 0; i < 50; ++i) x = 10 * std::cos(x) / 40;
  EXPECT_NEAR(w.physics.joint_position(JointIndex(0)), x, 1e-3);
}

}  // namespace
}  // namespace ruedo::physics::testing
