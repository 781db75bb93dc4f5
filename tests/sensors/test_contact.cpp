// The contact sensor: which contacts are its own, from which side they are shown, and that no touch
// is lost.
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "ruedo/contact_t.hpp"
#include "sensors/sensor_bench.h"

namespace ruedo {
namespace {

using test::Device;
using test::SensorBench;

// A robot with a bumper link of two shapes, a free box, and a static wall.
std::string world(const std::string& contact) {
  return "<sdf version='1.9'><world name='w'>"
         "<model name='robot'><link name='body'><collision "
         "name='hull'><geometry><sphere><radius>0.1</radius></sphere></geometry></collision></link>"
         "<link name='bumper'><collision "
         "name='left'><geometry><sphere><radius>0.1</radius></sphere></geometry></collision>"
         "<collision "
         "name='right'><geometry><sphere><radius>0.1</radius></sphere></geometry></collision>"
         "<sensor name='BUMPER' type='contact'><update_rate>20</update_rate>" +
         contact +
         "</sensor></link>"
         "<joint name='j' type='fixed'><parent>body</parent><child>bumper</child></joint></model>"
         "<model name='box'><pose>2 0 0 0 0 0</pose><link name='link'><collision "
         "name='c'><geometry><box><size>1 1 1</size></box></geometry></collision></link></model>"
         "<model name='wall'><static>true</static><pose>4 0 0 0 0 0</pose><link "
         "name='bricks'><collision name='c'><geometry><box><size>1 1 "
         "1</size></box></geometry></collision></link></model>"
         "</world></sdf>";
}

// Links in world order: robot/body 0, robot/bumper 1, box/link 2, wall/bricks 3. Bodies: robot 0,
// box 1.
constexpr LinkIndex kHull(0), kBumper(1), kBox(2), kWall(3);

Contact touch(LinkIndex link_a, LinkIndex link_b, int shape_a = 0, int shape_b = 0) {
  Contact c;
  c.link_a = link_a;
  c.link_b = link_b;
  const auto body = [](LinkIndex link) {
    return link == kWall ? BodyIndex() : BodyIndex(link == kBox ? 1 : 0);
  };
  c.body_a = body(link_a);
  c.body_b = body(link_b);
  c.shape_a = ShapeIndex(shape_a);
  c.shape_b = ShapeIndex(shape_b);
  c.position = {1, 2, 3};
  c.normal = {-1, 0, 0};
  c.force = 12.5;
  c.depth = 0.001;
  return c;
}

struct Bench {
  explicit Bench(const std::string& contact)
      : bench(world(contact)), device(bench.make("robot", "BUMPER")), now(bench.snapshot()) {}
  contact_t with(std::vector<Contact> contacts) {
    now.contacts = std::move(contacts);
    ++now.step;
    now.time += 5000;
    Outbox out;
    test::step(device, now, out, 0);
    return Device::decode<contact_t>(out).at(0);
  }
  void pass(std::vector<Contact> contacts) {
    now.contacts = std::move(contacts);
    ++now.step;
    now.time += 5000;
    Outbox out;
    test::step(device, now, out, -1);
    EXPECT_TRUE(out.entries().empty());
  }
  SensorBench bench;
  Device device;
  Snapshot now;
};

TEST(ContactSensor, IsNotPressedWithoutAContact) {
  Bench bench("");
  const contact_t m = bench.with({});
  EXPECT_EQ(m.utime, 5000);
  EXPECT_FALSE(m.pressed);
  EXPECT_EQ(m.n, 0);
  EXPECT_EQ(bench.device.channels, (std::vector<std::string>{"robot/BUMPER"}));
}

TEST(ContactSensor, ShowsThePointFromItsOwnSide) {
  Bench bench("");
  contact_t m = bench.with({touch(kBumper, kBox)});
  ASSERT_EQ(m.n, 1);
  EXPECT_TRUE(m.pressed);
  EXPECT_EQ(m.points[0].body, "box/link");
  EXPECT_EQ(m.points[0].position[1], 2.0);
  EXPECT_EQ(m.points[0].normal[0], -1.0);
  EXPECT_EQ(m.points[0].force, 12.5);
  EXPECT_EQ(m.points[0].depth, 0.001);
  m = bench.with({touch(kWall, kBumper)});  // the sensor is b: the normal is turned round
  ASSERT_EQ(m.n, 1);
  EXPECT_EQ(m.points[0].body, "wall/bricks");
  EXPECT_EQ(m.points[0].normal[0], 1.0);
}

TEST(ContactSensor, IgnoresOtherLinksOfItsBody) {
  Bench bench("");
  EXPECT_FALSE(bench.with({touch(kHull, kBox), touch(kBox, kWall)}).pressed);
  EXPECT_EQ(bench.with({touch(kHull, kBox), touch(kBumper, kBox), touch(kWall, kBumper)}).n, 2);
}

TEST(ContactSensor, FeelsOnlyItsCollisions) {
  for (const char* name : {"right", "robot::bumper::right"}) {
    Bench bench("<contact><collision>" + std::string(name) + "</collision></contact>");
    EXPECT_FALSE(bench.with({touch(kBumper, kBox, 0)}).pressed) << name;
    EXPECT_TRUE(bench.with({touch(kBumper, kBox, 1)}).pressed) << name;
    EXPECT_TRUE(bench.with({touch(kBox, kBumper, 0, 1)}).pressed) << name;
    EXPECT_TRUE(bench.with({touch(kBumper, kBox, -1)}).pressed)
        << "a shape that is not known counts";
    EXPECT_TRUE(bench.bench.findings.list().empty());
  }
  Bench both("<contact><collision>left</collision><collision>right</collision></contact>");
  EXPECT_TRUE(both.with({touch(kBumper, kBox, 0)}).pressed);
  EXPECT_TRUE(both.with({touch(kBumper, kBox, 1)}).pressed);
}

// Of an SDF file that was written for what sdformat makes of a URDF.
TEST(ContactSensor, NamesOfTheConverterOfUrdf) {
  const auto contact = [](const std::string& name) {
    return "<contact><collision>" + name + "</collision></contact>";
  };
  for (const char* name : {"bumper_collision_1", "body_fixed_joint_lump__bumper_collision_1"}) {
    Bench bench(contact(name));
    EXPECT_TRUE(bench.bench.findings.list().empty()) << name;
    EXPECT_FALSE(bench.with({touch(kBumper, kBox, 0)}).pressed) << name;
    EXPECT_TRUE(bench.with({touch(kBumper, kBox, 1)}).pressed) << name;
    EXPECT_FALSE(bench.with({touch(kHull, kBox, 0)}).pressed) << name;
  }
  // Of another link that moves as one with the sensor's: the converter makes one link of them.
  Bench other(contact("base_fixed_joint_lump__body_collision"));
  EXPECT_TRUE(other.bench.findings.list().empty());
  EXPECT_FALSE(other.with({touch(kBumper, kBox, 0)}).pressed);
  EXPECT_EQ(other.with({touch(kBox, kHull, 0, 0)}).n, 1);
  for (const char* name : {"bumper_collision_2", "bumper_collision_x", "box_collision"})
    EXPECT_EQ(Bench(contact(name)).bench.findings.list().size(), 1u) << name;
}

TEST(ContactSensor, AMissingShapeIsReportedAndTheLinkCounts) {
  Bench bench("<contact><collision>middle</collision></contact>");
  ASSERT_EQ(bench.bench.findings.list().size(), 1u);
  EXPECT_THAT(bench.bench.findings.list()[0].text,
              testing::HasSubstr("'middle' is not a collision"));
  EXPECT_TRUE(bench.with({touch(kBumper, kBox, 0)}).pressed);
  EXPECT_TRUE(
      Bench("<contact><collision>__default__</collision></contact>").bench.findings.list().empty());
}

TEST(ContactSensor, ATouchBetweenTwoSamplesIsNotLost) {
  Bench bench("");
  bench.pass({touch(kBumper, kBox)});
  bench.pass({});
  contact_t m = bench.with({});
  EXPECT_TRUE(m.pressed);
  EXPECT_EQ(m.n, 0);  // but it is over
  EXPECT_FALSE(bench.with({}).pressed);
}

// A kinematic robot on a plane has no contact pair with it.
std::string rover(const std::string& drive) {
  const auto wheel = [](const std::string& side, const std::string& y) {
    return "<link name='" + side + "'><pose>0 " + y +
           " 0.1 -1.5707963 0 0</pose><collision name='c'><geometry>"
           "<cylinder><radius>0.1</radius><length>0.02</length></cylinder></geometry></collision>"
           "<sensor name='" +
           side + "_foot' type='contact'/></link><joint name='" + side +
           "_joint' type='revolute'><parent>base</parent><child>" + side +
           "</child><axis><xyz>0 0 1</xyz></axis></joint>";
  };
  return "<sdf version='1.9'><world name='w'><model name='floor'><static>1</static><pose>0 0 -0.5 "
         "0 0 0"
         "</pose><link name='link'><collision "
         "name='c'><geometry><plane/></geometry></collision></link></model>"
         "<model name='robot'><pose>1 2 -0.5 0 0 0.5</pose><link name='base'><pose>0 0 0.15 0 0 "
         "0</pose>"
         "<collision name='hull'><geometry><box><size>0.3 0.2 "
         "0.1</size></box></geometry></collision>"
         "<collision name='caster'><pose>-0.12 0 -0.12 0 0 "
         "0</pose><geometry><sphere><radius>0.03</radius>"
         "</sphere></geometry></collision>"
         "<sensor name='hull' "
         "type='contact'><contact><collision>hull</collision></contact></sensor>"
         "<sensor name='caster' "
         "type='contact'><contact><collision>caster</collision></contact></sensor>"
         "</link>" +
         wheel("left", "0.15") + wheel("right", "-0.15") + "<ruedo:drive type='" + drive +
         "'><ruedo:left_joint>left_joint</ruedo:left_joint>"
         "<ruedo:right_joint>right_joint</ruedo:right_joint></ruedo:drive></model></world></sdf>";
}

contact_t of_rover(const std::string& sensor, const std::string& drive, double above) {
  SensorBench bench(rover(drive));
  Device device = bench.make("robot", sensor);
  Snapshot now = bench.snapshot();
  now.robots[RobotIndex(0)].X_WBase.translation.z() += above;
  Outbox out;
  test::step(device, now, out, 0);
  return Device::decode<contact_t>(out).at(0);
}

TEST(ContactSensor, AKinematicRobotTouchesThePlane) {
  for (const char* sensor : {"left_foot", "right_foot", "caster"}) {
    const contact_t m = of_rover(sensor, "kinematic", 0.0);
    EXPECT_TRUE(m.pressed) << sensor;
    ASSERT_EQ(m.n, 1);
    EXPECT_EQ(m.points[0].body, "floor/link");
    EXPECT_DOUBLE_EQ(m.points[0].normal[2], 1.0);
    EXPECT_DOUBLE_EQ(m.points[0].position[2], -0.5);
    EXPECT_FALSE(of_rover(sensor, "kinematic", 0.01).pressed) << sensor << " in the air";
    EXPECT_FALSE(of_rover(sensor, "wheels", 0.0).pressed) << sensor << " has contacts of its own";
  }
  const contact_t left = of_rover("left_foot", "kinematic", 0.0);
  EXPECT_NEAR(left.points[0].position[0], 1.0 - 0.15 * std::sin(0.5), 1e-9);
  EXPECT_NEAR(left.points[0].position[1], 2.0 + 0.15 * std::cos(0.5), 1e-9);
  EXPECT_FALSE(of_rover("hull", "kinematic", 0.0).pressed);
}

TEST(ContactSensor, RefusedConfigurations) {
  EXPECT_THROW(Bench("<ruedo:force>1</ruedo:force>"), InputError);
}

}  // namespace
}  // namespace ruedo
