// A P3-AT on an empty plane, driven step by step with its odometry, without threads: for
// experiments that act on every step's state.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "engine/fleet.h"
#include "physics/physics_world.h"
#include "robot/robots.h"
#include "ruedo/odometry_t.hpp"
#include "world/model/body_layout.h"

namespace ruedo::bench {

struct RigOptions {
  int64_t step_us = 5000;
  world::DriveDescription::Kind drive = world::DriveDescription::Kind::kinematic;
  bool limits = true;  // the P3-AT's own on speed and acceleration; false: none
  // Children of <ruedo:odometry>: ("ruedo:integrator", "arc"). It is read out at every step.
  std::vector<std::pair<std::string, std::string>> odometry;
};

class ExperimentRig {
 public:
  explicit ExperimentRig(const RigOptions& options);

  void velocity(double v, double omega) {
    robots_->apply({RobotIndex(0), robot::VelocityCommand{v, 0.0, omega}});
  }
  void step();
  // Commands a primitive and steps until it has ended; calls each() after every step. Throws
  // std::runtime_error when it ends otherwise than done, or not within five simulated minutes.
  template <class Each>
  void move(const robot::MoveCommand& command, Each&& each) {
    start(command);
    while (!moved(command.id)) {
      step();
      each();
    }
  }

  const RobotState& robot() const { return now_.robots[0]; }
  const odometry_t& odometry() const { return odometry_; }
  double time_s() const { return 1e-6 * static_cast<double>(now_.time); }
  double step_s() const { return 1e-6 * static_cast<double>(world_->step_us); }

 private:
  void start(const robot::MoveCommand& command);
  bool moved(int64_t id) const;
  void look();

  std::shared_ptr<const world::WorldModel> world_;
  std::unique_ptr<world::BodyLayout> layout_;
  std::unique_ptr<physics::PhysicsWorld> physics_;
  std::unique_ptr<robot::Robots> robots_;
  engine::Channels channels_;
  Findings findings_;
  engine::ModuleSetup module_;  // odometry's
  int channel_ = -1;            // of odometry_t
  Snapshot now_;
  Outbox out_;
  odometry_t odometry_;
  int64_t samples_ = 0;
  SimTime give_up_ = 0;
};

}  // namespace ruedo::bench
