// Bases other than differential ones, on real wheels: with friction they come close to the closed
// forms of the kinematic drive, and their odometry to the true pose.
#include <cmath>
#include <fstream>
#include <sstream>

#include <gtest/gtest.h>

#include "sim.h"

namespace ruedo::robot::testing {
namespace {

// A robot that comes with Ruedo, with the wheels drive, and more elements in the drive.
std::string on_wheels(const std::string& name, const std::string& more = "",
                      const std::string& odometry = "") {
  std::ifstream file(std::string(RUEDO_SOURCE_DIR "/worlds/robots/") + name + "/model.sdf");
  std::stringstream text;
  text << file.rdbuf();
  std::string sdf = text.str();
  sdf = sdf.substr(sdf.find("<model"), sdf.find("</sdf>") - sdf.find("<model"));
  const std::string drive = "<ruedo:drive steering";
  sdf.replace(sdf.find(drive), drive.size(), "<ruedo:drive type='wheels' steering");
  sdf.insert(sdf.find("</ruedo:drive>"), more);
  if (!odometry.empty())
    sdf.insert(sdf.find("</model>"), "<ruedo:odometry>" + odometry + "</ruedo:odometry>");
  return plane_sdf() + sdf;
}

class OnWheels : public Sim {
 public:
  explicit OnWheels(const std::string& models) : Sim(models) {}
  void hold(double vx, double vy, double omega, double seconds) {
    for (double t = 0; t < seconds - 1e-9; t += 0.25) {
      robots.apply({RobotIndex(0), VelocityCommand{vx, vy, omega}});
      run(std::min(0.25, seconds - t));
    }
  }
  double steering_of(const std::string& joint) const {
    for (size_t i = 0; i < layout.wheels.size(); ++i) {
      if (world->models.back().model->joints[layout.wheels[i].joint].name == joint)
        return state.wheel_angles[i];
    }
    return NAN;
  }
};

TEST(CarOnWheels, GoesRoundACircle) {  // of 1 m, as the bicycle model has it
  OnWheels sim(on_wheels("car"));
  sim.hold(0.5, 0.0, 0.5, 2.0);
  const Pose begin = sim.robot().X_WBase;
  EXPECT_NEAR(sim.steering_of("left_knuckle_joint"), std::atan2(0.5, 1 - 0.18), 5e-3);
  EXPECT_NEAR(sim.steering_of("right_knuckle_joint"), std::atan2(0.5, 1 + 0.18), 5e-3);
  sim.hold(0.5, 0.0, 0.5, 2.0);
  const Vec3 moved = begin.inverse() * sim.robot().X_WBase.translation;
  EXPECT_NEAR(moved.x(), std::sin(1.0), 0.02);
  EXPECT_NEAR(moved.y(), 1 - std::cos(1.0), 0.02);
  EXPECT_NEAR(heading(begin.rotation.conjugate() * sim.robot().X_WBase.rotation), 1.0, 0.02);
}

TEST(CarOnWheels, AnArcEndsWhereItShould) {
  OnWheels sim(on_wheels("car"));
  sim.move(Move::ARC, M_PI / 2, 1.5);
  sim.run(12.0);
  EXPECT_EQ(sim.robot().motion.state, Status::STATE_DONE);
  EXPECT_NEAR(sim.position().x(), 1.5, 0.04);
  EXPECT_NEAR(sim.position().y(), 1.5, 0.04);
  sim.move(Move::ROTATE, 1.0);
  sim.step();
  EXPECT_EQ(sim.state.motion_ends.at(0).state.state, Status::STATE_REFUSED);
}

TEST(TricycleOnWheels, GoesStraightAndRound) {
  OnWheels sim(on_wheels("tricycle"));
  sim.move(Move::ADVANCE, 1.0);
  sim.run(6.0);
  EXPECT_EQ(sim.robot().motion.state, Status::STATE_DONE);
  EXPECT_NEAR(sim.position().x(), 1.0, 0.01);
  EXPECT_NEAR(sim.position().y(), 0.0, 0.01);
}

// A roller that turns freely lets the wheel move along its own axle: all of the twist comes from
// the rims.
TEST(MecanumOnWheels, MovesInEveryDirection) {
  const double twists[][3] = {
      {0.3, 0, 0}, {0, 0.3, 0}, {0.2, -0.2, 0}, {0, 0, 0.6}, {0.2, 0.1, 0.4}};
  for (const auto& twist : twists) {
    OnWheels sim(on_wheels("mecanum"));
    sim.hold(twist[0], twist[1], twist[2], 1.5);
    EXPECT_NEAR(sim.robot().twist.linear.x(), twist[0], 0.015) << twist[0] << twist[1] << twist[2];
    EXPECT_NEAR(sim.robot().twist.linear.y(), twist[1], 0.015) << twist[0] << twist[1] << twist[2];
    EXPECT_NEAR(sim.robot().twist.angular.z(), twist[2], 0.03) << twist[0] << twist[1] << twist[2];
  }
}

TEST(MecanumOnWheels, ItsPrimitivesAndItsBelief) {
  OnWheels sim(on_wheels("mecanum"));
  sim.move(Move::ROTATE, M_PI / 2);
  sim.run(6.0);
  EXPECT_EQ(sim.robot().motion.state, Status::STATE_DONE);
  EXPECT_NEAR(sim.yaw(), M_PI / 2, 0.03);
  // It assumes its levers to be longer by a tenth, and turns too far by as much.
  OnWheels wrong(on_wheels("mecanum", "", "<ruedo:track_error>0.1</ruedo:track_error>"));
  wrong.move(Move::ROTATE, 1.0);
  wrong.run(6.0);
  EXPECT_NEAR(wrong.yaw(), 1.1, 0.03);
}

TEST(OmniOnWheels, MovesInEveryDirection) {
  const double twists[][3] = {{0.3, 0, 0}, {0, 0.3, 0}, {0, 0, 0.6}, {0.2, 0.1, 0.4}};
  for (const auto& twist : twists) {
    OnWheels sim(on_wheels("omni"));
    sim.hold(twist[0], twist[1], twist[2], 1.5);
    EXPECT_NEAR(sim.robot().twist.linear.x(), twist[0], 0.015) << twist[0] << twist[1] << twist[2];
    EXPECT_NEAR(sim.robot().twist.linear.y(), twist[1], 0.015) << twist[0] << twist[1] << twist[2];
    EXPECT_NEAR(sim.robot().twist.angular.z(), twist[2], 0.03) << twist[0] << twist[1] << twist[2];
  }
}

// Tracks as rows of wheels: they skid in turns, and turn by less than the rims suggest.
TEST(TrackedOnWheels, DrivesAndSkids) {
  OnWheels sim(on_wheels("crawler"));
  sim.hold(0.3, 0.0, 0.0, 2.0);
  EXPECT_NEAR(sim.robot().twist.linear.x(), 0.3, 0.01);
  OnWheels turning(on_wheels("crawler"));
  turning.hold(0.0, 0.0, 0.8, 3.0);
  EXPECT_GT(turning.robot().twist.angular.z(), 0.2);
  EXPECT_LT(turning.robot().twist.angular.z(), 0.8);
}

TEST(HolonomicOnWheels, IsRefusedWithAReason) {
  try {
    OnWheels sim(on_wheels("puck"));
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(error.message().find("which has no wheels that could drive it"), std::string::npos)
        << error.message();
  }
}

}  // namespace
}  // namespace ruedo::robot::testing
