// What rests keeps its contacts, wakes when something reaches it, and costs nothing until then.
#include <gtest/gtest.h>

#include "world.h"

namespace ruedo::physics {
namespace {

using testing::kBall, testing::kBox, testing::kPlane, testing::thing, testing::World;

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
  EXPECT_LT(seconds_of(many, kSteps), kFactor * seconds_of(few, kSteps));
  for (World* w : {&few, &many}) w->physics.set_twist(w->body("ball/l"), {{1, 0, 0}, {0, 0, 0}});
  for (World* w : {&few, &many}) w->physics.wake(w->body("ball/l"));
  EXPECT_LT(seconds_of(many, kSteps), kFactor * seconds_of(few, kSteps));
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
  EXPECT_EQ(w.position("b1/l").x(), 1.0);
  EXPECT_TRUE(w.physics.sleeping(w.body("b1/l")));
}

TEST(Rest, EndsWhenWhatItRestsOnIsPushed) {
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
  third.physics.take(one.physics);
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
