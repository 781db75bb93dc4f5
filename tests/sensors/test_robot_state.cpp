// The sensors that show the robot's state as it is: true pose, motion status, joints.
#include <algorithm>
#include <tuple>

#include <gtest/gtest.h>

#include "ruedo/collisions_t.hpp"
#include "ruedo/joint_state_t.hpp"
#include "ruedo/motion_status_t.hpp"
#include "ruedo/pose_t.hpp"
#include "sensors/sensor_bench.h"

namespace ruedo {
namespace {

using test::Device;
using test::SensorBench;

const char* const kWorld =
    "<sdf version='1.9'><world name='w'>"
    "<model name='rover'><pose>1 2 0 0 0 0</pose><link name='base'/>"
    "<link name='l'><pose>0 0.2 0.1 0 0 0</pose></link><link name='r'><pose>0 -0.2 0.1 0 0 "
    "0</pose></link><link name='head'/><link name='lift'/>"
    "<joint name='lj' type='revolute'><parent>base</parent><child>l</child><axis><xyz>0 1 "
    "0</xyz></axis></joint>"
    "<joint name='rj' type='revolute'><parent>base</parent><child>r</child><axis><xyz>0 1 "
    "0</xyz></axis></joint>"
    "<joint name='pan' type='revolute'><parent>base</parent><child>head</child><axis><xyz>0 0 "
    "1</xyz></axis></joint>"
    "<joint name='mast' type='prismatic'><parent>base</parent><child>lift</child><axis><xyz>0 0 "
    "1</xyz></axis></joint>"
    "<ruedo:drive><ruedo:left_joint>lj</ruedo:left_joint><ruedo:right_joint>rj</"
    "ruedo:right_joint><ruedo:wheel_radius>0.1</ruedo:wheel_radius>"
    "<ruedo:pose_rate>25</ruedo:pose_rate><ruedo:status_rate>4</ruedo:status_rate></ruedo:drive></"
    "model>"
    "</world></sdf>";

TEST(TruePose, ShowsTheRobotsState) {
  SensorBench bench(kWorld);
  Device device = bench.make("rover", "pose");
  EXPECT_EQ(device.rate, (Rate{25, 1}));
  EXPECT_EQ(device.kind->name(), "pose");
  EXPECT_FALSE(device.sensor->observes());
  Snapshot now = bench.snapshot();
  now.time = 40'000;
  RobotState& robot = now.robots[0];
  robot.X_WBase = {Quat(0.6, 0, 0, 0.8), {1, 2, 3}};
  robot.twist = {{4, 5, 6}, {7, 8, 9}};
  robot.acceleration = {10, 11, 12};
  Outbox out;
  test::step(device, now, out, 1);
  const pose_t m = Device::decode<pose_t>(out).at(0);
  EXPECT_EQ(m.utime, 40'000);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(m.pos[i], 1 + i);
    EXPECT_EQ(m.vel[i], 4 + i);
    EXPECT_EQ(m.rotation_rate[i], 7 + i);
    EXPECT_EQ(m.accel[i], 10 + i);
  }
  const double expected[4] = {0.6, 0, 0, 0.8};  // w, x, y, z
  for (int i = 0; i < 4; ++i) EXPECT_EQ(m.orientation[i], expected[i]);
}

TEST(MotionStatus, AtItsRateAndAtOnceWhenItChanges) {
  SensorBench bench(kWorld);
  Device device = bench.make("rover", "motion");
  EXPECT_EQ(device.rate, (Rate{4, 1}));
  Snapshot now = bench.snapshot();
  Outbox out;
  test::step(device, now, out, 0);
  const auto run = [&](int steps, bool due_at_end) {
    for (int i = 1; i <= steps; ++i) {
      ++now.step;
      now.time += 5000;
      test::step(device, now, out, due_at_end && i == steps ? 1 : -1);
    }
  };
  run(3, false);
  EXPECT_EQ(out.entries().size(), 1u);  // nothing happened, nothing is due
  MotionState& motion = now.robots[0].motion;
  motion = {.id = 42,
            .kind = 1,
            .state = motion_status_t::STATE_RUNNING,
            .reason = 0,
            .done = 0.25,
            .remaining = 0.75,
            .changes = 1};
  now.robots[0].twist = {{0.5, 0, 0}, {0, 0, 0.1}};
  run(1, false);  // step 4: at once
  run(1, false);
  run(1, true);  // step 6: its time
  motion.state = motion_status_t::STATE_DONE;
  motion.changes = 2;
  run(1, true);  // step 7: both, told once
  const auto messages = Device::decode<motion_status_t>(out);
  ASSERT_EQ(messages.size(), 4u);
  EXPECT_EQ(messages[0].utime, 0);
  EXPECT_EQ(messages[1].utime, 20'000);
  EXPECT_EQ(messages[1].id, 42);
  EXPECT_EQ(messages[1].kind, 1);
  EXPECT_EQ(messages[1].state, +motion_status_t::STATE_RUNNING);
  EXPECT_EQ(messages[1].done, 0.25);
  EXPECT_EQ(messages[1].remaining, 0.75);
  EXPECT_EQ(messages[1].v, 0.5);
  EXPECT_EQ(messages[1].omega, 0.1);
  EXPECT_EQ(messages[2].utime, 30'000);
  EXPECT_EQ(messages[3].utime, 35'000);
  EXPECT_EQ(messages[3].state, +motion_status_t::STATE_DONE);
  EXPECT_EQ(out.entries()[1].step, 4);
}

// A command replaces a primitive: its step reports the end of that, then the new one.
TEST(MotionStatus, TheSuccessorShowsAtTheStepOfItsCommand) {
  SensorBench bench(kWorld);
  Device device = bench.make("rover", "motion");
  Snapshot now = bench.snapshot();
  Outbox out;
  now.step = 7;
  now.time = 35'000;
  now.robots[0].motion = {
      .id = 43, .kind = 2, .state = motion_status_t::STATE_RUNNING, .changes = 2};
  now.motion_ends = {
      {RobotIndex(0),
       {.id = 42,
        .kind = 1,
        .state = motion_status_t::STATE_ENDED,
        .reason = motion_status_t::REASON_REPLACED,
        .done = 0.5}},
      {RobotIndex(1),
       {.id = 99, .kind = 1, .state = motion_status_t::STATE_REFUSED}}};  // another robot's
  test::step(device, now, out, 1);                                        // also due: told once
  const auto messages = Device::decode<motion_status_t>(out);
  ASSERT_EQ(messages.size(), 2u);
  EXPECT_EQ(messages[0].id, 42);
  EXPECT_EQ(messages[0].reason, +motion_status_t::REASON_REPLACED);
  EXPECT_EQ(messages[0].done, 0.5);
  EXPECT_EQ(messages[1].id, 43);
  EXPECT_EQ(messages[1].state, +motion_status_t::STATE_RUNNING);
  for (const auto& message : messages) EXPECT_EQ(message.utime, 35'000);
}

const char* const kTwoRobots =
    "<sdf version='1.9'><world name='w'>"
    "<model name='wall'><static>true</static><link name='l'/></model>"
    "<model name='crate'><link name='l'/></model>"
    "<model name='one'><link name='base'><sensor name='s' type='imu'/></link></model>"
    "<model name='two'><link name='base'><sensor name='s' type='imu'/></link></model>"
    "</world></sdf>";

class CollisionsOf : public ::testing::Test {
 protected:
  CollisionsOf() { test::step(device_, now_, out_, 0); }  // the initial state
  LinkIndex link(const std::string& name) const {
    for (const LinkIndex i : bench_.layout.links.indices()) {
      if (world::body_name(*bench_.world, bench_.layout, i) == name) return i;
    }
    throw std::logic_error(name);
  }
  // Robot "one" touches these; the force distinguishes the contacts of the steps.
  void step(const std::vector<std::string>& others, bool due = false, double force = 1.0) {
    ++now_.step;
    now_.time += 5000;
    now_.contacts = {};
    now_.collisions.clear();
    for (const std::string& other : others) {
      Contact contact;
      contact.link_a = link("one/base");
      contact.link_b = link(other);
      contact.normal = Vec3(-1.0, 0.0, 0.0);
      contact.position = Vec3(1.0, 2.0, 3.0);
      contact.force = force;
      contact.depth = 0.25;
      now_.collisions.push_back({RobotIndex(0), ContactIndex(now_.contacts.size()), true});
      now_.contacts.moving().push_back(contact);
    }
    test::step(device_, now_, out_, due ? 1 : -1);
  }
  std::vector<collisions_t> messages() const { return Device::decode<collisions_t>(out_); }

  SensorBench bench_{kTwoRobots};
  Device device_ = bench_.make("one", "collisions");
  Snapshot now_ = bench_.snapshot();
  Outbox out_;
};

TEST_F(CollisionsOf, EveryRobotAndTellTheInitialState) {
  EXPECT_EQ(device_.rate, (Rate{10, 1}));
  ASSERT_EQ(messages().size(), 1u);
  EXPECT_EQ(messages()[0].n, 0);
  EXPECT_EQ(messages()[0].blocked_by, "");
}

TEST_F(CollisionsOf, PublishesATouchAtOnceAndItsEndWithTheNextSample) {
  step({});
  EXPECT_EQ(messages().size(), 1u);
  step({"wall/l"}, false, 7.0);  // step 2: at once
  step({"wall/l"}, false, 8.0);
  step({});  // it trembles
  step({"wall/l"}, false, 9.0);
  step({}, true);  // step 6: still told, as it was last
  step({}, true);  // step 7: no more
  const auto told = messages();
  ASSERT_EQ(told.size(), 4u);
  EXPECT_EQ(told[1].utime, 10'000);
  ASSERT_EQ(told[1].n, 1);
  EXPECT_EQ(told[1].points[0].body, "wall/l");
  EXPECT_EQ(told[1].points[0].force, 7.0);
  EXPECT_EQ(told[1].points[0].depth, 0.25);
  EXPECT_EQ(told[1].points[0].normal[0], -1.0);  // towards the robot
  EXPECT_EQ(told[1].points[0].position[1], 2.0);
  EXPECT_EQ(told[2].utime, 30'000);
  ASSERT_EQ(told[2].n, 1);
  EXPECT_EQ(told[2].points[0].force, 9.0);
  EXPECT_EQ(told[3].n, 0);
}

TEST_F(CollisionsOf, ASecondBodyIsNewsTheFirstOneIsNot) {
  step({"wall/l"});
  step({"wall/l", "crate/l"});
  step({"wall/l", "crate/l"});
  const auto told = messages();
  ASSERT_EQ(told.size(), 3u);
  ASSERT_EQ(told[2].n, 2);
  EXPECT_EQ(told[2].points[0].body, "wall/l");
  EXPECT_EQ(told[2].points[1].body, "crate/l");
}

TEST_F(CollisionsOf, IgnoresContactsOfOtherRobots) {
  step({"wall/l"});
  now_.collisions[0].robot = RobotIndex(1);
  ++now_.step;
  test::step(device_, now_, out_, 1);
  EXPECT_EQ(messages().back().n, 0);
}

TEST_F(CollisionsOf, SeenFromTheOtherSideTheNormalStillPointsToTheRobot) {
  step({"two/base"});
  Device other = bench_.make("two", "collisions");
  Outbox out;
  now_.collisions[0] = {RobotIndex(1), ContactIndex(0), false};
  test::step(other, now_, out, 0);
  const collisions_t m = Device::decode<collisions_t>(out).at(0);
  ASSERT_EQ(m.n, 1);
  EXPECT_EQ(m.points[0].body, "one/base");
  EXPECT_EQ(m.points[0].normal[0], 1.0);
}

TEST_F(CollisionsOf, PublishesTheBlockingLinkAtOnce) {
  now_.robots[0].motion.blocked_by = link("crate/l");
  step({});
  step({});
  now_.robots[0].motion.blocked_by = {};
  step({});
  const auto told = messages();
  ASSERT_EQ(told.size(), 3u);
  EXPECT_EQ(told[1].blocked_by, "crate/l");
  EXPECT_EQ(told[1].utime, 5000);
  EXPECT_EQ(told[2].blocked_by, "");
}

TEST(Joints, ListsJointsOtherThanWheels) {
  SensorBench bench(kWorld);
  Device device = bench.make("rover", "joints");
  Snapshot now = bench.snapshot();
  ASSERT_EQ(now.joint_positions.size(), 2u);
  now.time = 5000;
  now.joint_positions = {0.5, 0.25};
  now.joint_velocities = {1.5, -1};
  now.joint_efforts = {2, 3};
  Outbox out;
  test::step(device, now, out, 0);
  const joint_state_t m = Device::decode<joint_state_t>(out).at(0);
  EXPECT_EQ(m.utime, 5000);
  EXPECT_EQ(m.num_joints, 2);
  EXPECT_EQ(m.joint_name, (std::vector<std::string>{"pan", "mast"}));
  EXPECT_EQ(m.joint_position, (std::vector<float>{0.5f, 0.25f}));
  EXPECT_EQ(m.joint_velocity, (std::vector<float>{1.5f, -1.0f}));
  EXPECT_EQ(m.joint_effort, (std::vector<float>{2.0f, 3.0f}));
}

TEST(SensorKinds, AreSortedAndComplete) {
  const std::vector<SensorKind>& kinds = sensor_kinds();
  for (size_t i = 1; i < kinds.size(); ++i) {
    EXPECT_LT(std::tie(kinds[i - 1].order, kinds[i - 1].module, kinds[i - 1].name()),
              std::tie(kinds[i].order, kinds[i].module, kinds[i].name()));
  }
  std::vector<std::string> names;
  for (const SensorKind& kind : kinds) names.push_back(kind.name());
  for (const char* name :
       {"odometry", "pose", "motion", "collisions", "joints", "imu", "contact"}) {
    EXPECT_EQ(std::count(names.begin(), names.end(), name), 1) << name;
  }
  for (const SensorKind& kind : kinds) {
    for (const SensorKind& other : kinds) {
      if (kind.module != other.module) continue;
      EXPECT_EQ(kind.order, other.order) << kind.name() << " and " << other.name();
    }
  }
}

}  // namespace
}  // namespace ruedo
