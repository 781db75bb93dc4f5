// The physics world without robots: shapes, mass, friction, joints, contacts, kinematic bodies.
#include "physics/physics_world.h"

#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "world.h"

namespace ruedo::physics {
namespace {

using namespace testing;

struct ShapeCase {
  const char* geometry;
  double top;     // height above its centre where a ball on the z axis rests
  double bottom;  // depth below its centre on which it rests
};
void PrintTo(const ShapeCase& shape, std::ostream* out) { *out << shape.geometry; }

class EachShape : public ::testing::TestWithParam<ShapeCase> {};

TEST_P(EachShape, CarriesABallAtItsExactHeight) {
  World w(thing("s", "0 0 1 0 0 0", GetParam().geometry, 0) +
          thing("ball", "0 0 " + std::to_string(1.11 + GetParam().top) + " 0 0 0", kBall, 1));
  w.run(0.3);
  EXPECT_NEAR(w.physics.pose(BodyIndex(0)).translation.z(), 1.1 + GetParam().top, 1e-3);
}

TEST_P(EachShape, RestsOnThePlaneAtItsExactHeight) {
  World w(kPlane + thing("s", "0 0 " + std::to_string(GetParam().bottom + 0.01) + " 0 0 0",
                         GetParam().geometry, 1));
  w.run(0.5);
  EXPECT_NEAR(w.physics.pose(BodyIndex(0)).translation.z(), GetParam().bottom, 1e-3);
}

INSTANTIATE_TEST_SUITE_P(
    Shapes, EachShape,
    ::testing::Values(
        ShapeCase{"<box><size>0.4 0.6 0.2</size></box>", 0.1, 0.1},
        ShapeCase{"<sphere><radius>0.3</radius></sphere>", 0.3, 0.3},
        ShapeCase{"<cylinder><radius>0.3</radius><length>0.4</length></cylinder>", 0.2, 0.2},
        ShapeCase{"<capsule><radius>0.2</radius><length>0.4</length></capsule>", 0.4, 0.4},
        ShapeCase{"<ellipsoid><radii>0.3 0.4 0.2</radii></ellipsoid>", 0.2, 0.2}));

TEST(Physics, ABallFallsFreely) {
  World w(thing("ball", "0 0 5 0 0 0", kBall, 1));
  w.run(0.5);
  EXPECT_NEAR(w.physics.pose(BodyIndex(0)).translation.z(), 5.0 - 0.5 * 10 * 0.25, 0.01);
  EXPECT_NEAR(w.physics.twist(BodyIndex(0)).linear.z(), -5.0, 0.01);
}

TEST(Physics, TheGroundCarriesTheWeight) {
  for (const int64_t step_us : {1000, 5000, 20000}) {
    World w(kPlane + thing("box", "0 0 0.1 0 0 0", kBox, 3), step_us);
    w.run(1.0);
    double force = 0.0;
    for (const Contact& contact : w.physics.contacts(BodyIndex(0))) {
      EXPECT_NEAR(contact.normal.z(), 1.0, 1e-9);  // towards the box
      EXPECT_EQ(contact.body_b, -1);
      EXPECT_NEAR(contact.position.z(), 0.0, 1e-3);
      force += contact.force;
    }
    EXPECT_NEAR(force, 30.0, 0.5);
  }
}

TEST(Physics, FrictionIsTheLowerOfBoth) {
  // On a plane, 1 m/s: stops after v^2 / (2 mu g).
  for (const auto& [of_box, of_floor] : {std::pair(0.2, 1.0), std::pair(1.0, 0.2)}) {
    World w(thing("floor", "0 0 -0.5 0 0 0", "<box><size>20 20 1</size></box>", 0, of_floor) +
            thing("box", "0 0 0.1 0 0 0", kBox, 1, of_box));
    w.run(0.2);
    w.physics.set_twist(BodyIndex(0), {{1, 0, 0}, Vec3::Zero()});  // Eigen leaves {} unset
    w.run(2.0);
    EXPECT_NEAR(w.physics.pose(BodyIndex(0)).translation.x(), 0.25, 0.02);
  }
}

TEST(Physics, ThingsAtRestSleepAndStay) {
  World w(kPlane + thing("a", "0 0 0.1 0 0 0", kBox, 1) + thing("b", "0 0 0.3 0 0 0", kBox, 1),
          5000);
  w.run(5.0);
  EXPECT_TRUE(w.physics.sleeping(BodyIndex(0)));
  const Vec3 rest = w.physics.pose(BodyIndex(1)).translation;
  w.run(10.0);
  EXPECT_EQ(w.physics.pose(BodyIndex(1)).translation, rest);
  EXPECT_FALSE(w.physics.contacts(BodyIndex(0)).empty());  // and still touch
  w.physics.apply_impulse(BodyIndex(1), {0.5, 0, 0}, {0, 0, 0});
  w.run(0.1);
  EXPECT_GT(w.physics.pose(BodyIndex(1)).translation.x(), rest.x() + 0.005);
}

// <allow_auto_disable>false</allow_auto_disable>, in a model and beside what includes one.
TEST(Physics, ABodyThatMayNotSleepStaysAwake) {
  const std::string awake = "<allow_auto_disable>false</allow_auto_disable>";
  std::string a = thing("a", "0 0 0.1 0 0 0", kBox, 1);
  a.insert(a.find("<link"), awake);
  World w(kPlane + a + thing("b", "1 0 0.1 0 0 0", kBox, 1), 5000);
  w.run(10.0);
  EXPECT_FALSE(w.physics.sleeping(w.body("a/l")));
  EXPECT_TRUE(w.physics.sleeping(w.body("b/l")));
  EXPECT_FALSE(w.physics.may_sleep(w.body("a/l")));
  w.physics.sleep(w.body("a/l"));
  w.run(5.0);
  EXPECT_FALSE(w.physics.sleeping(w.body("a/l")));
  EXPECT_NEAR(w.position("a/l").z(), 0.1, 1e-5);
}

std::string door(const std::string& axis) {
  return "<model name='d'><pose>0 0 1 0 0 0</pose><joint name='fixed' type='fixed'>"
         "<parent>world</parent><child>frame</child></joint>"
         "<link name='frame'/><link name='leaf'><inertial><pose>0.4 0 0 0 0 0</pose>"
         "<mass>20</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1.2</izz></inertia></inertial></"
         "link>"
         "<joint name='hinge' type='revolute'><parent>frame</parent><child>leaf</child><axis>"
         "<xyz>0 0 1</xyz>" +
         axis + "</axis></joint></model>";
}

double opened(const World& w) {
  const Quat q = w.physics.pose(w.body("d/leaf")).rotation;
  return 2 * std::atan2(q.z(), q.w());
}

// What is slow does not rest: it has somewhere to go.
TEST(Physics, ASlowJointArrives) {
  World w(door("<limit><effort>100</effort></limit>"), 5000);
  w.physics.drive_joint_velocity(JointIndex(0), 0.005, 100.0);
  w.run(120.0);
  EXPECT_NEAR(opened(w), 0.6, 1e-3);
}

TEST(Physics, ADoorsSpringClosesIt) {
  // 1 N m/rad and 20 N m s/rad: e^(-t / 20 s) of the way remains.
  World w(door("<dynamics><spring_reference>0.95</spring_reference><spring_stiffness>1"
               "</spring_stiffness><damping>20</damping></dynamics>"),
          5000);
  w.run(200.0);
  EXPECT_NEAR(opened(w), 0.95, 2e-3);
}

TEST(Physics, ASlowBodyDriftsOn) {
  for (const double v : {0.004, 1e-6}) {
    World w(thing("a", "0 0 0 0 0 0", kBall, 1), 5000);
    w.physics.set_gravity(BodyIndex(0), Vec3::Zero());
    w.physics.set_twist(BodyIndex(0), {{v, 0, 0}, Vec3::Zero()});
    w.run(100.0);
    EXPECT_NEAR(w.position("a/l").x(), 100 * v, 1e-6 * v);
  }
}

TEST(Physics, MassCentreAndInertiaOfJoinedLinks) {
  // 1 kg at the origin and 3 kg at x = 2: centre at 1.5; Izz = 0.1 + 0.3 + 1 * 1.5^2 + 3 * 0.5^2
  // = 3.4.
  World w(
      "<model name='m'><link "
      "name='a'><inertial><mass>1</mass><inertia><ixx>0.1</ixx><iyy>0.1</iyy><izz>0.1</izz></"
      "inertia></inertial></link>"
      "<link name='b'><pose>1 0 0 0 0 0</pose><inertial><pose>1 0 0 0 0 "
      "0</pose><mass>3</mass><inertia><ixx>0.3</ixx><iyy>0.3</iyy><izz>0.3</izz>"
      "</inertia></inertial></link><joint name='j' "
      "type='fixed'><parent>a</parent><child>b</child></joint></model>");
  EXPECT_NEAR(w.physics.mass(BodyIndex(0)), 4.0, 1e-12);
  EXPECT_NEAR(w.physics.center_of_mass(BodyIndex(0)).x(), 1.5, 1e-12);
  EXPECT_NEAR(w.physics.inertia(BodyIndex(0))(2, 2), 3.4, 1e-12);
  EXPECT_NEAR(w.physics.inertia(BodyIndex(0))(0, 0), 0.4, 1e-12);
  // An impulse through the centre turns nothing; the frame's origin moves with it.
  w.physics.apply_impulse(BodyIndex(0), {0, 4, 0}, {0, 0, 0});
  EXPECT_NEAR(w.physics.twist(BodyIndex(0)).linear.y(), 1.0, 1e-12);
  w.physics.apply_impulse(BodyIndex(0), {0, 0, 0}, {0, 0, 3.4});
  EXPECT_NEAR(w.physics.twist(BodyIndex(0)).angular.z(), 1.0, 1e-12);
  EXPECT_NEAR(w.physics.twist(BodyIndex(0)).linear.y(), 1.0 - 1.5,
              1e-12);  // omega x (origin - centre)
}

TEST(Physics, ARotatedInertiaKeepsItsAxes) {
  World w(
      "<model name='m'><link name='a'><inertial><pose>0 0 0 0.3 0.2 "
      "0.9</pose><mass>1</mass><inertia><ixx>1</ixx><iyy>2</iyy><izz>2.5</izz>"
      "</inertia></inertial></link></model>");
  const Pose X = Pose::from_xyz_rpy({0, 0, 0}, {0.3, 0.2, 0.9});
  const Eigen::Matrix3d R = X.rotation.toRotationMatrix();
  const Eigen::Matrix3d expected = R * Vec3(1, 2, 2.5).asDiagonal() * R.transpose();
  EXPECT_LT((w.physics.inertia(BodyIndex(0)) - expected).norm(), 1e-9);
}

std::string hinged(const std::string& axis, const std::string& type = "revolute",
                   const std::string& more = "") {
  return "<model name='m'><link name='post'><inertial><mass>1</mass></inertial></link><joint "
         "name='w' type='fixed'><parent>world</parent><child>post</child></joint>"
         "<link name='arm'><pose>0 0 1 0 0 0</pose><inertial><pose>0.5 0 0 0 0 "
         "0</pose><mass>2</mass><inertia><ixx>0.01</ixx><iyy>0.1</iyy><izz>0.1</izz></inertia></"
         "inertial></link>"
         "<joint name='j' type='" +
         type + "'><parent>post</parent><child>arm</child><axis><xyz>" + axis + "</xyz>" + more +
         "</axis></joint></model>";
}

TEST(Joints, AMotorTurnsTheChildPositivelyAboutTheAxis) {
  World w(hinged("0 0 1"));
  ASSERT_EQ(w.layout.joints.size(), 1u);
  w.physics.drive_joint_velocity(JointIndex(0), 2.0, 100.0);
  w.run(4.0);
  EXPECT_NEAR(w.physics.joint_velocity(JointIndex(0)), 2.0, 1e-3);
  EXPECT_NEAR(w.physics.joint_position(JointIndex(0)), 8.0, 0.02);  // not wrapped
  EXPECT_NEAR(heading(w.physics.pose(w.body("m/arm")).rotation), wrap_angle(8.0), 0.02);
}

TEST(Joints, APendulumKeepsItsPeriod) {
  // Physical pendulum: T = 2 pi sqrt((I + m r^2) / (m g r)), small angles about hanging down.
  World w(
      "<model name='m'><link name='arm'><pose>0 0 1 0 1.4708 0</pose><inertial><pose>0.5 0 0 0 0 "
      "0</pose><mass>2</mass><inertia><ixx>0.01</ixx><iyy>0.1</iyy>"
      "<izz>0.1</izz></inertia></inertial></link><joint name='j' "
      "type='revolute'><parent>world</parent><child>arm</child><axis><xyz>0 1 "
      "0</xyz></axis></joint></model>",
      1000);
  const double period = 2 * M_PI * std::sqrt((0.1 + 2 * 0.25) / (2 * 10 * 0.5));
  w.run(period / 2);
  EXPECT_NEAR(w.physics.joint_position(JointIndex(0)), 0.2,
              5e-3);  // from 0.1 rad on one side to the other
}

TEST(Joints, LimitsHold) {
  World w(hinged("0 0 1", "revolute", "<limit><lower>-0.5</lower><upper>0.7</upper></limit>"));
  w.physics.drive_joint_velocity(JointIndex(0), 1.0, 20.0);
  w.run(3.0);
  EXPECT_NEAR(w.physics.joint_position(JointIndex(0)), 0.7, 0.02);
  w.physics.drive_joint_velocity(JointIndex(0), -1.0, 20.0);
  w.run(3.0);
  EXPECT_NEAR(w.physics.joint_position(JointIndex(0)), -0.5, 0.02);
}

// A limit on one side only, and limits beyond a turn, hold as well.
TEST(Joints, LimitsHoldOnOneSideAndBeyondATurn) {
  World one(hinged("0 0 1", "revolute", "<limit><lower>-0.5</lower></limit>"));
  one.physics.drive_joint_velocity(JointIndex(0), -1.0, 20.0);
  one.run(2.0);
  EXPECT_NEAR(one.physics.joint_position(JointIndex(0)), -0.5, 0.02);
  one.physics.drive_joint_velocity(JointIndex(0), 2.0, 20.0);
  one.run(5.0);
  EXPECT_GT(one.physics.joint_position(JointIndex(0)), 7.0);  // more than a turn
  World wide(hinged("0 0 1", "revolute", "<limit><lower>-4</lower><upper>8</upper></limit>"));
  wide.physics.drive_joint_velocity(JointIndex(0), 2.0, 20.0);
  wide.run(6.0);
  EXPECT_NEAR(wide.physics.joint_position(JointIndex(0)), 8.0, 0.02);
  wide.physics.drive_joint_velocity(JointIndex(0), -2.0, 20.0);
  wide.run(8.0);
  EXPECT_NEAR(wide.physics.joint_position(JointIndex(0)), -4.0, 0.02);
}

// A joint that is approximated is reported, once and by name.
TEST(Physics, WarnsAboutSimplifiedJointsAndFriction) {
  const auto shape = [](const std::string& name, const std::string& friction) {
    return "<collision name='" + name + "'><geometry>" + kBall + "</geometry><surface><friction>" +
           friction + "</friction></surface></collision>";
  };
  World w(
      "<model name='m'><link name='a'>" + shape("one", "<ode><mu>0.5</mu><mu2>0.5</mu2></ode>") +
      shape("two", "<ode><mu>0.9</mu><mu2>0.5</mu2></ode>") +
      shape("three", "<ode><mu>0.9</mu><mu2>0.5</mu2><fdir1>1 0 0</fdir1></ode>") +
      "</link><link name='b'>" + shape("c", "<torsional><coefficient>1</coefficient></torsional>") +
      shape(
          "d",
          "<torsional><coefficient>1</coefficient><patch_radius>0.01</patch_radius></torsional>") +
      "</link><joint name='j' type='ball'><parent>a</parent><child>b</child></joint></model>");
  ASSERT_EQ(w.physics.findings().size(), 3u);
  EXPECT_EQ(w.physics.findings()[0].element, "model m/joint j");
  EXPECT_EQ(w.physics.findings()[1].element, "model m/link a/collision two");
  EXPECT_EQ(w.physics.findings()[2].element, "model m/link b/collision c");
}

TEST(Joints, EffortAccelerates) {
  // 0.6 N m on I + m r^2 = 0.6 kg m^2: 1 rad/s^2.
  World w(hinged("0 0 1"));
  w.physics.apply_joint_effort(JointIndex(0), 0.6);
  w.run(1.0);
  EXPECT_NEAR(w.physics.joint_velocity(JointIndex(0)), 1.0, 0.01);
  EXPECT_EQ(w.physics.joint_effort(JointIndex(0)), 0.6);
}

TEST(Joints, AMotorHoldsAgainstGravityAndReportsItsEffort) {
  World w(hinged("0 1 0"));  // the arm lies along x: 2 kg * 10 * 0.5 m = 10 N m, which y turns down
  w.physics.drive_joint_velocity(JointIndex(0), 0.0, 100.0);
  w.run(0.5);
  EXPECT_NEAR(w.physics.joint_position(JointIndex(0)), 0.0, 0.01);
  EXPECT_NEAR(w.physics.joint_effort(JointIndex(0)), -10.0, 0.3);
}

TEST(Joints, DampingSlowsDownAndNeverReverses) {
  // I = 0.6, damping 0.6: the rate falls by 1/e in 1 s.
  World w(hinged("0 0 1", "continuous", "<dynamics><damping>0.6</damping></dynamics>"));
  w.physics.apply_joint_effort(JointIndex(0), 6.0);
  w.run(0.2);
  const double rate = w.physics.joint_velocity(JointIndex(0));
  w.physics.apply_joint_effort(JointIndex(0), 0.0);
  w.run(1.0);
  EXPECT_NEAR(w.physics.joint_velocity(JointIndex(0)) / rate, std::exp(-1.0), 0.02);
  World stiff(hinged("0 0 1", "continuous", "<dynamics><damping>1e6</damping></dynamics>"));
  stiff.physics.apply_joint_effort(JointIndex(0), 1.0);
  stiff.run(1.0);
  EXPECT_GE(stiff.physics.joint_velocity(JointIndex(0)), -1e-9);
  EXPECT_LT(stiff.physics.joint_velocity(JointIndex(0)), 0.01);
}

TEST(Joints, FrictionHoldsUpToItsEffortAndStopsEvenly) {
  // I = 0.6, friction 0.6: 6 N m for 0.2 s give (6 - 0.6) / 0.6 * 0.2 = 1.8 rad/s, which end
  // after 1.8 s.
  const std::string dry = "<dynamics><friction>0.6</friction></dynamics>";
  World w(hinged("0 0 1", "continuous", dry));
  w.physics.apply_joint_effort(JointIndex(0), 0.5);
  w.run(1.0);
  EXPECT_NEAR(w.physics.joint_position(JointIndex(0)), 0.0, 1e-6);
  w.physics.apply_joint_effort(JointIndex(0), 6.0);
  w.run(0.2);
  EXPECT_NEAR(w.physics.joint_velocity(JointIndex(0)), 1.8, 0.03);
  w.physics.apply_joint_effort(JointIndex(0), 0.0);
  w.run(1.0);
  EXPECT_NEAR(w.physics.joint_velocity(JointIndex(0)), 0.8, 0.03);
  w.run(2.0);
  EXPECT_NEAR(w.physics.joint_velocity(JointIndex(0)), 0.0, 1e-6);
}

// An arm that hangs from a ball or a universal joint, 0.1 rad off in the plane of x and z, or in
// that of y and z.
std::string pendulum(const std::string& type, const std::string& tilt) {
  return "<model name='m'><link name='arm'><pose>0 0 1 " + tilt +
         "</pose><inertial><pose>0 0 -0.5 0 0 "
         "0</pose><mass>2</mass><inertia><ixx>0.1</ixx><iyy>0.1</iyy>"
         "<izz>0.01</izz></inertia></inertial></link><joint name='j' type='" +
         type + "'><parent>world</parent><child>arm</child>" +
         (type == "ball" ? "" : "<axis><xyz>1 0 0</xyz></axis><axis2><xyz>0 1 0</xyz></axis2>") +
         "</joint></model>";
}

TEST(Joints, ABallAndAUniversalJointSwingBothWays) {
  const double period = 2 * M_PI * std::sqrt((0.1 + 2 * 0.25) / (2 * 10 * 0.5));
  for (const char* const type : {"ball", "universal"}) {
    for (const bool along_x : {true, false}) {
      World w(pendulum(type, along_x ? "0 -0.1 0" : "0.1 0 0"), 1000);
      const auto centre = [&] { return Vec3(w.physics.pose(BodyIndex(0)) * Vec3(0, 0, -0.5)); };
      const Vec3 start = centre();
      EXPECT_NEAR(along_x ? start.x() : start.y(), 0.5 * std::sin(0.1), 1e-9);
      w.run(period / 2);
      EXPECT_NEAR(centre().x(), -start.x(), 2e-3) << type << along_x;
      EXPECT_NEAR(centre().y(), -start.y(), 2e-3) << type << along_x;
      EXPECT_LT((w.physics.pose(BodyIndex(0)).translation - Vec3(0, 0, 1)).norm(), 1e-3)
          << type << along_x;
    }
  }
}

// An arm along x that turns about z and then about itself. Its weight pulls about y, which is held.
std::string cardan(const std::string& first = "", const std::string& second = "") {
  std::string text = hinged("0 0 1", "universal", first);
  return text.replace(text.find("</joint></model>"), 8,
                      "<axis2><xyz>1 0 0</xyz>" + second + "</axis2></joint>");
}

TEST(Joints, AUniversalJointTakesCommandsForItsFirstAxis) {
  World w(cardan());
  w.physics.drive_joint_velocity(JointIndex(0), 2.0, 100.0);
  w.run(4.0);
  EXPECT_NEAR(w.physics.joint_velocity(JointIndex(0)), 2.0, 5e-3);
  EXPECT_NEAR(w.physics.joint_position(JointIndex(0)), 8.0, 0.02);  // through more than a turn
  EXPECT_NEAR(heading(w.physics.pose(w.body("m/arm")).rotation), wrap_angle(8.0), 0.02);
  EXPECT_NEAR((w.physics.pose(w.body("m/arm")) * Vec3(0.5, 0, 0)).z(), 1.0, 2e-3);
  World pushed(cardan());
  pushed.physics.apply_joint_effort(JointIndex(0), 0.6);  // on 0.6 kg m^2
  pushed.run(1.0);
  EXPECT_NEAR(pushed.physics.joint_velocity(JointIndex(0)), 1.0, 0.01);
}

TEST(Joints, LimitsAndBrakesOfAUniversalJoint) {
  World w(cardan("<limit><lower>-0.5</lower><upper>0.7</upper></limit>"));
  w.physics.drive_joint_velocity(JointIndex(0), 1.0, 20.0);
  w.run(3.0);
  EXPECT_NEAR(w.physics.joint_position(JointIndex(0)), 0.7, 0.02);
  w.physics.drive_joint_velocity(JointIndex(0), -1.0, 20.0);
  w.run(3.0);
  EXPECT_NEAR(w.physics.joint_position(JointIndex(0)), -0.5, 0.02);
  World wide(cardan("<limit><lower>-4</lower><upper>8</upper></limit>"));
  wide.physics.drive_joint_velocity(JointIndex(0), 2.0, 20.0);
  wide.run(6.0);
  EXPECT_NEAR(wide.physics.joint_position(JointIndex(0)), 8.0, 0.02);
  // I = 0.6, damping 0.6, as for a hinge.
  World damped(cardan("<dynamics><damping>0.6</damping></dynamics>"));
  damped.physics.apply_joint_effort(JointIndex(0), 6.0);
  damped.run(0.2);
  const double rate = damped.physics.joint_velocity(JointIndex(0));
  damped.physics.apply_joint_effort(JointIndex(0), 0.0);
  damped.run(1.0);
  EXPECT_NEAR(damped.physics.joint_velocity(JointIndex(0)) / rate, std::exp(-1.0), 0.02);
}

// The second axis is along y, and the arm's weight of 10 N m turns about it: to its limit, and not
// at all against more friction.
TEST(Joints, TheSecondAxisOfAUniversalJointHasItsOwnLimits) {
  const auto fallen = [](const std::string& more) {
    std::string text = hinged("0 0 1", "universal");
    World w(text.replace(text.find("</joint></model>"), 8,
                         "<axis2><xyz>0 1 0</xyz>" + more + "</axis2></joint>"));
    w.run(3.0);
    return std::asin((1.0 - (w.physics.pose(w.body("m/arm")) * Vec3(0.5, 0, 0)).z()) /
                     0.5);  // positive about y is down
  };
  EXPECT_NEAR(fallen("<limit><lower>-0.2</lower><upper>0.3</upper></limit>"), 0.3, 0.02);
  EXPECT_NEAR(fallen("<dynamics><friction>12</friction></dynamics>"), 0.0, 0.01);
  EXPECT_GT(fallen("<dynamics><damping>5</damping></dynamics>"), 0.8);
}

TEST(Joints, ASliderGoesAlongItsAxis) {
  World w(hinged("0 1 0", "prismatic", "<limit><lower>-0.2</lower><upper>0.6</upper></limit>"));
  w.physics.drive_joint_velocity(JointIndex(0), 0.5, 100.0);
  w.run(0.8);
  EXPECT_NEAR(w.physics.joint_position(JointIndex(0)), 0.4, 0.01);
  EXPECT_NEAR(w.physics.joint_velocity(JointIndex(0)), 0.5, 0.01);
  EXPECT_NEAR(w.physics.pose(w.body("m/arm")).translation.y(), 0.4, 0.01);
  EXPECT_NEAR(w.physics.pose(w.body("m/arm")).translation.z(), 1.0, 0.01);
  w.run(1.0);
  EXPECT_NEAR(w.physics.joint_position(JointIndex(0)), 0.6, 0.01);
}

TEST(Joints, LinksOfAModelCollideOnlyWithSelfCollide) {
  const auto gap = [](bool self_collide) {
    const std::string box =
        "<inertial><mass>1</mass><inertia><ixx>0.01</ixx><iyy>0.01</iyy><izz>0.01</izz></inertia></"
        "inertial>"
        "<collision name='c'><geometry>" +
        kBox + "</geometry></collision>";
    World w(kPlane + "<model name='m'><self_collide>" + (self_collide ? "true" : "false") +
            "</self_collide><link name='low'><pose>0 0 0.1 0 0 0</pose>" + box +
            "</link><link name='high'><pose>0 0 0.31 0 0 0</pose>" + box + "</link></model>");
    w.run(1.0);
    return w.physics.pose(BodyIndex(1)).translation.z() -
           w.physics.pose(BodyIndex(0)).translation.z();
  };
  EXPECT_NEAR(gap(true), 0.2, 2e-3);
  EXPECT_NEAR(gap(false), 0.0, 2e-3);
}

TEST(Physics, AGuidedBodyEndsExactlyThereUnlessItTouches) {
  World w(kPlane + thing("box", "0 0 0.5 0 0 0", kBox, 1) +
              thing("wall", "1 0 0.5 0 0 0", "<box><size>0.2 1 1</size></box>", 0),
          10000);
  const int box = w.body("box/l");
  for (int i = 1; i <= 60; ++i) {
    const Pose end{Quat::Identity(), {0.01 * i, 0, 0.5}};
    w.physics.guide(BodyIndex(box), {{1, 0, 0}, Vec3::Zero()}, end);
    w.physics.step();
    EXPECT_EQ(w.physics.pose(BodyIndex(box)).translation, end.translation);
  }
  for (int i = 61; i <= 120; ++i) {
    w.physics.guide(
        BodyIndex(box), {{1, 0, 0}, Vec3::Zero()},
        {Quat::Identity(), {w.physics.pose(BodyIndex(box)).translation.x() + 0.01, 0, 0.5}});
    w.physics.step();
    EXPECT_LT(w.physics.pose(BodyIndex(box)).translation.x(),
              0.801);  // the wall's face at 0.9, half a box before it
  }
}

// A barrel on its side, pushed, rolls on at that speed, since nothing brakes or drives it.
TEST(Physics, ARollingCylinderKeepsItsSpeed) {
  const std::string barrel = "<cylinder><radius>0.15</radius><length>0.5</length></cylinder>";
  const std::string floor =
      thing("floor", "0 0 -0.1 0 0 0", "<box><size>20 20 0.2</size></box>", 0);
  for (const std::string& ground : {kPlane, floor}) {
    for (const int64_t step_us : {1000, 5000}) {
      World w(ground + thing("barrel", "0 0 0.15 1.5707963267948966 0 0", barrel, 10, 0.5, 0.2),
              step_us);
      w.run(0.5);
      const int body = w.body("barrel/l");
      w.physics.set_twist(BodyIndex(body), {{0.3, 0, 0}, {0, 2, 0}});
      w.run(10);
      EXPECT_NEAR(w.physics.twist(BodyIndex(body)).linear.x(), 0.3, 1e-3) << step_us;
      EXPECT_NEAR(w.physics.pose(BodyIndex(body)).translation.x(), 3.0, 1e-2) << step_us;
      EXPECT_NEAR(w.physics.pose(BodyIndex(body)).translation.y(), 0.0, 1e-2) << step_us;
    }
  }
}

TEST(Physics, DividedConcaveMeshesGiveNoFinding) {
  // An L of two boxes as one polyline: extruded, it is a mesh.
  const std::string l =
      "<polyline><point>0 0</point><point>1 0</point><point>1 0.2</point><point>0.2 "
      "0.2</point><point>0.2 1</point><point>0 1</point><height>0.2</height></polyline>";
  const std::string square =
      "<polyline><point>0 0</point><point>1 0</point><point>1 1</point><point>0 "
      "1</point><height>0.2</height></polyline>";
  EXPECT_EQ(World(thing("m", "0 0 1 0 0 0", l, 1)).physics.findings().size(), 0u);
  EXPECT_EQ(World(thing("m", "0 0 1 0 0 0", square, 1)).physics.findings().size(), 0u);
  EXPECT_EQ(World(thing("m", "0 0 1 0 0 0", l, 0)).physics.findings().size(), 0u);
}

TEST(Physics, AStaticMeshCarriesAtItsExactHeight) {
  const std::string slab =
      "<polyline><point>-1 -1</point><point>1 -1</point><point>1 1</point><point>-1 "
      "1</point><height>0.2</height></polyline>";
  World w(thing("m", "0 0 1 0 0 0", slab, 0) + thing("ball", "0.3 0.2 1.31 0 0 0", kBall, 1) +
          thing("box", "-0.3 0.2 1.31 0 0 0", kBox, 1));
  w.run(0.5);
  EXPECT_NEAR(w.physics.pose(BodyIndex(0)).translation.z(), 1.3, 1e-3);
  EXPECT_NEAR(w.physics.pose(BodyIndex(1)).translation.z(), 1.3, 1e-3);
}

TEST(Physics, ContactsNameTheShapesThatTouch) {
  const auto two_boxes = [](const std::string& name, double height) {
    const std::string z = std::to_string(height);
    const std::string rest = " 0 0 0 0 0</pose><geometry>" + kBox + "</geometry></collision>";
    return "<model name='" + name + "'><pose>0 0 " + z + " 0 0 0</pose>" +
           (height > 0 ? "" : "<static>true</static>") +
           "<link "
           "name='l'><inertial><mass>1</mass><inertia><ixx>0.1</ixx><iyy>0.1</iyy><izz>0.1</izz></"
           "inertia></inertial>"
           "<collision name='left'><pose>-0.5" +
           rest + "<collision name='right'><pose>0.5" + rest + "</link></model>";
  };
  World w(two_boxes("below", 0) + two_boxes("above", 0.21));
  w.run(0.5);
  int left = 0, right = 0;
  for (const Contact& contact : w.physics.contacts(w.body("above/l"))) {
    const ShapeIndex expected(contact.position.x() < 0 ? 0 : 1);
    EXPECT_EQ(contact.shape_a, expected);
    EXPECT_EQ(contact.shape_b, expected);
    ++(expected == ShapeIndex(0) ? left : right);
  }
  EXPECT_GT(left, 0);
  EXPECT_GT(right, 0);
}

TEST(Physics, ContactsComeInAFixedOrder) {
  std::string models = kPlane;
  for (int i = 0; i < 20; ++i)
    models += thing(
        "b" + std::to_string(i),
        std::to_string(i % 5 * 0.25) + " " + std::to_string(i / 5 * 0.25) + " 0.1 0 0 0", kBox, 1);
  World w(models);
  w.run(0.3);
  Snapshot snapshot;
  w.physics.read(snapshot);
  ASSERT_GE(snapshot.contacts.size(), 20u);
  for (size_t i = 1; i < snapshot.contacts.size(); ++i)
    EXPECT_LE(snapshot.contacts[i - 1].body_a, snapshot.contacts[i].body_a);
}

}  // namespace
}  // namespace ruedo::physics
