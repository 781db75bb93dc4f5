// A model that follows waypoints (<ruedo:path>, or an actor's trajectory), whatever it meets.
#pragma once

#include <vector>

#include "physics/physics_world.h"
#include "ruedo/bound.h"
#include "ruedo/state_archive.h"
#include "world/model/body_layout.h"

namespace ruedo::robot {

class Mover {
 public:
  // Whether a model has one.
  static bool moves(const world::Model& model) {
    return model.path && model.path->name == "ruedo:path";
  }
  // Throws InputError for waypoints that are not numbers, or with times that do not increase.
  Mover(const world::WorldModel& world, const world::BodyLayout& layout,
        physics::PhysicsWorld& physics, InstanceIndex instance);

  // The model's pose in the world at a time: linear between waypoints, with slerp for rotations.
  // Before the first waypoint it is there already; after the last it stays there, or starts over in
  // a loop.
  Pose pose_at(SimTime time) const;

  InstanceIndex instance() const { return instance_; }
  // Starts the path at that sim time.
  void reset(SimTime now);
  void shift_time(SimTime us) { offset_ += us; }  // sim time was set back; the path continues

  // Moves its bodies to their poses one step later.
  void before_step(SimTime now);
  void exchange(StateArchive& archive) { archive(offset_); }

  struct Waypoint {
    SimTime time;
    Pose X_WM;
  };
  struct Path {
    bool loop = true;
    std::vector<Waypoint> waypoints;
  };
  // Throws InputError for waypoints that are not numbers, or with times that do not increase.
  static Path read(const Element& path);

 private:
  struct Part {
    BodyIndex body;
    Pose X_MB;
  };

  Bound<physics::PhysicsWorld> physics_;
  InstanceIndex instance_;
  int64_t step_us_;
  SimTime offset_ = 0;  // path time minus sim time
  Path path_;
  std::vector<Part> parts_;
};

}  // namespace ruedo::robot
