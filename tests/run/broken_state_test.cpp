// A state that is not finite: the run ends with the state before it, and names the body.
#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/simulation.h"
#include "running.h"

namespace ruedo::run {
namespace {

TEST(BrokenState, EndsTheRunAndIsNotPublished) {
  engine::Channels channels;
  Findings findings;
  engine::Wakeup wakeup;
  const auto world =
      load_text(robot_sdf("r", 0, 0) +
                "<model name='thing'><pose>3 0 50 0 0 0</pose><link name='l'/></model>");
  engine::Simulation simulation(world, {}, channels, findings, wakeup);
  Pacer pacer(world->step_us, std::numeric_limits<double>::infinity(), 1000);
  pacer.set_limit(99);
  simulation.start(pacer);
  int64_t last = -1;
  const auto take = [&] {
    while (const engine::Batch* batch = simulation.next_batch()) {
      for (int i = 0; i < batch->count; ++i) {
        const Snapshot& snapshot = batch->snapshots[i];
        EXPECT_EQ(snapshot.step, ++last);
        for (const Pose& pose : snapshot.bodies) EXPECT_TRUE(pose.translation.allFinite());
      }
    }
  };
  for (take(); last < 99; take()) wakeup.wait();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto& bodies = simulation.layout().bodies;
  const auto thing = std::find_if(bodies.begin(), bodies.end(),
                                  [](const auto& body) { return body.name == "thing/l"; });
  ASSERT_NE(thing, bodies.end());
  // No input causes this, so the test manipulates the physics while it stands still.
  const_cast<physics::PhysicsWorld&>(simulation.physics())
      .set_twist(BodyIndex(thing - bodies.begin()), {Vec3(nan, 0, 0), Vec3::Zero()});
  pacer.set_limit(1000);
  for (take(); !simulation.over(); take()) wakeup.wait();
  EXPECT_EQ(last, 99);
  EXPECT_THAT(simulation.end(), testing::HasSubstr("'thing/l'"));
}

// The renderer is created again when a model comes or goes, which may fail the second time, and
// again on the way back.
TEST(BrokenState, TheRunEndsWithoutARenderer) {
  engine::Channels channels;
  Findings findings;
  engine::Wakeup wakeup;
  const std::string camera =
      "<sensor name='camera' "
      "type='camera'><update_rate>10</update_rate><camera><image><width>8</width><height>8</"
      "height></image></camera></sensor>";
  const auto world = load_text(robot_sdf("r", 0, 0, camera));
  Pacer pacer(world->step_us, std::numeric_limits<double>::infinity(), 1000);
  engine::Simulation simulation(world, {}, channels, findings, wakeup);
  pacer.set_limit(9);
  simulation.start(pacer);
  int64_t last = -1;
  while (last < 9) {
    if (const engine::Batch* batch = simulation.next_batch())
      last += batch->count;
    else
      wakeup.wait();
  }
  const auto guest = load_text(robot_sdf("guest", 0, 0))->models.at(0).model;
  const Pose place{Quat::Identity(), {3, 0, 0}};
  const int instance = simulation.add_model("guest", place, guest, 10, channels, findings);
  setenv("RUEDO_RENDERER", "none", 1);
  EXPECT_THROW(
      simulation.add_model("second", {Quat::Identity(), {6, 0, 0}}, guest, 10, channels, findings),
      engine::SceneLost);
  EXPECT_THROW(simulation.remove_model(InstanceIndex(instance), channels), engine::SceneLost);
  unsetenv("RUEDO_RENDERER");
}

}  // namespace
}  // namespace ruedo::run
