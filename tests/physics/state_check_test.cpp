// Impossible states, and forces that would lead to them.
#include "physics/state_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "physics/physics_world.h"
#include "ruedo/quantity.h"
#include "world/load.h"

namespace ruedo::physics {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN(),
                 kInfinity = std::numeric_limits<double>::infinity();

// A wheel of the given mass and moment on a hinge, beside a heavy and a light box.
std::shared_ptr<const world::WorldModel> hinged(const std::string& mass,
                                                const std::string& moment) {
  const std::string inertial = "<inertial><mass>" + mass + "</mass><inertia><ixx>" + moment +
                               "</ixx><iyy>" + moment + "</iyy><izz>" + moment +
                               "</izz></inertia></inertial>";
  return world::load_world_text(
      "<sdf version='1.9'><world name='w'><model name='m'><link name='a'><pose>0 0 1 0 0 "
      "0</pose></link><link name='b'><pose>1 0 1 0 0 0</pose>" +
          inertial +
          "<collision name='c'><geometry><box><size>1 1 "
          "1</size></box></geometry></collision></link>"
          "<joint name='j' type='revolute'><parent>a</parent><child>b</child><axis><xyz>0 1 "
          "0</xyz></axis></joint></model></world></sdf>",
      "/tmp/hinged.sdf");
}

TEST(StateCheck, ReportsTheBodyThatIsNotFinite) {
  const auto world = hinged("1", "1");
  const world::BodyLayout layout(*world);
  PhysicsWorld physics(*world, layout);
  const auto error_with = [&](const auto& spoil) -> std::string {
    Snapshot snapshot;
    physics.read(snapshot);
    snapshot.time = 1'500'000;
    spoil(snapshot);
    try {
      check_finite(snapshot, *world, layout);
    } catch (const StateError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(error_with([](Snapshot&) {}), "");
  using testing::HasSubstr;
  EXPECT_THAT(error_with([](Snapshot& s) { s.bodies[1].translation.y() = kNaN; }),
              HasSubstr("at 1.5 s the state of the body 'm/b' is not finite"));
  EXPECT_THAT(error_with([](Snapshot& s) { s.bodies[0].rotation.w() = kInfinity; }),
              HasSubstr("the body 'm/a'"));
  EXPECT_THAT(error_with([](Snapshot& s) { s.body_twists[0].angular.z() = -kInfinity; }),
              HasSubstr("the body 'm/a'"));
  EXPECT_THAT(error_with([](Snapshot& s) { s.body_accelerations[1].x() = kNaN; }),
              HasSubstr("the body 'm/b'"));
  EXPECT_THAT(error_with([](Snapshot& s) { s.joint_efforts[0] = kInfinity; }),
              HasSubstr("the joint 'm/j'"));
  EXPECT_THAT(error_with([](Snapshot& s) {
                s.contacts.moving().push_back({}), s.contacts.moving().back().body_b = BodyIndex(1),
                                                   s.contacts.moving().back().force = kNaN;
              }),
              HasSubstr("a contact of the body 'm/b'"));
}

// The largest effort on the lightest and on the heaviest body.
TEST(StateCheck, EffortsThatAreAllowedStayFinite) {
  for (const auto& [mass, moment] : {std::pair{"1e-9", "1e-15"},
                                     {"1e-9", "1e15"},
                                     {"1e9", "1e-9"},
                                     {"1e9", "1e15"},
                                     {"1", "1"}}) {
    const auto world = hinged(mass, moment);
    const world::BodyLayout layout(*world);
    PhysicsWorld physics(*world, layout);
    Snapshot snapshot;
    for (int step = 0; step < 500; ++step) {
      physics.apply_joint_effort(JointIndex(0),
                                 step % 2 ? quantity::kEffort.most : -quantity::kEffort.most);
      ASSERT_NO_THROW(physics.step()) << mass << " " << moment << " " << step;
      physics.read(snapshot);
      ASSERT_NO_THROW(check_finite(snapshot, *world, layout))
          << mass << " " << moment << " " << step;
    }
    for (const Twist& twist : snapshot.body_twists)
      EXPECT_LE(twist.angular.norm(), quantity::kSpeed.most * 1.001);
  }
}

TEST(StateCheck, AStepThrowsForAStateThatIsNotFinite) {
  const auto world = hinged("1", "1");
  const world::BodyLayout layout(*world);
  PhysicsWorld physics(*world, layout);
  physics.set_twist(BodyIndex(1), {Vec3(0, 0, kNaN), Vec3::Zero()});
  EXPECT_THROW(physics.step(), StateError);
}

}  // namespace
}  // namespace ruedo::physics
