// TouchPlugin and PerformerDetector of gz-sim: when they report, and what.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "ruedo/contact_t.hpp"
#include "ruedo/logical_camera_t.hpp"
#include "sensors/sensor_bench.h"

namespace ruedo {
namespace {

using test::Device;
using test::SensorBench;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr SimTime kStep_us = 5000;

// The messages of a device in the test's steps; the first is the initial state.
template <class Message>
struct Bench {
  Bench(const std::string& sdf, const std::string& robot, const std::string& name)
      : bench(sdf), device(bench.make(robot, name)), now(bench.snapshot()) {}
  // `sample`: one is due in this step.
  std::vector<Message> step(bool sample = false) {
    Outbox out;
    test::step(device, now, out, sample ? 0 : -1);
    ++now.step;
    now.time += kStep_us;
    return Device::decode<Message>(out);
  }
  SensorBench bench;
  Device device;
  Snapshot now;
};

std::string box(const std::string& name, const std::string& shape, const std::string& more = "") {
  return "<collision name='" + shape + "'><geometry><box><size>1 1 1</size></box></geometry>" +
         "</collision>" + more + "</link>" + (name.empty() ? "" : "</model>");
}

// Links in world order: white/body 0, white/foot 1, green/link 2, red/link 3.
std::string boxes(const std::string& plugin, const std::string& sensor =
                                                 "<sensor name='s' type='contact'><contact>"
                                                 "<collision>pad</collision></contact></sensor>") {
  return "<sdf version='1.9'><world name='w'><model name='white'><link name='body'>" +
         box("", "hull") + "<link name='foot'>" + box("", "pad", sensor) +
         "<joint name='j' type='revolute'><parent>body</parent><child>foot</child><axis/></joint>"
         "<plugin filename='gz-sim-touchplugin-system' name='gz::sim::systems::TouchPlugin'>" +
         plugin + "</plugin></model><model name='green'><link name='link'>" + box("green", "top") +
         "<model name='red'><link name='link'>" + box("red", "top") + "</world></sdf>";
}
constexpr LinkIndex kBody(0), kFoot(1), kGreen(2), kRed(3);

Contact touch(LinkIndex a, LinkIndex b) {
  Contact c;
  c.link_a = a;
  c.link_b = b;
  c.body_a = BodyIndex(static_cast<int>(a));
  c.body_b = BodyIndex(static_cast<int>(b));
  c.shape_a = c.shape_b = ShapeIndex(0);
  return c;
}

const std::string kGreenFor10ms =
    "<target>green</target><time>0.01</time><namespace>/here/touch_green</namespace>"
    "<enabled>true</enabled>";

using TouchBench = Bench<contact_t>;

TEST(Touch, PublishesOnceAfterTheTargetsTime) {
  TouchBench bench(boxes(kGreenFor10ms), "white", "touch_green");
  EXPECT_FALSE(bench.step(true).at(0).pressed);
  bench.now.contacts = {touch(kFoot, kGreen)};
  EXPECT_THAT(bench.step(), IsEmpty());  // since now
  EXPECT_THAT(bench.step(), IsEmpty());
  EXPECT_THAT(bench.step(), IsEmpty());  // for 10 ms: not for longer
  const auto told = bench.step();
  ASSERT_EQ(told.size(), 1u);
  EXPECT_TRUE(told[0].pressed);
  EXPECT_EQ(told[0].utime, 4 * kStep_us);
  ASSERT_EQ(told[0].n, 1);
  EXPECT_EQ(told[0].points[0].body, "green/link");
  EXPECT_THAT(bench.step(), IsEmpty());
  bench.now.contacts = {};
  const auto later = bench.step(true);
  ASSERT_EQ(later.size(), 1u);
  EXPECT_TRUE(later[0].pressed);  // for later subscribers
  EXPECT_EQ(later[0].n, 0);
}

TEST(Touch, RestartsAfterABreak) {
  TouchBench bench(boxes(kGreenFor10ms), "white", "touch_green");
  for (int i = 0; i < 3; ++i) {
    bench.now.contacts = {touch(kGreen, kFoot)};
    for (int n = 0; n < 3; ++n) EXPECT_THAT(bench.step(), IsEmpty());
    bench.now.contacts = {};
    EXPECT_THAT(bench.step(), IsEmpty());
  }
}

struct Case {
  std::string plugin;
  LinkIndex own, other;
  bool counts;
};

TEST(Touch, OnlyTheTargetAndCollisionsWithASensorCount) {
  const auto target = [](const std::string& name, const std::string& more = "") {
    return "<target>" + name + "</target><time>0</time><enabled>1</enabled>" + more;
  };
  const Case cases[] = {
      {target("green"), kFoot, kGreen, true},
      {target("green"), kFoot, kRed, false},
      {target("green"), kBody, kGreen, false},  // no contact sensor has that collision
      {target("ee"), kFoot, kGreen, true},
      {target("green::link::top"), kFoot, kGreen, true},
      {target("model/green/link/link/collision/top"), kFoot, kGreen, true},
      {target("link::top"), kFoot, kRed, true},
      {target("green::link::bottom"), kFoot, kGreen, false},
      {target("green", "<collision>hull</collision>"), kBody, kGreen, true},
      {target("green", "<collision>body::hull</collision>"), kBody, kGreen, true},
      {target("green", "<collision>white::body::hull</collision>"), kBody, kGreen, true},
      {target("green", "<collision>hull</collision>"), kFoot, kGreen, false},
  };
  for (const Case& each : cases) {
    TouchBench bench(boxes(each.plugin), "white", "touch");
    bench.now.contacts = {touch(each.own, each.other)};
    bench.step();
    EXPECT_EQ(bench.step().size(), each.counts ? 1u : 0u) << each.plugin << each.own;
  }
}

TEST(Touch, WithoutAContactSensorAllOfTheModelFeels) {
  TouchBench bench(boxes("<target>green</target><time>0</time><enabled>true</enabled>", ""),
                   "white", "touch");
  ASSERT_EQ(bench.bench.findings.list().size(), 1u);
  bench.now.contacts = {touch(kGreen, kBody)};
  bench.step();
  EXPECT_EQ(bench.step().size(), 1u);
}

// The region: 2 x 2 x 2 m about 5 1 0, 1 m ahead of a model that looks along y. The robot's box is
// 1 x 0.5 x 1 m.
std::string region(const std::string& plugin) {
  return "<sdf version='1.9'><world name='w'><plugin name='gz::sim' filename='dummy'><performer "
         "name='p'><ref>robot</ref><geometry><box><size>1 0.5 1</size></box></geometry>"
         "</performer></plugin><model name='gate'><static>true</static><pose>5 0 0 0 0 "
         "1.5707963267948966</pose><link name='l'/><plugin filename='x' "
         "name='gz::sim::systems::PerformerDetector'>" +
         plugin + "</plugin></model><model name='robot'><link name='l'/></model>" +
         "<model name='other'><pose>5 1 0 0 0 0</pose><link name='l'/></model></world></sdf>";
}
const std::string kBox =
    "<geometry><box><size>2 2 2</size></box></geometry><pose>1 0 0 0 0 0</pose>";

std::vector<std::string> names(const logical_camera_t& message) {
  std::vector<std::string> all;
  for (const logical_object_t& each : message.objects) all.push_back(each.model);
  return all;
}

TEST(PerformerDetector, PublishesPerformersThatEnterAndLeave) {
  Bench<logical_camera_t> bench(region(kBox), "gate", "performer_detector");
  const auto at = [&](double x, double y) -> Bench<logical_camera_t>& {
    bench.now.bodies[0].translation = {x, y, 0.5};
    return bench;
  };
  EXPECT_THAT(names(at(0, 1).step(true).at(0)), IsEmpty());
  EXPECT_THAT(at(3.49, 1).step(), IsEmpty());
  const auto came = at(3.51, 1.25).step();
  ASSERT_EQ(came.size(), 1u);
  ASSERT_THAT(names(came[0]), ElementsAre("robot"));
  // In the gate's frame, whose x axis is the world's y axis.
  EXPECT_NEAR(came[0].objects[0].position[0], 1.25, 1e-12);
  EXPECT_NEAR(came[0].objects[0].position[1], 1.49, 1e-12);
  EXPECT_NEAR(came[0].objects[0].position[2], 0.5, 1e-12);
  EXPECT_THAT(at(4, 1.25).step(), IsEmpty());
  EXPECT_THAT(names(bench.step(true).at(0)), ElementsAre("robot"));
  EXPECT_THAT(at(4, 2.24).step(), IsEmpty());
  const auto went = at(4, 2.26).step();
  ASSERT_EQ(went.size(), 1u);
  EXPECT_THAT(names(went[0]), IsEmpty());
}

TEST(PerformerDetector, TakesTheNameOfItsTopic) {
  Bench<logical_camera_t> bench(region(kBox + "<topic>/arena/gate_1</topic>"), "gate", "gate_1");
  EXPECT_THAT(names(bench.step(true).at(0)), IsEmpty());
}

}  // namespace
}  // namespace ruedo
