// Surface parameters act per shape: friction and its directions, slip, torsion, rolling, stiffness,
// bounce.
#include <gtest/gtest.h>

#include "world.h"

namespace ruedo::physics::testing {
namespace {

// A body of 1 kg of those shapes; `surface` is what stands in <surface> of each.
std::string shape(const std::string& name, const std::string& pose, const std::string& geometry,
                  const std::string& surface) {
  return "<collision name='" + name + "'><pose>" + pose + "</pose><geometry>" + geometry +
         "</geometry><surface>" + surface + "</surface></collision>";
}
std::string body(const std::string& name, const std::string& pose, const std::string& shapes,
                 double inertia = 0.01) {
  const std::string i = std::to_string(inertia);
  return "<model name='" + name + "'><pose>" + pose +
         "</pose><link name='l'><inertial><mass>1</mass><inertia><ixx>" + i + "</ixx><iyy>" + i +
         "</iyy><izz>" + i + "</izz></inertia></inertial>" + shapes + "</link></model>";
}
std::string ode(const std::string& friction) {
  return "<friction><ode>" + friction + "</ode></friction>";
}

// Pushed at 1 m/s at an angle (rad) to x; where it is 2 s later.
Vec3 slide(const std::string& surface, double angle = 0.0, const std::string& yaw = "0") {
  World w(kPlane + body("b", "0 0 0.1 0 0 " + yaw, shape("c", "0 0 0 0 0 0", kBox, surface)), 5000);
  w.run(0.2);
  const Vec3 start = w.position("b/l");
  w.physics.set_twist(w.body("b/l"), {{std::cos(angle), std::sin(angle), 0}, Vec3::Zero()});
  w.run(2.0);
  return w.position("b/l") - start;
}

// v^2 / (2 mu g), whatever the direction: a cone, not a pyramid.
TEST(Surfaces, FrictionIsTheSameInAllDirections) {
  for (const double angle : {0.0, 0.4, M_PI / 4, 2.0}) {
    const Vec3 way = slide(ode("<mu>0.4</mu><mu2>0.4</mu2>"), angle);
    EXPECT_NEAR(way.norm(), 1.0 / (2 * 0.4 * 10), 3e-3) << angle;
    EXPECT_NEAR(std::atan2(way.y(), way.x()), angle, 5e-3) << angle;
  }
}

// A sledge with friction `mu` that pulls another one with a friction of 0.5: its place after 2 s.
Vec3 sledges(const std::string& mu) {
  const auto runner = [](const std::string& friction) {
    return shape("c", "0 0 0 0 0 0", kBox, ode("<mu>" + friction + "</mu>"));
  };
  World w(kPlane + "<model name='b'><pose>0 0 0.1 0 0 0</pose><link name='l'>" + runner(mu) +
              "</link><link name='r'><pose>-0.5 0 0 0 0 0</pose>" + runner("0.5") +
              "</link><joint name='j' type='revolute'><parent>l</parent><child>r</child><axis>"
              "<xyz>0 0 1</xyz></axis></joint></model>",
          5000);
  w.run(0.2);
  for (const char* link : {"b/l", "b/r"})
    w.physics.set_twist(w.body(link), {{1, 0, 0}, Vec3::Zero()});
  w.run(2.0);
  return w.position("b/l");
}

// Friction too small to measure is no friction, along and across, and nothing becomes infinite.
TEST(Surfaces, TinyFrictionEqualsNoFriction) {
  for (const std::string mu : {"1e-300", "1e-160", "1e-12"}) {
    EXPECT_NEAR(slide(ode("<mu>" + mu + "</mu><mu2>" + mu + "</mu2>")).x(), 2.0, 1e-6) << mu;
    const std::string two = ode("<mu>" + mu + "</mu><mu2>0.5</mu2><fdir1>1 0 0</fdir1>");
    EXPECT_NEAR(slide(two, 0.0).x(), 2.0, 1e-6) << mu;
    EXPECT_NEAR(slide(two, M_PI / 2).y(), 0.1, 5e-3) << mu;
    EXPECT_EQ(sledges(mu), sledges("0")) << mu;
  }
}

// mu along fdir1, which turns with the shape, mu2 across.
TEST(Surfaces, FrictionDirectionsTurnWithTheShape) {
  const std::string two = ode("<mu>0.8</mu><mu2>0.2</mu2><fdir1>1 0 0</fdir1>");
  EXPECT_NEAR(slide(two, 0.0).norm(), 1.0 / 16, 3e-3);
  EXPECT_NEAR(slide(two, M_PI / 2).norm(), 1.0 / 4, 5e-3);
  EXPECT_NEAR(slide(two, 0.0, "1.5707963267948966").norm(), 1.0 / 4, 5e-3);
}

// A slab on two feet, one of them frictionless: pushed, it turns about the other. A single body
// with one friction would not.
TEST(Surfaces, FrictionBelongsToAShape) {
  const std::string foot = "<box><size>0.1 0.1 0.1</size></box>";
  World w(kPlane + body("b", "0 0 0.05 0 0 0",
                        shape("rubber", "0 0.3 0 0 0 0", foot, ode("<mu>1</mu><mu2>1</mu2>")) +
                            shape("ice", "0 -0.3 0 0 0 0", foot, ode("<mu>0</mu><mu2>0</mu2>")),
                        0.1),
          5000);
  w.run(0.2);
  w.physics.set_twist(w.body("b/l"), {{0.5, 0, 0}, Vec3::Zero()});
  w.run(0.3);
  EXPECT_GT(std::abs(heading(w.physics.pose(w.body("b/l")).rotation)), 0.05);
}

// slip1 of 0.05 m/s per N: 1 kg at a slope of 0.1 rad creeps at slip times m g sin(0.1), over all
// its contacts.
TEST(Surfaces, SlipYieldsInProportionToTheForce) {
  const double angle = 0.1, slip = 0.4;
  World w(thing("slope", "0 0 -0.5 0 " + std::to_string(angle) + " 0",
                "<box><size>10 10 1</size></box>", 0, 1) +
              body("b", "0 0 0.1035 0 " + std::to_string(angle) + " 0",
                   shape("c", "0 0 0 0 0 0", kBox,
                         ode("<mu>1</mu><mu2>1</mu2><slip1>" + std::to_string(slip) +
                             "</slip1><slip2>" + std::to_string(slip) + "</slip2>"))),
          5000);
  w.run(1.0);
  // Three or four contacts share it: a box rests on three.
  const double rate = w.physics.twist(w.body("b/l")).linear.norm(), force = 10 * std::sin(angle);
  EXPECT_GT(rate, 0.99 * slip * force / 4);
  EXPECT_LT(rate, 1.01 * slip * force / 3);
}

// A ball that spins on a patch of 2 cm: moment 3 pi / 16 * mu * a * m g, and the spin ends after I
// w / M.
TEST(Surfaces, TorsionalFrictionEndsASpin) {
  World w(
      kPlane + body("b", "0 0 0.1 0 0 0",
                    shape("c", "0 0 0 0 0 0", kBall,
                          "<friction><torsional><coefficient>0.5</coefficient><patch_radius>0.02</"
                          "patch_radius></torsional></friction>")),
      5000);
  w.run(0.2);
  w.physics.set_twist(w.body("b/l"), {Vec3::Zero(), {0, 0, 5}});
  const double moment = 3 * M_PI / 16 * 0.5 * 0.02 * 10, ends = 0.01 * 5 / moment;
  w.run(0.5 * ends);
  EXPECT_NEAR(w.physics.twist(w.body("b/l")).angular.z(), 2.5, 0.1);
  w.run(0.6 * ends);
  EXPECT_NEAR(w.physics.twist(w.body("b/l")).angular.z(), 0.0, 1e-6);
}

// Rolling friction of c metres: m a r (1 + I / m r^2) = c m g.
TEST(Surfaces, RollingFrictionBrakesABall) {
  World w(
      kPlane +
          body("b", "0 0 0.1 0 0 0",
               shape("c", "0 0 0 0 0 0", kBall,
                     "<friction><bullet><friction>1</friction><friction2>1</"
                     "friction2><rolling_friction>0.002</rolling_friction></bullet></friction>"),
               0.004),
      5000);
  w.run(0.2);
  w.physics.set_twist(w.body("b/l"), {{1, 0, 0}, {0, 10, 0}});
  w.run(2.0);
  const double deceleration = 0.002 * 10 / (0.1 * (1 + 0.004 / 0.01));
  EXPECT_NEAR(w.physics.twist(w.body("b/l")).linear.x(), 1.0 - 2.0 * deceleration, 0.01);
}

// A ball of 1 kg on a spring of 2000 N/m sinks by m g / k.
TEST(Surfaces, StiffnessIsThatOfTheFile) {
  World w(kPlane + body("b", "0 0 0.1 0 0 0",
                        shape("c", "0 0 0 0 0 0", kBall,
                              "<contact><ode><kp>2000</kp><kd>60</kd></ode></contact>")),
          5000);
  w.run(2.0);
  EXPECT_NEAR(w.position("b/l").z(), 0.1 - 10.0 / 2000, 1e-5);
}

// From a metre, the bounce reaches e^2 of the height: within a part in a thousand, at all steps.
TEST(Surfaces, ABounceHasTheFilesRestitution) {
  const auto bouncing = [](double e) {
    return "<bounce><restitution_coefficient>" + std::to_string(e) +
           "</restitution_coefficient></bounce>";
  };
  std::string ground = kPlane;
  ground.insert(ground.find("</collision>"), "<surface>" + bouncing(1.0) + "</surface>");
  for (const int64_t step_us : {1000, 5000, 10'000}) {
    for (const double e : {0.2, 0.5, 1.0}) {
      World w(ground + body("b", "0 0 1.1 0 0 0", shape("c", "0 0 0 0 0 0", kBall, bouncing(e))),
              step_us);
      double highest = 0.0;
      bool hit = false;
      for (int64_t t = 0; t < 1'300'000; t += step_us) {
        w.physics.step();
        hit |= w.physics.twist(BodyIndex(0)).linear.z() > 0.0;
        if (hit) highest = std::max(highest, w.position("b/l").z() - 0.1);
      }
      EXPECT_NEAR(highest, e * e, 2e-3) << e << " at " << step_us;
    }
  }
}

// Rows that can move nothing: bodies that a drive moves along the ground do not roll.
TEST(Surfaces, BodiesThatOnlyTurnUprightMayResistRolling) {
  const std::string surface =
      "<friction><ode><mu>0.5</mu></ode><bullet><rolling_friction>0.01</rolling_friction></bullet>"
      "<torsional><coefficient>0.5</coefficient><patch_radius>0.1</patch_radius></torsional>"
      "</friction>";
  std::string models = kPlane + thing("wall", "-0.2 0 0.1 0 0 0", kBox, 0);
  for (int i = 0; i < 4; ++i) {
    models += body("b" + std::to_string(i), std::to_string(0.2 * i) + " 0.02 0.1 0 0 0",
                   shape("c", "0 0 0 0 0 0", kBox, surface));
  }
  World w(models, 5000);
  for (const char* name : {"b0/l", "b1/l", "b2/l", "b3/l"})
    w.physics.set_support(w.body(name), Support::plane);
  for (int i = 0; i < 100; ++i) {
    w.physics.apply_impulse(w.body("b3/l"), {-0.5, 0, 0}, Vec3::Zero());
    w.physics.step();
  }
  EXPECT_NEAR(w.position("b3/l").x(), 0.6, 0.01);
}

}  // namespace
}  // namespace ruedo::physics::testing
