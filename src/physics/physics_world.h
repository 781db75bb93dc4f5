// The rigid-body world: Bullet in double precision behind an interface of our own types. Bullet
// lives in this folder only. Bodies are numbered as in model::BodyLayout. Not thread safe: the
// kinematics module owns it.
//
// A kinematic robot on a horizontal ground plane has no contact pair with it: its support is
// analytic, see set_support().
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "model/body_layout.h"
#include "ruedo/snapshot.h"

namespace ruedo::physics {

// How a body is held up.
enum class Support {
  contacts,  // six degrees of freedom, contacts with everything
  plane      // moves in its plane only (x, y, yaw of the world); no pair with the static planes
};

// The torque (or force) that the servo of a wheel or joint gives until another one is told: gain *
// (rate - the wheel's own), within the limits. It is implicit in the step, and so stable whatever
// the gain.
struct WheelServo {
  double rate = 0.0;                                 // rad/s, positive rolls ahead
  double gain = 0.0;                                 // N m s/rad
  double lowest_torque = 0.0, highest_torque = 0.0;  // N m
};

// What messages change of a joint: N m s/rad or N s/m; N m or N; rad/s or m/s.
enum class JointSetting { rate_gain, effort, velocity };

// Deterministic: the same calls give the same bits, and what does not touch changes nothing of each
// other. A step is divided into equal substeps of 5 ms at most; of 1 ms for what joints tie
// together, wheels among them, and for all that may touch it.
using TieIndex = Index<struct TieKind>;  // of two bodies that may be held together

class PhysicsWorld {
 public:
  // world and layout must outlive it.
  PhysicsWorld(const model::WorldModel& world, const model::BodyLayout& layout);
  ~PhysicsWorld();

  // Advances by one step of the world's length.
  void step();

  // Poses and twists are of the body's frame B, expressed in the world.
  const Pose& pose(BodyIndex body) const;
  const Twist& twist(BodyIndex body) const;
  void set_pose(BodyIndex body, const Pose& X_WB);
  void set_twist(BodyIndex body, const Twist& twist);
  void set_support(BodyIndex body, Support support);

  // For the coming step only: the body starts it with `mean`, and where it touches nothing it ends
  // at `X_WB` exactly. A body with nothing near costs no collision detection and no solver. A
  // kinematic body (a mover) ends there whatever it touches.
  void guide(BodyIndex body, const Twist& mean, const Pose& X_WB);
  // For the coming step only: the body starts it with `twist`, and Bullet says where it ends.
  void drive(BodyIndex body, const Twist& twist);
  // Acceleration by gravity of one body from now on, m/s^2, world.
  void set_gravity(BodyIndex body, const Vec3& gravity);

  // Of the coming steps, m/s, world. Links with <enable_wind> are pushed in their centre of mass
  // with gain mass (wind - velocity), where the world's plugin says so (model::Wind).
  void set_wind(const Vec3& wind);

  double mass(BodyIndex body) const;              // kg
  Vec3 center_of_mass(BodyIndex body) const;      // m, world
  Eigen::Matrix3d inertia(BodyIndex body) const;  // kg m^2, about the centre of mass, world axes
  // Changes the velocity at once, by an impulse in N s and N m s about the centre of mass, world.
  void apply_impulse(BodyIndex body, const Vec3& linear, const Vec3& angular);
  // Contacts of that body in the last step; valid until the next. The body is always `a` here.
  std::span<const Contact> contacts(BodyIndex body) const;
  // The same and the places where it is about to touch, within 20 mm: these have no force and a
  // negative depth.
  std::span<const Contact> nearby(BodyIndex body) const;
  // True when no other thing is near that the body could touch.
  bool alone(BodyIndex body) const;
  void wake(BodyIndex body);
  void sleep(BodyIndex body);  // at once, with velocity 0; a contact or wake() ends it
  bool sleeping(BodyIndex body) const;

  // Motors of joints that are not wheels of a drive; joint as in BodyLayout::joints.
  double joint_position(JointIndex joint) const;  // rad or m, not wrapped; 0 at the start
  double joint_velocity(JointIndex joint) const;  // rad/s or m/s
  double joint_effort(JointIndex joint) const;    // N m or N: what its motor gave in the last step
  void drive_joint_velocity(JointIndex joint, double rate,
                            double max_effort);  // rad/s or m/s; N m or N
  void apply_joint_effort(JointIndex joint, double effort);
  // Beside the joint's own damping and friction, and within its limits: a rate may be any, the
  // effort ends where the joint is as fast as it may be.
  void servo_joint(JointIndex joint, const WheelServo& servo);
  // Instead of what the file says, until the joint is reset.
  void set_joint(JointIndex joint, JointSetting setting, double value);

  // A tie holds two bodies as they are to each other when it is closed; no other: to the world.
  // Bodies that it ties together do not touch each other. Ties go open with their instances.
  TieIndex make_tie(BodyIndex body, BodyIndex other);  // open
  void close_tie(TieIndex tie);
  void open_tie(TieIndex tie);
  bool is_closed(TieIndex tie) const;

  // Wheels that are bodies of their own (the wheels drive); wheel as in BodyLayout::wheels.
  // Positive rolls ahead.
  double wheel_angle(WheelIndex wheel) const;  // rad, not wrapped
  double wheel_rate(WheelIndex wheel) const;   // rad/s
  void drive_wheel(WheelIndex wheel, const WheelServo& servo);

  // Between two steps: becomes what another copy of the same world is, by the same WorldModel and
  // BodyLayout; what follows equals what follows there, bit for bit. Neither had an instance added
  // or removed. Throws std::logic_error where Bullet keeps what cannot be copied.
  void take(const PhysicsWorld& other);

  // Between two steps. `instance` is new at the end of the world and the layout, or was removed and
  // placed again: its bodies are where the layout has them, at rest.
  void add(InstanceIndex instance);
  // Takes an instance out: its bodies touch nothing and stay where they are. What rested on it
  // wakes.
  void remove(InstanceIndex instance);
  // Wakes a body and all that it could touch: before it is put elsewhere, and after.
  void disturb(BodyIndex body);
  // Its bodies were reset to where they started: a joint that is no wheel of a drive is at 0,
  // and no command holds.
  void reset(JointIndex joint);

  // Shapes that Bullet can only approximate.
  const std::vector<Finding>& findings() const;

  // Writes poses, twists, accelerations, joints and contacts (not robots and wheels) of the current
  // state.
  void read(Snapshot& snapshot) const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ruedo::physics
