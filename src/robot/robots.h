// Executes the robots' commands: takes them at step boundaries, runs drives and motion primitives,
// moves the bodies. Owned by the kinematics module; not thread-safe.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "physics/physics_world.h"
#include "ruedo/snapshot.h"
#include "ruedo/state_archive.h"
#include "world/model/body_layout.h"

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
  double share = 1.0;  // of the speed that would be used: what weak motors leave
};
struct JointCommand {
  std::vector<std::string> names;
  std::vector<int8_t> modes;
  std::vector<double> values;
};
struct ResetOdometry {};

// A command with a known robot that passed the checks of size and fingerprint; its values are not
// checked yet.
struct Command {
  RobotIndex robot;
  std::variant<VelocityCommand, WheelCommand, MoveCommand, JointCommand, ResetOdometry> what;
};

// Throws InputError for a <ruedo:path> or trajectory with waypoints that are not numbers, or with
// times that do not increase.
void check_path(const Element& path);

class Robots {
 public:
  // The arguments must outlive it. seed: for the people of crowds.
  Robots(const world::WorldModel& world, const world::BodyLayout& layout,
         physics::PhysicsWorld& physics, uint64_t seed = 1);
  ~Robots();

  // Takes effect on the current state: at the beginning of the next step. Invalid values refuse the
  // command.
  void apply(const Command& command);

  // One step: drives before, physics.step(), drives after.
  void step();

  // Writes the whole state: physics.read(), and the state of robots.
  void read(Snapshot& snapshot) const;

  int64_t current_step() const;

  // Between two steps: takes the state of another copy of the same world, after the physics has
  // done so. Throws InputError for a plugin's drive that cannot be copied.
  void copy_from(const Robots& other);
  // Writes that state, or reads it, likewise. Throws ArchiveError for a plugin's drive.
  void exchange(StateArchive& archive);

  // From the next step on, people and wind draw from that seed.
  void reseed(uint64_t seed);

  // Changes between two steps; instance is an index into WorldModel::models.
  void add(InstanceIndex instance);               // physics and layout have it already
  void remove(InstanceIndex instance);            // physics has removed it already
  Pose model_pose(InstanceIndex instance) const;  // X_WM, of a movable model
  // Places a model, at rest: joint positions and odometry are kept, its current motion ends.
  void set_pose(InstanceIndex instance, const Pose& X_WM);
  void set_twist(InstanceIndex instance,
                 const Twist& twist);  // of the model's frame, expressed in the world
  void reset(InstanceIndex instance);  // back to its start, at rest
  SimTime set_time_to_zero();          // without motion; returns the time before

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ruedo::robot
