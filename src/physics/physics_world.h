// The rigid-body world: Bullet in double precision behind an interface in our own types. Only this
// folder uses Bullet. Bodies are numbered as in world::BodyLayout. Not thread-safe: owned by the
// kinematics module.
//
// A kinematic robot on a horizontal ground plane has no contact pair with it: its support is
// analytic, see set_support().
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "physics/base/servo.h"
#include "ruedo/snapshot.h"
#include "ruedo/state_archive.h"
#include "world/model/body_layout.h"

namespace ruedo::physics {

// How a body is supported.
enum class Support {
  contacts,  // six degrees of freedom, contacts with everything
  plane      // moves in its plane only (x, y, world yaw); no pair with static planes
};

// Deterministic: the same calls give the same bits, and bodies that do not touch do not affect each
// other. A step is divided into equal substeps of at most 5 ms; of at most 1 ms for what joints
// connect, including wheels, and for everything that may touch it.
using TieIndex = Index<struct TieKind>;  // pairs of bodies that may be held together

class PhysicsWorld {
 public:
  // world and layout must outlive it.
  PhysicsWorld(const world::WorldModel& world, const world::BodyLayout& layout);
  ~PhysicsWorld();

  // Advances by one step of the world's length.
  void step();

  // Poses and twists of the body's frame B, expressed in the world.
  const Pose& pose(BodyIndex body) const;
  const Twist& twist(BodyIndex body) const;
  void set_pose(BodyIndex body, const Pose& X_WB);
  void set_twist(BodyIndex body, const Twist& twist);
  void set_support(BodyIndex body, Support support);

  // For the coming step only: the body starts it with `mean`, and if it touches nothing, ends
  // exactly at `X_WB`. A body with nothing near costs neither collision detection nor solver. A
  // kinematic body (a mover) ends there whatever it touches.
  void guide(BodyIndex body, const Twist& mean, const Pose& X_WB);
  // For the coming step only: the body starts it with `twist`, and Bullet computes where it ends.
  void drive(BodyIndex body, const Twist& twist);
  // Gravity of one body from now on, m/s^2, world.
  void set_gravity(BodyIndex body, const Vec3& gravity);

  // Wind during the coming steps, m/s, world. Links with <enable_wind> are pushed at their centre
  // of mass with gain * mass * (wind - velocity), if the world has the plugin (world::Wind).
  void set_wind(const Vec3& wind);

  double mass(BodyIndex body) const;              // kg
  Vec3 center_of_mass(BodyIndex body) const;      // m, world
  Eigen::Matrix3d inertia(BodyIndex body) const;  // kg m^2, about the centre of mass, world axes
  // Changes the velocity at once by an impulse in N s and an angular impulse in N m s about the
  // centre of mass, world.
  void apply_impulse(BodyIndex body, const Vec3& linear, const Vec3& angular);
  // Contacts of that body in the last step; valid until the next. The body is always `a`.
  std::span<const Contact> contacts(BodyIndex body) const;
  // The same, and places where it is about to touch, within 20 mm: these have no force and a
  // negative depth.
  std::span<const Contact> nearby(BodyIndex body) const;
  // Whether nothing is near that the body could touch.
  bool alone(BodyIndex body) const;
  void wake(BodyIndex body);
  bool may_sleep(BodyIndex body) const;  // unless its file says otherwise
  void sleep(BodyIndex body);  // immediately, with velocity 0; a contact or wake() ends it
  bool sleeping(BodyIndex body) const;

  // Motors of joints that are not wheels of a drive; numbered as BodyLayout::joints.
  double joint_position(JointIndex joint) const;  // rad or m, unwrapped; 0 at the start
  double joint_velocity(JointIndex joint) const;  // rad/s or m/s
  double joint_effort(JointIndex joint) const;    // N m or N: what its motor gave in the last step
  void drive_joint_velocity(JointIndex joint, double rate,
                            double max_effort);  // rad/s or m/s; N m or N
  void apply_joint_effort(JointIndex joint, double effort);
  // In addition to the joint's own damping and friction, and within its limits: any rate is
  // allowed; the effort ends where the joint reaches its maximum rate.
  void servo_joint(JointIndex joint, const WheelServo& servo);
  // Overrides the file's values until the joint is reset.
  void set_joint(JointIndex joint, JointSetting setting, double value);

  // A tie fixes two bodies relative to each other as they are when it is closed; without a second
  // one, to the world. Tied bodies do not touch each other. Removing an instance opens its ties.
  TieIndex make_tie(BodyIndex body, BodyIndex other);  // created open
  void close_tie(TieIndex tie);
  void open_tie(TieIndex tie);
  bool is_closed(TieIndex tie) const;

  // Wheels that are separate bodies (the wheels drive); numbered as BodyLayout::wheels. Positive
  // rolls forward.
  double wheel_angle(WheelIndex wheel) const;  // rad, unwrapped
  double wheel_rate(WheelIndex wheel) const;   // rad/s
  void drive_wheel(WheelIndex wheel, const WheelServo& servo);

  // Between two steps: takes the state of another copy of the same world, with the same WorldModel
  // and BodyLayout; what follows is equal bit for bit. Neither may have had an instance added or
  // removed. Throws std::logic_error if Bullet's state cannot be copied.
  void copy_from(const PhysicsWorld& other);
  // The same, in bytes. Throws ArchiveError if Bullet's state cannot be written, or read.
  void exchange(StateArchive& archive);

  // Between two steps. `instance` is new at the end of the world and the layout, or was removed and
  // placed again: its bodies are at the layout's poses, at rest.
  void add(InstanceIndex instance);
  // Removes an instance: its bodies touch nothing and stay where they are. Bodies that rested on
  // it wake up.
  void remove(InstanceIndex instance);
  // Wakes a body and everything that it could touch: before and after it is moved.
  void disturb(BodyIndex body);
  // Its bodies were reset to the start: joints other than a drive's wheels are at 0, without
  // commands.
  void reset(JointIndex joint);

  // Shapes that Bullet can only approximate.
  const std::vector<Finding>& findings() const;

  // Writes poses, twists, accelerations, joints and contacts of the current state; not robots and
  // wheels.
  void read(Snapshot& snapshot) const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ruedo::physics
