// The rigid-body world: Bullet in double precision behind an interface of our own types. Bullet lives in this
// folder only. Bodies are numbered as in model::BodyLayout. Not thread safe: the kinematics module owns it.
//
// A kinematic robot on a horizontal ground plane has no contact pair with it: its support is analytic, see
// set_support().
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "model/body_layout.h"
#include "ruedo/snapshot.h"

namespace ruedo::physics {

// How a body is held up.
enum class Support {
  contacts,    // six degrees of freedom, contacts with everything
  plane        // moves in its plane only (x, y, yaw of the world); no pair with the static planes
};

class PhysicsWorld {
 public:
  // world and layout must outlive it.
  PhysicsWorld(const model::WorldModel& world, const model::BodyLayout& layout);
  ~PhysicsWorld();

  // Advances by one step of the world's length.
  void step();

  // Poses and twists are of the body's frame B, expressed in the world.
  Pose pose(int body) const;
  Twist twist(int body) const;
  void set_pose(int body, const Pose& X_WB);
  void set_twist(int body, const Twist& twist);
  void set_support(int body, Support support);

  double mass(int body) const;                  // kg
  Vec3 center_of_mass(int body) const;          // m, world
  // Changes the velocity at once, by an impulse in N s and N m s about the centre of mass, world.
  void apply_impulse(int body, const Vec3& linear, const Vec3& angular);
  // Contacts of that body in the last step; valid until the next. The body is always `a` here.
  std::span<const Contact> contacts(int body) const;
  void wake(int body);
  bool sleeping(int body) const;

  // Motors of joints that are not wheels of a kinematic drive; joint as in BodyLayout::joints.
  double joint_position(int joint) const;
  double joint_velocity(int joint) const;
  double joint_effort(int joint) const;
  void drive_joint_velocity(int joint, double rate, double max_effort);    // rad/s or m/s; N m or N
  void apply_joint_effort(int joint, double effort);

  // Writes poses, twists, accelerations, joints and contacts (not robots and wheels) of the current state.
  void read(Snapshot& snapshot) const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ruedo::physics
