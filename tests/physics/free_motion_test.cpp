// Flight and rotation of bodies that nothing touches, against closed forms.
#include <gtest/gtest.h>

#include "world.h"

namespace ruedo::physics::testing {
namespace {

TEST(FreeMotion, FlightIsTheParabolaAtAnyStep) {
  for (const int64_t step_us : {1000, 5000, 20'000}) {
    World w(thing("ball", "0 0 5 0 0 0", kBall, 1), step_us);
    w.physics.set_twist(BodyIndex(0), {{2, 0, 3}, Vec3::Zero()});
    w.run(1.0);
    EXPECT_NEAR(w.position("ball/l").x(), 2.0, 1e-9);
    EXPECT_NEAR(w.position("ball/l").z(), 5.0 + 3.0 - 5.0, 1e-9);
    EXPECT_NEAR(w.physics.twist(BodyIndex(0)).linear.z(), 3.0 - 10.0, 1e-9);
  }
}

// In the first state what falls accelerates by gravity and what stands does not; from the first
// step on the simulation decides.
TEST(FreeMotion, TheFirstStateShowsFallingBodies) {
  World w(kPlane + thing("falling", "0 0 5 0 0 0", kBall, 1) +
              thing("standing", "2 0 0.1 0 0 0", kBall, 1) + thing("post", "4 0 1 0 0 0", kBox, 0),
          5000);
  Snapshot first, second;
  w.physics.read(first);
  w.physics.step();
  w.physics.read(second);
  EXPECT_TRUE(first.contacts.empty());  // nothing has borne anything yet
  EXPECT_FALSE(second.contacts.empty());
  for (const Snapshot* state : {&first, &second}) {
    EXPECT_NEAR(state->body_accelerations[0].z(), -10.0, 1e-9);
    EXPECT_NEAR(state->body_accelerations[1].z(), 0.0, 1e-9);
  }
}

// A mechanism in the air falls as one; one that hangs on the world, or of which a part stands on
// something, does not fall.
TEST(FreeMotion, TheFirstStateShowsFallingMechanisms) {
  const auto two = [](const std::string& name, const std::string& pose, const std::string& more) {
    const std::string inertial =
        "<inertial><mass>1</mass><inertia><ixx>0.01</ixx><iyy>0.01</iyy><izz>0.01</izz></inertia>"
        "</inertial><collision name='c'><geometry>" +
        kBall + "</geometry></collision></link>";
    return "<model name='" + name + "'><pose>" + pose + "</pose><link name='a'>" + inertial +
           "<link name='b'><pose>0.15 0 0 0 0 0</pose>" + inertial +
           "<joint name='j' type='revolute'><parent>a</parent><child>b</child><axis><xyz>0 1 "
           "0</xyz></axis></joint>" +
           more + "</model>";
  };
  World w(kPlane + two("falling", "0 0 5 0 0 0", "") + two("standing", "5 0 0.1 0 0 0", "") +
              two("hanging", "10 0 5 0 0 0",
                  "<joint name='h' type='ball'><parent>world</parent><child>a</child></joint>"),
          5000);
  Snapshot first, second;
  w.physics.read(first);
  w.physics.step();
  w.physics.read(second);
  for (const char* link : {"/a", "/b"}) {
    for (const Snapshot* state : {&first, &second}) {
      const auto z = [&](const std::string& model) {
        return state->body_accelerations[w.body(model + link)].z();
      };
      EXPECT_NEAR(z("falling"), -10.0, 1e-6) << link;
      EXPECT_NEAR(z("standing"), 0.0, 1e-3) << link;
    }
  }
  // The ball joint supports its link at the middle; the other link hangs by its end.
  EXPECT_NEAR(first.body_accelerations[w.body("hanging/a")].norm(), 0.0, 1e-6);
  EXPECT_NEAR(first.body_accelerations[w.body("hanging/b")].z(),
              -10.0 * 0.15 * 0.15 / (0.01 + 0.15 * 0.15), 1e-3);
}

// Links whose origin and centre of mass are half a metre from their hinge, at the same height.
TEST(FreeMotion, TheFirstStateShowsHangingBodies) {
  const auto pendulum = [](const std::string& name, double y, const std::string& dynamics) {
    return "<model name='" + name + "'><pose>0 " + std::to_string(y) +
           " 5 0 0 0</pose><link name='l'><pose>0.5 0 0 0 0 0</pose><inertial><mass>2</mass>"
           "<inertia><ixx>0.1</ixx><iyy>0.1</iyy><izz>0.1</izz></inertia></inertial></link>"
           "<joint name='j' type='revolute'><pose>-0.5 0 0 0 0 0</pose><parent>world</parent>"
           "<child>l</child><axis><xyz>0 1 0</xyz><dynamics>" +
           dynamics + "</dynamics></axis></joint></model>";
  };
  World w(pendulum("hanging", 0, "") +
              pendulum("sprung", 5,
                       "<spring_stiffness>20</spring_stiffness>"
                       "<spring_reference>-0.2</spring_reference>") +
              pendulum("braked", 10, "<friction>11</friction>") +
              pendulum("slipping", 15, "<friction>4</friction>") + pendulum("turning", 20, ""),
          5000);
  constexpr double kOmega = 3.0;
  w.physics.set_twist(w.body("turning/l"), {{0, 0, -0.5 * kOmega}, {0, kOmega, 0}});
  Snapshot state;
  w.physics.read(state);
  const auto acceleration = [&](const std::string& model) {
    return Vec3(state.body_accelerations[w.body(model + "/l")]);
  };
  // The moment about the hinge, which turns 0.1 + 2 * 0.5^2; a turn about y moves it down.
  const auto down = [](double moment) { return -0.5 * moment / 0.6; };
  EXPECT_NEAR(acceleration("hanging").z(), down(10.0), 1e-3);
  EXPECT_NEAR(acceleration("sprung").z(), down(10.0 - 4.0), 1e-3);
  EXPECT_NEAR(acceleration("braked").norm(), 0.0, 1e-6);
  EXPECT_NEAR(acceleration("slipping").z(), down(10.0 - 4.0), 1e-3);
  EXPECT_NEAR(acceleration("turning").x(), -kOmega * kOmega * 0.5, 2e-2);
  EXPECT_NEAR(acceleration("turning").z(), down(10.0), 2e-2);

  // This has moved nothing.
  EXPECT_EQ(w.position("hanging/l"), Vec3(0.5, 0, 5));
  EXPECT_EQ(w.physics.twist(w.body("hanging/l")).linear, Vec3(0, 0, 0));
}

// A body with three moments, spun near its middle axis, tumbles; energy and angular momentum stay.
TEST(FreeMotion, RotationKeepsEnergyAndAngularMomentum) {
  World w(
      "<model name='m'><link "
      "name='l'><gravity>0</gravity><inertial><mass>1</mass><inertia><ixx>0.01</ixx><iyy>0.02</"
      "iyy><izz>0.025</izz></inertia></inertial></link></model>",
      5000);
  const auto momentum = [&] {
    return Vec3(w.physics.inertia(BodyIndex(0)) * w.physics.twist(BodyIndex(0)).angular);
  };
  const auto energy = [&] { return 0.5 * w.physics.twist(BodyIndex(0)).angular.dot(momentum()); };
  w.physics.set_twist(BodyIndex(0), {Vec3::Zero(), {0.1, 5.0, 0.1}});
  w.physics.step();
  const Vec3 L = momentum();
  const double E = energy();
  double most_turned = 0.0;
  for (int i = 0; i < 1200; ++i) {
    w.physics.step();
    most_turned =
        std::max(most_turned, (w.physics.twist(BodyIndex(0)).angular - Vec3(0.1, 5.0, 0.1)).norm());
  }
  EXPECT_GT(most_turned, 1.5);  // it did tumble
  EXPECT_LT((momentum() - L).norm(), 1e-6 * L.norm());
  EXPECT_NEAR(energy() / E, 1.0, 1e-4);
}

}  // namespace
}  // namespace ruedo::physics::testing
