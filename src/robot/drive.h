// What drives have in common: a robot's motion (what it was asked to do), and what it publishes
// about itself.
#pragma once

#include <cstdint>

#include "model/body_layout.h"
#include "physics/physics_world.h"
#include "robot/motion_planner.h"
#include "robot/wheel_kinematics.h"
#include "ruedo/bound.h"
#include "ruedo/snapshot.h"

namespace ruedo::robot {

// Cosine between a contact's normal and the robot's up from which on what is touched carries the
// robot, or lies on it.
inline constexpr double kSupportNormal = 0.5;

// Writes what a robot's motion shows at this step.
void read_motion(const MotionLog& log, RobotIndex robot, Snapshot& snapshot);

class Drive {
 public:
  Drive(const model::WorldModel& world, const model::BodyLayout& layout,
        physics::PhysicsWorld& physics, RobotIndex robot);
  virtual ~Drive() = default;
  Drive(const Drive&) = delete;

  // Becomes what the same robot's drive is in another copy of the world. Throws InputError where a
  // plugin's drive cannot.
  virtual void take(const Drive& other) = 0;

  // Before and after physics.step(), which leads from sim time now to now + one step.
  virtual void before_step(SimTime now) = 0;
  virtual void after_step(SimTime now) = 0;
  // The robot's wheels, in the order of RobotPlacement::wheels.
  virtual void read_wheels(Snapshot& snapshot) const = 0;
  // A command came: what sleeps must wake.
  virtual void wake() = 0;

  MotionPlanner& planner() { return planner_; }
  // The robot's state in the snapshot, and what of its motion came to an end.
  void read(Snapshot& snapshot) const;
  // As the robot's primitives measure it: the true one, or what its odometry makes of its wheels.
  double heading_in_odom() const {
    return description_->on_odometry ? believed_heading_
                                     : wrap_angle(heading(X_WBase_.rotation) - odom_heading_);
  }
  void reset_odometry();

  // The robot was put somewhere else, at rest: the physics has it there already. Its odometry knows
  // nothing of that.
  void placed(SimTime now);
  // The level planes are others now.
  virtual void ground_changed() {}

 protected:
  Drive& operator=(const Drive&) = default;

  // Resets what the drive remembers of its motion.
  virtual void begin_at_rest() = 0;
  // base_link as the physics has it, and the twist of base_link expressed in it.
  Pose base_pose() const { return physics_->pose(body_) * X_BBase_; }
  Twist base_twist(const Pose& X_WBase) const;
  // The other way round: the twist of the body's frame B in the world.
  Twist body_twist(const Pose& X_WBase, const Twist& of_base) const;
  void set_state(const Pose& X_WBase, const Twist& twist);  // after a step
  // Tells the motion what a contact of the robot took from what it is told to do.
  void resist(const Contact& contact);

  Bound<physics::PhysicsWorld> physics_;
  RobotIndex robot_;
  BodyIndex body_;
  int64_t step_us_;
  double step_s_;
  Pose X_BBase_, X_BaseB_;
  std::vector<WheelIndex> wheels_;
  Bound<const model::DriveDescription> description_;
  MotionPlanner planner_;
  Pose X_WBase_;
  Twist twist_;                       // of base_link in base_link
  Vec3 velocity_ = Vec3::Zero();      // of base_link in the world
  Vec3 acceleration_ = Vec3::Zero();  // of base_link in base_link
  double odom_heading_ = 0.0;         // of odom in the world
  double believed_heading_ = 0.0;     // of base_link in odom, by the wheels
  int32_t resets_ = 0;
  double wheel_v_ = 0.0, wheel_omega_ = 0.0;
};

}  // namespace ruedo::robot
