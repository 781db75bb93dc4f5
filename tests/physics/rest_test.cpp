// What rests keeps its contacts, wakes when something reaches it, and costs nothing until then.
#include <array>

#include <gtest/gtest.h>

#include "world.h"

namespace ruedo::physics {
namespace {

using testing::kBall, testing::kBox, testing::kPlane, testing::seconds_of, testing::thing,
    testing::World;

std::string boxes(int n) {
  std::string models = kPlane;
  for (int i = 0; i < n; ++i)
    models += thing("b" + std::to_string(i), std::to_string(i) + " 0 0.1 0 0 0", kBox, 2.0);
  return models;
}

std::string rolling(double x) {
  return thing("ball", std::to_string(x) + " 5 0.1 0 0 0", kBall, 1.0, 0.0);
}

double load_of(const World& w, const std::string& body) {
  double load = 0.0;
  for (const Contact& contact : w.physics.contacts(w.body(body)))
    load += contact.normal.z() * contact.force;
  return load;
}

// Each substep once looked at every contact, though nothing moved: 200 boxes took 80 times as long
// as two.
TEST(Rest, CostsTheSameForManyAndForFew) {
  constexpr int kSteps = 2000;
  constexpr double kFactor = 10.0;
  World few(boxes(2) + rolling(-100), 5000), many(boxes(200) + rolling(-100), 5000);
  for (World* w : {&few, &many}) {
    w->run(3.0);
    ASSERT_TRUE(w->physics.sleeping(w->body("b1/l")));
  }
  EXPECT_LT(many.seconds_of(kSteps), kFactor * few.seconds_of(kSteps));
  for (World* w : {&few, &many}) w->physics.set_twist(w->body("ball/l"), {{1, 0, 0}, {0, 0, 0}});
  for (World* w : {&few, &many}) w->physics.wake(w->body("ball/l"));
  EXPECT_LT(many.seconds_of(kSteps), kFactor * few.seconds_of(kSteps));
}

TEST(Rest, KeepsItsContacts) {
  World w(boxes(2) + rolling(-10), 5000);
  w.run(3.0);
  for (const double v : {0.0, 1.0}) {  // of something elsewhere
    w.physics.set_twist(w.body("ball/l"), {{v, 0, 0}, {0, 0, 0}});
    w.physics.wake(w.body("ball/l"));
    w.run(0.1);
    ASSERT_TRUE(w.physics.sleeping(w.body("b1/l")));
    EXPECT_EQ(w.physics.contacts(w.body("b1/l")).size(), 4u);
    EXPECT_EQ(w.physics.nearby(w.body("b1/l")).size(), 4u);
    EXPECT_NEAR(load_of(w, "b1/l"), 20.0, 1e-3);
    Snapshot snapshot;
    w.physics.read(snapshot);
    double weight = 0.0;
    for (const Contact& contact : snapshot.contacts) weight += contact.force;
    EXPECT_NEAR(weight, 50.0, 1e-3);
  }
}

TEST(Rest, EndsWhenSomethingHitsIt) {
  World w(boxes(2) + thing("ball", "-2 0 0.1 0 0 0", kBall, 1.0, 0.0), 5000);
  w.run(3.0);
  w.physics.set_twist(w.body("ball/l"), {{4, 0, 0}, {0, 0, 0}});
  w.physics.wake(w.body("ball/l"));
  w.run(0.6);
  EXPECT_GT(w.position("b0/l").x(), 0.01);
  EXPECT_NEAR(w.position("b1/l").x(), 1.0, 1e-6);
  EXPECT_TRUE(w.physics.sleeping(w.body("b1/l")));
}

TEST(Rest, EndsWhenTheSupportIsPushed) {
  World w(kPlane + thing("under", "0 0 0.1 0 0 0", kBox, 2.0) +
              thing("over", "0 0 0.3 0 0 0", kBox, 2.0),
          5000);
  w.run(3.0);
  ASSERT_TRUE(w.physics.sleeping(w.body("over/l")));
  EXPECT_NEAR(load_of(w, "over/l"), 20.0, 1e-3);
  w.physics.apply_impulse(w.body("under/l"), {0, 20, 0}, {0, 0, 0});
  w.run(0.05);
  EXPECT_FALSE(w.physics.sleeping(w.body("over/l")));
  w.run(1.0);
  EXPECT_GT(w.position("over/l").y(), 0.01);
}

// A snapshot that holds an older state is brought up to date, whatever happened since.
TEST(Rest, SnapshotsAreWholeHoweverOldTheyWere) {
  const std::string arm =
      "<model name='arm'><link name='a'><pose>20 0 2 0 0 0</pose><inertial><pose>0.5 0 0 0 0 0"
      "</pose></inertial></link><joint name='j' type='revolute'><parent>world</parent><child>a"
      "</child><axis><xyz>0 1 0</xyz><dynamics><damping>5</damping></dynamics></axis></joint>"
      "</model>";
  World w(boxes(3) + thing("ball", "-2 0 0.1 0 0 0", kBall, 1.0, 0.0) + arm, 5000);
  std::array<Snapshot, 3> old;  // read at each step, at each 7th, and at each 300th
  for (int step = 0; step < 1200; ++step) {
    if (step == 700) {
      w.physics.set_twist(w.body("ball/l"), {{8, 0, 0}, {0, 0, 0}});
      w.physics.wake(w.body("ball/l"));
    }
    if (step == 900) w.physics.set_pose(w.body("b2/l"), Pose{Quat::Identity(), {9, 0, 0.1}});
    if (step == 901) w.physics.drive_joint_velocity(JointIndex(0), 1.0, 1e3);
    const int due[] = {1, 7, 300};
    for (size_t k = 0; k < old.size(); ++k) {
      if (step % due[k] != 0) continue;
      Snapshot fresh;
      w.physics.read(fresh);
      w.physics.read(old[k]);
      for (const BodyIndex i : fresh.bodies.indices()) {
        ASSERT_EQ(fresh.bodies[i].translation, old[k].bodies[i].translation) << step;
        ASSERT_EQ(fresh.body_twists[i].linear, old[k].body_twists[i].linear) << step;
        ASSERT_EQ(fresh.body_accelerations[i], old[k].body_accelerations[i]) << step;
      }
      ASSERT_EQ(fresh.joint_positions, old[k].joint_positions) << step;
      ASSERT_EQ(fresh.joint_velocities, old[k].joint_velocities) << step;
      ASSERT_EQ(fresh.joint_efforts, old[k].joint_efforts) << step;
    }
    w.physics.step();
  }
}

TEST(Rest, IsReadOnce) {
  constexpr int kSteps = 2000;
  World few(boxes(2), 5000), many(boxes(200), 5000);
  for (World* w : {&few, &many}) w->run(3.0);
  const auto cost = [](World& w) {
    Snapshot snapshot;
    w.physics.read(snapshot);
    return seconds_of([&] { w.physics.read(snapshot); }, kSteps);
  };
  EXPECT_LT(cost(many), 10.0 * cost(few));
}

// Also bits that nothing shows yet: both go on after a blow.
TEST(Rest, IsTheSameInACopy) {
  const std::string models = boxes(3) + thing("ball", "-2 0 0.1 0 0 0", kBall, 1.0, 0.0);
  World one(models, 5000), other(models, 5000), third(models, 5000);
  one.run(3.0);
  ASSERT_TRUE(one.physics.sleeping(one.body("b2/l")));
  StateArchive writer;
  one.physics.exchange(writer);
  StateArchive reader(writer.written());
  other.physics.exchange(reader);
  third.physics.copy_from(one.physics);
  for (World* w : {&one, &other, &third}) {
    EXPECT_NEAR(load_of(*w, "b2/l"), 20.0, 1e-3);
    w->physics.set_twist(w->body("ball/l"), {{8, 0, 0}, {0, 0, 0}});
    w->physics.wake(w->body("ball/l"));
    w->run(1.5);
  }
  EXPECT_GT(one.position("b1/l").x(), 1.001);
  for (const BodyIndex body : one.layout.bodies.indices()) {
    for (World* w : {&other, &third}) {
      EXPECT_EQ(one.physics.pose(body).translation, w->physics.pose(body).translation);
      EXPECT_EQ(one.physics.twist(body).linear, w->physics.twist(body).linear);
    }
  }
}

}  // namespace
}  // namespace ruedo::physics
