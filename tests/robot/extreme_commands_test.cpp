// Commands of every kind with numbers that upset arithmetic, one field at a time: some are refused,
// and after the others every state stays finite.

#include <gtest/gtest.h>

#include "physics/state_check.h"
#include "sim.h"

namespace ruedo::robot::testing {
namespace {

std::string shipped(const std::string& name) {
  return plane_sdf() + "<include><uri>" RUEDO_SOURCE_DIR "/worlds/robots/" + name +
         "/model.sdf</uri><name>r</name></include>";
}

class ExtremeCommands : public ::testing::TestWithParam<std::string> {
 protected:
  // At rest, and while it drives.
  void try_out(const Command& command, const std::string& what) {
    for (const double before : {0.0, 0.3}) {
      sim_.robots.set_pose(InstanceIndex(1), Pose{});  // after the plane
      sim_.robots.apply({RobotIndex(0), VelocityCommand{before, 0.0, before}});
      sim_.step(2);
      sim_.robots.apply(command);
      follow(what + (before > 0.0 ? ", driving" : ", at rest"));
    }
  }

  void follow(const std::string& what) {
    for (int step = 0; step < 3; ++step) {
      ASSERT_NO_THROW(sim_.step()) << what;
      ASSERT_NO_THROW(physics::check_finite(sim_.state, *sim_.world, sim_.layout)) << what;
      for (const RobotState& robot : sim_.state.robots) {
        ASSERT_TRUE(robot.X_WBase.translation.allFinite() &&
                    robot.X_WBase.rotation.coeffs().allFinite())
            << what;
      }
    }
  }

  Sim sim_{GetParam() == "wheels" ? plane_sdf() + robot_sdf("r", "0 0 0 0 0 0.3", "", "wheels")
                                  : shipped(GetParam())};
};

TEST_P(ExtremeCommands, OfVelocity) {
  for (const double value : extremes()) {
    for (int field = 0; field < 3; ++field) {
      for (const double others : {0.0, 0.5}) {
        double v[3] = {others, 0.0, others};
        v[field] = value;
        try_out({RobotIndex(0), VelocityCommand{v[0], v[1], v[2]}},
                "velocity " + std::to_string(field) + " " + std::to_string(others) + " " +
                    ::testing::PrintToString(value));
      }
    }
  }
}

TEST_P(ExtremeCommands, OfWheels) {
  for (const double value : extremes()) {
    for (const size_t wheels : {2, 3, 4}) {
      std::vector<double> rates(wheels, 1.0);
      rates.back() = value;
      try_out({RobotIndex(0), WheelCommand{rates}}, ::testing::PrintToString(rates));
      try_out({RobotIndex(0), WheelCommand{std::vector<double>(wheels, value)}},
              ::testing::PrintToString(value) + " for all");
    }
  }
}

TEST_P(ExtremeCommands, OfPrimitives) {
  for (int8_t kind = Move::ADVANCE; kind <= Move::STOP; ++kind) {
    for (const double value : extremes()) {
      for (int field = 0; field < 5; ++field) {
        for (const double own : {0.0, 0.5}) {  // limits: the robot's own, or the command's
          double v[5] = {0.5, 1.0, own, own, own};
          v[field] = value;
          try_out({RobotIndex(0), MoveCommand{1, kind, v[0], v[1], v[2], v[3], v[4]}},
                  "primitive " + std::to_string(kind) + " field " + std::to_string(field) + " " +
                      ::testing::PrintToString(value));
        }
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Robots, ExtremeCommands,
                         ::testing::Values("p3at", "turtle", "car", "tricycle", "mecanum", "omni",
                                           "carrier", "crawler", "puck", "wheels"),
                         [](const auto& info) { return info.param; });

}  // namespace
}  // namespace ruedo::robot::testing
