// Commands to a robot's joints other than wheels: position, velocity, effort. A command applies
// until the joint's next one.
//
// A joint with the PID of a Gazebo plugin gets the effort offset + p e + d (r - v) + integral, with
// v at the end of the step and e at its middle, realised as a motor with K (rate - v), K = d + p h
// / 2. This adds the damping p h / 2 to Gazebo's controller, and is stable for every step h as long
// as K is at least p h.
#pragma once

#include <string>
#include <vector>

#include "physics/physics_world.h"
#include "robot/holds.h"
#include "robot/lifts.h"
#include "robot/robots.h"
#include "ruedo/bound.h"
#include "ruedo/state_archive.h"
#include "world/model/body_layout.h"

namespace ruedo::robot {

// Mimic joints and gearboxes take no commands.
bool takes_commands(const world::Joint& joint);

class JointControl {
 public:
  JointControl(const world::WorldModel& world, const world::BodyLayout& layout,
               physics::PhysicsWorld& physics);

  // Returns a reason of motion_status_t: 0 if accepted. A refused command changes no joint: unknown
  // names or modes, values that are not finite or not allowed.
  int8_t apply(RobotIndex robot, const JointCommand& command);
  void before_step();
  // Clears commands and settings of its joints.
  void forget(InstanceIndex instance);
  void start(InstanceIndex instance);  // its joints return to what they do before any command
  Holds& holds() { return holds_; }
  void exchange(StateArchive& archive) { archive(targets_, gains_, holds_, lifts_); }

 private:
  struct Target {
    JointIndex joint;
    bool is_rate = false;   // a rate held by the joint's <...pid>; the physics holds others
    double value = 0.0;     // rad or m; rad/s or m/s
    double integral = 0.0;  // N m or N: integral part of the effort
  };
  struct Gain {
    JointIndex joint;
    double value;  // 1/s
  };

  const world::Joint& description(JointIndex joint) const;
  // invalid: no joint has that name
  JointIndex find(RobotIndex robot, const std::string& name) const;
  int8_t check(RobotIndex robot, const std::string& name, int8_t mode, double value) const;
  void tell(JointIndex joint, int8_t mode, double value);
  bool tell_others(InstanceIndex instance, const std::string& name, int8_t mode, double value);
  double gain_of(JointIndex joint) const;
  bool is_set(JointIndex joint) const;  // by a message: the gains are those of docs/world-files.md
  void set_target(JointIndex joint, int8_t mode, double value);
  void begin(JointIndex joint);
  void serve(Target& target, const world::Pid& pid) const;

  Bound<const world::WorldModel> world_;
  Bound<const world::BodyLayout> layout_;
  Bound<physics::PhysicsWorld> physics_;
  double step_s_;
  double largest_gain_;          // 1/s, of the position controller
  std::vector<Target> targets_;  // joints with position control or a PID
  Holds holds_;
  Lifts lifts_;
  std::vector<Gain> gains_;  // set by messages, overriding the file's
};

}  // namespace ruedo::robot
