// Commands to a robot's joints that are no wheels: position, velocity, effort. A command holds
// until the next one for that joint.
#pragma once

#include <vector>

#include "model/body_layout.h"
#include "physics/physics_world.h"
#include "robot/robots.h"

namespace ruedo::robot {

class JointControl {
 public:
  JointControl(const model::WorldModel& world, const model::BodyLayout& layout,
               physics::PhysicsWorld& physics);

  // Returns a reason of motion_status_t: 0 for accepted. A refused command changes no joint:
  // unknown names, unknown modes, numbers that are not finite.
  int8_t apply(int robot, const JointCommand& command);
  void before_step();
  void forget(int instance);  // no command holds for its joints

 private:
  struct Target {
    int joint;  // index into BodyLayout::joints
    double position;
    double gain;  // 1/s
  };

  const model::WorldModel& world_;
  const model::BodyLayout& layout_;
  physics::PhysicsWorld& physics_;
  double largest_gain_;          // 1/s, of the position controller
  std::vector<Target> targets_;  // joints under position control
};

}  // namespace ruedo::robot
