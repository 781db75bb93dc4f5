// Commands to a robot's joints that are no wheels: position, velocity, effort. A command holds
// until the next one for that joint.
#pragma once

#include <string>
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
  // unknown names, unknown modes, numbers that are not finite or not allowed.
  int8_t apply(RobotIndex robot, const JointCommand& command);
  void before_step();
  void forget(InstanceIndex instance);  // no command holds for its joints, nor a setting

 private:
  struct Target {
    JointIndex joint;
    double position;
  };
  struct Gain {
    JointIndex joint;
    double value;  // 1/s
  };

  const model::Joint& description(JointIndex joint) const;
  JointIndex find(RobotIndex robot, const std::string& name) const;  // none of that name: invalid
  int8_t check(RobotIndex robot, const std::string& name, int8_t mode, double value) const;
  void tell(JointIndex joint, int8_t mode, double value);
  double gain_of(JointIndex joint) const;

  const model::WorldModel& world_;
  const model::BodyLayout& layout_;
  physics::PhysicsWorld& physics_;
  double largest_gain_;          // 1/s, of the position controller
  std::vector<Target> targets_;  // joints under position control
  std::vector<Gain> gains_;      // that messages have set, in place of the file's
};

}  // namespace ruedo::robot
