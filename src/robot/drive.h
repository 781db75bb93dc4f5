// The common part of all drives: a robot's motion (what it was commanded to do), and what it
// publishes about itself.
#pragma once

#include <cstdint>

#include "physics/physics_world.h"
#include "robot/motion_planner.h"
#include "robot/wheel_kinematics.h"
#include "ruedo/bound.h"
#include "ruedo/snapshot.h"
#include "ruedo/state_archive.h"
#include "world/model/body_layout.h"

namespace ruedo::robot {

// Cosine of the largest angle between a contact normal and the robot's up axis at which the other
// thing supports the robot, or rests on it.
inline constexpr double kSupportNormal = 0.5;

// Writes the status of a robot's motion at this step.
void read_motion(const MotionLog& log, RobotIndex robot, Snapshot& snapshot);

class Drive {
 public:
  Drive(const world::WorldModel& world, const world::BodyLayout& layout,
        physics::PhysicsWorld& physics, RobotIndex robot);
  virtual ~Drive() = default;
  Drive(const Drive&) = delete;

  // Takes the state of the drive of the same robot in another copy of the world. Throws InputError
  // if a plugin's drive does not support that.
  virtual void copy_from(const Drive& other) = 0;
  // Writes what changes, or reads it. Throws ArchiveError for a plugin's drive.
  virtual void exchange(StateArchive& archive);

  // Before and after physics.step(), which advances from sim time `now` by one step.
  virtual void before_step(SimTime now) = 0;
  virtual void after_step(SimTime now) = 0;
  // The robot's wheels, as in RobotPlacement::wheels.
  virtual void read_wheels(Snapshot& snapshot) const = 0;
  // A command has arrived: what sleeps has to wake up.
  virtual void wake() = 0;

  MotionPlanner& planner() { return planner_; }
  // The robot's state in the snapshot, and the motions that have ended.
  void read(Snapshot& snapshot) const;
  // The pose by which primitives are measured: the true one, or that of its wheel odometry.
  double heading_in_odom() const {
    return description_->on_odometry ? believed_heading_
                                     : wrap_angle(heading(X_WBase_.rotation) - odom_heading_);
  }
  void reset_odometry();

  // The robot was placed somewhere else, at rest; the physics has moved it already. Its odometry
  // does not notice.
  void placed(SimTime now);
  // The level planes have changed.
  virtual void ground_changed() {}

 protected:
  Drive& operator=(const Drive&) = default;

  // Clears the drive's motion state.
  virtual void begin_at_rest() = 0;
  // base_link's pose in the physics, and its twist, expressed in base_link.
  Pose base_pose() const { return physics_->pose(body_) * X_BBase_; }
  Twist base_twist(const Pose& X_WBase) const;
  // The reverse: the twist of the body's frame B, in the world.
  Twist body_twist(const Pose& X_WBase, const Twist& of_base) const;
  void set_state(const Pose& X_WBase, const Twist& twist);  // after a step
  // Tells the motion planner which resistance the robot's contacts offered.
  void resist(const Contact& contact);

  Bound<physics::PhysicsWorld> physics_;
  RobotIndex robot_;
  BodyIndex body_;
  int64_t step_us_;
  double step_s_;
  Pose X_BBase_, X_BaseB_;
  std::vector<WheelIndex> wheels_;
  Bound<const world::DriveDescription> description_;
  MotionPlanner planner_;
  Pose X_WBase_;
  Twist twist_;                       // of base_link in base_link
  Vec3 velocity_ = Vec3::Zero();      // of base_link in the world
  Vec3 acceleration_ = Vec3::Zero();  // of base_link, expressed in base_link
  double odom_heading_ = 0.0;         // of odom in the world
  double believed_heading_ = 0.0;     // of base_link in odom, by the wheels
  int32_t resets_ = 0;
  double wheel_v_ = 0.0, wheel_omega_ = 0.0;
};

}  // namespace ruedo::robot
