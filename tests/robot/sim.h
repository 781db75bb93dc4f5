// A world from SDF text with its physics and robots, for tests that drive.
#pragma once

#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include <ruedo/motion_status_t.hpp>
#include <ruedo/move_command_t.hpp>

#include "physics/physics_world.h"
#include "robot/robots.h"
#include "world/load.h"

namespace ruedo::robot::testing {

// Constants of the messages with an address, which gtest's comparisons need and lcm-gen's do not
// have.
struct Status {
  static constexpr int8_t KIND_VELOCITY = motion_status_t::KIND_VELOCITY;
  static constexpr int8_t KIND_WHEELS = motion_status_t::KIND_WHEELS;
  static constexpr int8_t STATE_IDLE = motion_status_t::STATE_IDLE;
  static constexpr int8_t STATE_RUNNING = motion_status_t::STATE_RUNNING;
  static constexpr int8_t STATE_DONE = motion_status_t::STATE_DONE;
  static constexpr int8_t STATE_ENDED = motion_status_t::STATE_ENDED;
  static constexpr int8_t STATE_REFUSED = motion_status_t::STATE_REFUSED;
  static constexpr int8_t REASON_NONE = motion_status_t::REASON_NONE;
  static constexpr int8_t REASON_REPLACED = motion_status_t::REASON_REPLACED;
  static constexpr int8_t REASON_BLOCKED = motion_status_t::REASON_BLOCKED;
  static constexpr int8_t REASON_WATCHDOG = motion_status_t::REASON_WATCHDOG;
  static constexpr int8_t REASON_NOT_FINITE = motion_status_t::REASON_NOT_FINITE;
  static constexpr int8_t REASON_BAD_KIND = motion_status_t::REASON_BAD_KIND;
  static constexpr int8_t REASON_BAD_VALUE = motion_status_t::REASON_BAD_VALUE;
  static constexpr int8_t REASON_NO_DRIVE = motion_status_t::REASON_NO_DRIVE;
};
struct Move {
  static constexpr int8_t ADVANCE = move_command_t::ADVANCE;
  static constexpr int8_t ROTATE = move_command_t::ROTATE;
  static constexpr int8_t HEADING = move_command_t::HEADING;
  static constexpr int8_t ARC = move_command_t::ARC;
  static constexpr int8_t STOP = move_command_t::STOP;
};

// Numbers that upset arithmetic.
inline const std::vector<double>& extremes() {
  static const std::vector<double> values = [] {
    std::vector<double> made = {0.0, std::numeric_limits<double>::infinity(), std::nan("")};
    // The smallest number above 0, what becomes 0 when it is halved or squared, and so on up.
    for (const double size : {5e-324, 1e-323, 1e-310, 1e-200, 1e-160, 1e-100, 1e-16, 1e-9, 1e-6,
                              1.0, 1e3, 1e6, 1e16, 1e100, 1e154, 1e200, 1e308}) {
      made.push_back(size);
      made.push_back(-size);
    }
    return made;
  }();
  return values;
}

// A four-wheeled robot of 20 kg: wheel radius 0.1 m, track 0.4 m, chassis 0.5 x 0.3 x 0.15 m;
// base_link at its pose. `drive` goes into <ruedo:drive>, beside the joints.
inline std::string robot_sdf(const std::string& name, const std::string& pose,
                             const std::string& drive = "", const std::string& type = "kinematic") {
  std::string text = "<model name='" + name + "'><pose>" + pose +
                     "</pose>"
                     "<link name='base'><inertial><pose>0 0 0.12 0 0 "
                     "0</pose><mass>16</mass><inertia><ixx>0.3</ixx><iyy>0.5</iyy><izz>0.6</izz></"
                     "inertia></inertial>"
                     "<collision name='c'><pose>0 0 0.16 0 0 0</pose><geometry><box><size>0.5 0.3 "
                     "0.15</size></box></geometry></collision></link>";
  const char* const wheels[4][2] = {
      {"fl", "0.13 0.2"}, {"rl", "-0.13 0.2"}, {"fr", "0.13 -0.2"}, {"rr", "-0.13 -0.2"}};
  for (const auto& wheel : wheels) {
    const std::string w = wheel[0];
    text += "<link name='" + w + "'><pose>" + std::string(wheel[1]) +
            " 0.1 -1.5707963267948966 0 0</pose><inertial><mass>1</mass>"
            "<inertia><ixx>0.003</ixx><iyy>0.003</iyy><izz>0.005</izz></inertia></inertial>"
            "<collision "
            "name='c'><geometry><cylinder><radius>0.1</radius><length>0.06</length></cylinder></"
            "geometry></collision></link>"
            "<joint name='" +
            w + "_joint' type='continuous'><parent>base</parent><child>" + w +
            "</child><axis><xyz>0 0 1</xyz></axis></joint>";
  }
  text +=
      "<ruedo:drive type='" + type +
      "'><ruedo:left_joint>fl_joint</ruedo:left_joint><ruedo:left_joint>rl_joint</ruedo:left_joint>"
      "<ruedo:right_joint>fr_joint</ruedo:right_joint><ruedo:right_joint>rr_joint</"
      "ruedo:right_joint>" +
      drive + "</ruedo:drive></model>";
  return text;
}

inline std::string limits(double speed, double turn_rate, double acceleration, double deceleration,
                          double turn_acceleration) {
  const auto element = [](const char* name, double value) {
    return "<ruedo:" + std::string(name) + ">" + std::to_string(value) + "</ruedo:" + name + ">";
  };
  return element("max_speed", speed) + element("max_turn_rate", turn_rate) +
         element("acceleration", acceleration) + element("deceleration", deceleration) +
         element("turn_acceleration", turn_acceleration);
}

inline std::string plane_sdf() {
  return "<model name='ground'><static>true</static><link name='l'><collision "
         "name='c'><geometry><plane><normal>0 0 1</normal>"
         "<size>100 100</size></plane></geometry></collision></link></model>";
}

inline std::string box_sdf(const std::string& name, const std::string& pose,
                           const std::string& size, double mass = 0.0, double friction = 0.5) {
  const std::string m = std::to_string(mass), i = std::to_string(mass * 0.02),
                    mu = std::to_string(friction);
  return "<model name='" + name + "'><pose>" + pose + "</pose><static>" +
         (mass > 0.0 ? "false" : "true") + "</static><link name='l'>" +
         (mass > 0.0 ? "<inertial><mass>" + m + "</mass><inertia><ixx>" + i + "</ixx><iyy>" + i +
                           "</iyy><izz>" + i + "</izz></inertia></inertial>"
                     : "") +
         "<collision name='c'><geometry><box><size>" + size +
         "</size></box></geometry><surface><friction><ode><mu>" + mu + "</mu><mu2>" + mu +
         "</mu2></ode></friction></surface></collision></link></model>";
}

class Sim {
 public:
  explicit Sim(const std::string& models, int64_t step_us = 5000)
      : world(world::load_world_text(
            "<sdf version='1.9' xmlns:ruedo='https://ruedo.org'><world name='w'><gravity>0 0 "
            "-9.8</gravity><physics type='x'><max_step_size>" +
                std::to_string(static_cast<double>(step_us) * 1e-6) + "</max_step_size></physics>" +
                models + "</world></sdf>",
            "test.sdf")),
        layout(*world),
        physics(*world, layout),
        robots(*world, layout, physics) {
    robots.read(state);
  }

  void step(int64_t steps = 1) {
    for (int64_t i = 0; i < steps; ++i) robots.step();
    robots.read(state);
  }
  void run(double seconds) {
    step(static_cast<int64_t>(std::llround(seconds * 1e6)) / world->step_us);
  }
  void velocity(double v, double omega, RobotIndex robot = RobotIndex(0)) {
    robots.apply({robot, VelocityCommand{v, 0.0, omega}});
  }
  void move(int8_t kind, double value, double radius = 0, double speed = 0, double acceleration = 0,
            double deceleration = 0, RobotIndex robot = RobotIndex(0), int64_t id = 1) {
    robots.apply({robot, MoveCommand{id, kind, value, radius, speed, acceleration, deceleration}});
  }
  const RobotState& robot(int index = 0) const { return state.robots[index]; }
  Vec3 position(int index = 0) const { return robot(index).X_WBase.translation; }
  double yaw(int index = 0) const { return heading(robot(index).X_WBase.rotation); }
  int body(const std::string& name) const {
    for (size_t i = 0; i < layout.bodies.size(); ++i) {
      if (layout.bodies[i].name == name) return static_cast<int>(i);
    }
    return -1;
  }

  std::shared_ptr<const world::WorldModel> world;
  world::BodyLayout layout;
  physics::PhysicsWorld physics;
  Robots robots;
  Snapshot state;
};

}  // namespace ruedo::robot::testing
