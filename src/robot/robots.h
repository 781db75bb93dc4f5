// The robots' execution layer: takes commands at step boundaries, runs drives and motion
// primitives, moves the bodies. Belongs to the kinematics module; not thread safe.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "model/body_layout.h"
#include "physics/physics_world.h"
#include "ruedo/snapshot.h"

namespace ruedo::robot {

struct VelocityCommand {
  double vx, vy, omega;
};
struct WheelCommand {
  std::vector<double> rates;
};
struct MoveCommand {
  int64_t id;
  int8_t kind;
  double value, radius, speed, acceleration, deceleration;
};
struct JointCommand {
  std::vector<std::string> names;
  std::vector<int8_t> modes;
  std::vector<double> values;
};
struct ResetOdometry {};

// A command that has a robot and passed the checks of size and fingerprint; its values are not
// checked yet.
struct Command {
  RobotIndex robot;
  std::variant<VelocityCommand, WheelCommand, MoveCommand, JointCommand, ResetOdometry> what;
};

// Throws InputError for a <ruedo:path> or trajectory with waypoints that are not numbers, or whose
// times do not grow.
void check_path(const Element& path);

class Robots {
 public:
  // All must outlive it. seed: of what people of crowds do.
  Robots(const model::WorldModel& world, const model::BodyLayout& layout,
         physics::PhysicsWorld& physics, uint64_t seed = 1);
  ~Robots();

  // Takes effect on the current state: at the beginning of the next step. Bad values refuse the
  // command.
  void apply(const Command& command);

  // One step of everything: drives before, physics.step(), drives after.
  void step();

  // Writes the whole state: physics.read() and the robots' part.
  void read(Snapshot& snapshot) const;

  int64_t current_step() const;

  // Between two steps: becomes what another copy of the same world is, of whose physics this one's
  // has taken the state. Throws InputError for a plugin's drive that cannot be copied.
  void take(const Robots& other);

  // From the next step on people, and the wind, draw from that seed.
  void reseed(uint64_t seed);

  // Changes between two steps; instance is an index into WorldModel::models.
  void add(InstanceIndex instance);               // the physics has it; the layout, too
  void remove(InstanceIndex instance);            // the physics has it no more
  Pose model_pose(InstanceIndex instance) const;  // X_WM, of a model that can move
  // Puts a model there, at rest: its joints stand as they stood, what it was asked to do ends, its
  // odometry stays.
  void set_pose(InstanceIndex instance, const Pose& X_WM);
  void set_twist(InstanceIndex instance,
                 const Twist& twist);  // of the model's frame, expressed in the world
  void reset(InstanceIndex instance);  // back to where it started, at rest
  SimTime set_time_to_zero();          // nothing moves; returns what the time was

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ruedo::robot
