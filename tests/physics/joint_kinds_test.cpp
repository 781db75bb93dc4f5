// Mimic joints, screws, gearboxes, and gains from a file.
#include <gtest/gtest.h>

#include "world.h"

namespace ruedo::physics::testing {
namespace {

std::string link(const std::string& name, const std::string& pose, double mass = 1.0) {
  return "<link name='" + name + "'><pose>" + pose + "</pose><inertial><mass>" +
         std::to_string(mass) +
         "</mass><inertia><ixx>0.01</ixx><iyy>0.01</iyy><izz>0.01</izz></inertia></inertial></"
         "link>";
}
std::string joint(const std::string& name, const std::string& type, const std::string& parent,
                  const std::string& child, const std::string& xyz, const std::string& axis = "",
                  const std::string& more = "") {
  return "<joint name='" + name + "' type='" + type + "'><parent>" + parent + "</parent><child>" +
         child + "</child><axis><xyz>" + xyz + "</xyz>" + axis + "</axis>" + more + "</joint>";
}

// A gripper: one finger is commanded, the other follows with -1 times its travel, 2 cm off.
TEST(JointKinds, AMimicFollowsItsLeader) {
  World w(
      "<model name='m'>" + link("l", "0 0 1 0 0 0") + link("r", "0 0 1 0 0 0") +
          joint("right", "prismatic", "world", "r", "0 1 0",
                "<mimic joint='left'><multiplier>-1</multiplier><offset>0.02</offset></mimic>") +
          joint("left", "prismatic", "world", "l", "0 1 0") + "</model>",
      5000);
  const int follower = 0, leader = 1;
  w.run(0.2);
  EXPECT_NEAR(w.physics.joint_position(JointIndex(follower)), 0.02, 1e-6);
  w.physics.drive_joint_velocity(JointIndex(leader), 0.1, 1e3);
  for (int i = 0; i < 100; ++i) {
    w.physics.step();
    EXPECT_NEAR(w.physics.joint_position(JointIndex(follower)),
                0.02 - w.physics.joint_position(JointIndex(leader)), 1e-3);
  }
  EXPECT_NEAR(w.physics.joint_position(JointIndex(leader)), 0.05, 1e-3);
  EXPECT_NEAR(w.physics.joint_velocity(JointIndex(follower)), -0.1, 1e-4);
}

// A gripper that presses a box by an effort holds it still: friction of 0.6 bears 2 * 0.6 * 20 N,
// more than its 5 N, and nothing moves the fingers to and fro.
TEST(JointKinds, AMimicThatPressesByEffortHolds) {
  const auto finger = [](const std::string& name, const std::string& y) {
    return "<link name='" + name + "'><pose>0 " + y +
           " 1 0 0 0</pose><inertial><mass>0.1</mass><inertia><ixx>1e-4</ixx><iyy>1e-4</iyy>"
           "<izz>1e-4</izz></inertia></inertial><collision name='c'><geometry><box><size>0.03 0.01 "
           "0.06</size></box></geometry><surface><friction><ode><mu>0.6</mu><mu2>0.6</mu2></ode>"
           "</friction></surface></collision></link>";
  };
  for (const double aside : {0.0, 0.003}) {
    for (const int64_t step_us : {1000, 5000, 20'000}) {
      World w(
          "<model name='m'>" + finger("l", "-0.03") + finger("r", "0.03") +
              joint("left", "prismatic", "world", "l", "0 1 0") +
              joint("right", "prismatic", "world", "r", "0 1 0",
                    "<mimic joint='left'><multiplier>-1</multiplier><offset>0</offset></mimic>") +
              "</model>" +
              thing("box", "0 " + std::to_string(aside) + " 1 0 0 0",
                    "<box><size>0.04 0.04 0.04</size></box>", 0.5, 0.6, 1e-4),
          step_us);
      w.physics.set_gravity(w.body("box/l"), Vec3::Zero());
      w.physics.apply_joint_effort(JointIndex(0), 20.0);
      w.run(1.0);
      w.physics.set_gravity(w.body("box/l"), Vec3(0, 0, -10));
      w.run(0.5);
      const Vec3 start = w.position("box/l");
      double fastest = 0.0;
      for (int64_t t = 0; t < 5'000'000; t += step_us) {
        w.physics.step();
        fastest = std::max({fastest, std::abs(w.physics.joint_velocity(JointIndex(0))),
                            w.physics.twist(w.body("box/l")).linear.norm()});
      }
      EXPECT_LT(fastest, 1e-3) << aside << " " << step_us;
      EXPECT_LT((w.position("box/l") - start).norm(), 1e-3) << aside << " " << step_us;
      EXPECT_NEAR(start.y(), 0.0, 1e-3);
      EXPECT_NEAR(start.z(), 1.0, 5e-3);
    }
  }
}

// A load of 1 kg on a vertical screw of 10 mm per turn: it goes down by 10 mm per turn when it is
// turned, and where nothing holds it, it falls with m g = (m + J / p^2) a, where p is the travel
// per radian.
TEST(JointKinds, AScrewAdvancesByItsPitch) {
  const double pitch = 0.6, p = pitch / (2 * M_PI);  // a steep thread turns by its load
  World w("<model name='m'>" + link("nut", "0 0 1 0 0 0") +
              joint("s", "screw", "world", "nut", "0 0 1", "",
                    "<screw_thread_pitch>" + std::to_string(pitch) + "</screw_thread_pitch>") +
              "</model>",
          5000);
  w.run(0.5);
  const double a = 10.0 / (1.0 + 0.01 / (p * p)), fallen = 0.5 * a * 0.25;
  EXPECT_NEAR(w.position("m/nut").z(), 1.0 - fallen, 0.01 * fallen);
  EXPECT_NEAR(w.physics.joint_position(JointIndex(0)), -fallen / p, 0.01 * fallen / p);
  w.physics.drive_joint_velocity(JointIndex(0), 2.0, 1e3);
  const double before = w.position("m/nut").z();
  w.run(1.0);
  EXPECT_NEAR(w.position("m/nut").z() - before, 2.0 * p, 2e-3);
  // The effort is the load's: m g p.
  EXPECT_NEAR(w.physics.joint_effort(JointIndex(0)), 10.0 * p, 0.02 * 10.0 * p);
}

// A stop at two turns of a right-handed screw, in both notations.
TEST(JointKinds, AScrewHasLimitsAndItsOldPitchIsLeftHanded) {
  World w("<model name='m'>" + link("nut", "0 0 1 0 0 0") +
              joint("s", "screw", "world", "nut", "0 0 1",
                    "<limit><lower>-3</lower><upper>12.566</upper></limit>",
                    "<thread_pitch>-62.83185307</thread_pitch>") +
              "</model>",
          5000);
  w.physics.drive_joint_velocity(JointIndex(0), 10.0, 20.0);
  w.run(3.0);
  EXPECT_NEAR(w.physics.joint_position(JointIndex(0)), 12.566, 0.02);
  EXPECT_NEAR(w.position("m/nut").z(), 1.2, 1e-3);
}

// With 500 N m s/rad an arm of m g r = 5 N m that is commanded to stand still sinks at 0.01 rad/s
// while it is level.
TEST(JointKinds, ARateGainYields) {
  World w(
      "<model name='m'><link name='arm'><pose>0 0 1 0 0 0</pose><inertial><pose>0.5 0 0 0 0 "
      "0</pose><mass>1</mass><inertia><ixx>0.01</ixx><iyy>0.01</iyy><izz>0.01</izz></inertia></"
      "inertial></link>" +
          joint("j", "revolute", "world", "arm", "0 1 0",
                "<ruedo:rate_gain>500</ruedo:rate_gain>") +
          "</model>",
      5000);
  w.physics.drive_joint_velocity(JointIndex(0), 0.0, 1e3);
  w.run(0.5);
  EXPECT_NEAR(w.physics.joint_velocity(JointIndex(0)), 5.0 / 500.0, 1e-4);
}

std::string gearbox(const std::string& reference, double ratio, const std::string& xyz2 = "0 0 1") {
  return joint("gear", "gearbox", "p", "c", "0 0 1", "",
               "<axis2><xyz>" + xyz2 + "</xyz></axis2><gearbox_ratio>" + std::to_string(ratio) +
                   "</gearbox_ratio><gearbox_reference_body>" + reference +
                   "</gearbox_reference_body>");
}
constexpr int kTable = 0, kParent = 1, kChild = 2, kGear = 3;  // joints

// Two wheels of 0.01 kg m^2 on a table that turns or is held; geared by g = 3.
std::string geared(const std::string& table_joint, const std::string& reference) {
  return "<model name='m'>" + link("r", "0 0 1 0 0 0") + link("p", "0.2 0 1 0 0 0") +
         link("c", "-0.3 0 1 0 0 0") + joint("t", table_joint, "world", "r", "0 0 1") +
         joint("jp", "continuous", "r", "p", "0 0 1") +
         joint("jc", "continuous", "r", "c", "0 0 1") + gearbox(reference, 3.0) + "</model>";
}

// A torque on the one wheel turns both: (J + g^2 J) alpha = tau, theta2 = -g theta1.
TEST(JointKinds, AGearboxHoldsItsRatio) {
  World w("<model name='m'>" + link("p", "0.2 0 1 0 0 0") + link("c", "-0.3 0 1 0 0 0") +
              joint("jp", "continuous", "world", "p", "0 0 1") +
              joint("jc", "continuous", "world", "c", "0 0 1") + gearbox("world", 3.0) + "</model>",
          5000);
  w.physics.apply_joint_effort(JointIndex(0), 0.5);
  w.run(1.0);
  const double alpha = 0.5 / (0.01 + 9 * 0.01);  // 5 rad/s^2
  EXPECT_NEAR(w.physics.joint_velocity(JointIndex(0)), alpha, 1e-3 * alpha);
  EXPECT_NEAR(w.physics.joint_velocity(JointIndex(1)), -3.0 * alpha, 1e-3 * alpha);
  EXPECT_NEAR(w.physics.joint_position(JointIndex(1)),
              -3.0 * w.physics.joint_position(JointIndex(0)), 1e-6);
  EXPECT_NEAR(w.physics.joint_position(JointIndex(2)), w.physics.joint_position(JointIndex(1)),
              1e-6);  // 7.5 rad
  EXPECT_GT(w.physics.joint_position(JointIndex(0)), 2.4);
  // The moment on the child: J times its acceleration.
  EXPECT_NEAR(std::abs(w.physics.joint_effort(JointIndex(2))), 0.01 * 3.0 * alpha, 1e-3);
}

// The axes may be perpendicular, as of a bevel gear, and the ratio negative.
TEST(JointKinds, ABevelGear) {
  World w("<model name='m'>" + link("p", "0.2 0 1 0 0 0") + link("c", "-0.3 0 1 0 0 0") +
              joint("jp", "continuous", "world", "p", "0 0 1") +
              joint("jc", "continuous", "world", "c", "1 0 0") + gearbox("world", -0.5, "1 0 0") +
              "</model>",
          5000);
  w.physics.drive_joint_velocity(JointIndex(0), 2.0, 1e3);
  w.run(5.0);
  EXPECT_NEAR(w.physics.joint_position(JointIndex(0)), 10.0, 0.02);
  EXPECT_NEAR(w.physics.joint_position(JointIndex(1)),
              0.5 * w.physics.joint_position(JointIndex(0)), 1e-6);
}

// On a table that turns freely there is no external moment: with S the moment of inertia of all,
// and those of table and wheels about its axis, S w + (J - g J) theta1' = 0, and
// (J + g^2 J - (J - g J)^2 / S) theta1'' = tau.
TEST(JointKinds, AGearboxTurnsItsCarrier) {
  World w(geared("continuous", "r"), 5000);
  w.physics.apply_joint_effort(JointIndex(kParent), 0.5);
  w.run(1.0);
  const double J = 0.01, g = 3.0, S = 3 * J + 0.2 * 0.2 + 0.3 * 0.3, d = J - g * J;
  const double alpha = 0.5 / (J + g * g * J - d * d / S);
  EXPECT_NEAR(w.physics.joint_velocity(JointIndex(kParent)), alpha, 2e-3 * alpha);
  EXPECT_NEAR(w.physics.joint_velocity(JointIndex(kTable)), -d / S * alpha, 2e-3 * alpha);
  EXPECT_NEAR(w.physics.joint_position(JointIndex(kChild)),
              -g * w.physics.joint_position(JointIndex(kParent)), 1e-6);
  EXPECT_NEAR(w.physics.joint_position(JointIndex(kGear)),
              w.physics.joint_position(JointIndex(kChild)), 1e-6);
}

// Carried round on a table, gears that nothing turns relative to it stay at rest relative to it.
TEST(JointKinds, AGearboxIsCarriedRound) {
  World w(geared("continuous", "r"), 5000);
  w.physics.drive_joint_velocity(JointIndex(kTable), 3.0, 1e3);
  w.physics.drive_joint_velocity(JointIndex(kParent), 0.0, 1e3);
  w.run(4.0);
  EXPECT_NEAR(w.physics.joint_position(JointIndex(kTable)), 12.0, 0.02);
  EXPECT_NEAR(w.physics.joint_position(JointIndex(kParent)), 0.0, 1e-6);
  EXPECT_NEAR(w.physics.joint_position(JointIndex(kChild)), 0.0, 1e-5);
}

// A motor of 1e-5 kg m^2 holds an arm of m g r = 5 N m through 100 : 1, with a hundredth of its
// moment, and the arm does not sink.
TEST(JointKinds, AMotorHoldsAnArmThroughItsGearbox) {
  World w(
      "<model name='m'><link name='p'><pose>0 1 1 0 0 0</pose><inertial><mass>0.1</mass>"
      "<inertia><ixx>1e-5</ixx><iyy>1e-5</iyy><izz>1e-5</izz></inertia></inertial></link>"
      "<link name='c'><pose>0 0 1 0 0 0</pose><inertial><pose>0.5 0 0 0 0 0</pose>"
      "<mass>1</mass><inertia><ixx>0.01</ixx><iyy>0.01</iyy><izz>0.01</izz></inertia>"
      "</inertial></link>" +
          joint("jp", "continuous", "world", "p", "0 1 0") +
          joint("jc", "continuous", "world", "c", "0 1 0") +
          joint("gear", "gearbox", "p", "c", "0 1 0", "",
                "<gearbox_ratio>0.01</gearbox_ratio>"
                "<gearbox_reference_body>world</gearbox_reference_body>") +
          "</model>",
      5000);
  w.physics.drive_joint_velocity(JointIndex(0), 0.0, 1e3);
  w.run(10.0);
  EXPECT_NEAR(w.physics.joint_position(JointIndex(1)), 0.0, 1e-5);
  EXPECT_NEAR(std::abs(w.physics.joint_effort(JointIndex(0))), 0.05, 1e-4);
}

TEST(JointKinds, AGearboxNeedsItsReference) {
  const auto loaded = [](const std::string& more) {
    return world::load_world_text("<sdf version='1.9'><world name='w'><model name='m'>" +
                                      link("p", "0 0 0 0 0 0") + link("c", "0 0 0 0 0 0") +
                                      joint("g", "gearbox", "p", "c", "0 0 1", "", more) +
                                      "</model></world></sdf>",
                                  "test.sdf");
  };
  const auto said = [&](const std::string& more) {
    const auto world = loaded(more);
    return world->findings.empty() ? "nothing" : world->findings[0].text;
  };
  EXPECT_NE(said("").find("has no <gearbox_reference_body>"), std::string::npos) << said("");
  EXPECT_NE(said("<gearbox_reference_body>nobody</gearbox_reference_body>").find("nobody"),
            std::string::npos);
  EXPECT_EQ(said("<gearbox_reference_body>p</gearbox_reference_body>"), "nothing");
}

// Hinges on one frame: each is a branch of a tree, until gearboxes close loops between them.
TEST(JointKinds, WarnsAboutMoreLoopsThanAreSolvedAtOnce) {
  const auto gears = [](int hinges, bool meshed) {
    std::string model = "<model name='m'>" + link("frame", "0 0 1 0 0 0");
    for (int i = 0; i < hinges; ++i) {
      const std::string own = std::to_string(i), before = "g" + std::to_string(i - 1);
      model += link("g" + own, own + " 0 1 0 0 0") +
               joint("h" + own, "revolute", "frame", "g" + own, "0 0 1");
      if (i > 0 && meshed)
        model += joint("b" + own, "gearbox", before, "g" + own, "0 0 1", "",
                       "<gearbox_ratio>-1</gearbox_ratio><gearbox_reference_body>frame"
                       "</gearbox_reference_body>");
    }
    return World(model + "</model>").physics.findings();
  };
  EXPECT_TRUE(gears(60, false).empty());
  EXPECT_TRUE(gears(42, true).empty());
  const auto named = gears(44, true);
  ASSERT_EQ(named.size(), 1u);
  EXPECT_EQ(named[0].text,
            "its 87 joints close loops, and hold 263 degrees of freedom; 256 are solved at once, "
            "and the others bit by bit: less exactly, and slowly");
}

}  // namespace
}  // namespace ruedo::physics::testing
