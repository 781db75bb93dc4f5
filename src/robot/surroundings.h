// Things that move on their own: conveyor belts (<ruedo:belt>), and doors that open when a robot or
// a person comes near (<ruedo:door>).
#pragma once

#include <vector>

#include "physics/physics_world.h"
#include "ruedo/bound.h"
#include "ruedo/state_archive.h"
#include "world/model/body_layout.h"

namespace ruedo::robot {

// Throws InputError for a <ruedo:belt> or <ruedo:door> that cannot be read.
void check_belt(const Element& belt);
void check_door(const Element& door);

class Surroundings {
 public:
  Surroundings(const world::WorldModel& world, const world::BodyLayout& layout,
               physics::PhysicsWorld& physics);

  void before_step(SimTime now);

  void add(InstanceIndex instance);
  void remove(InstanceIndex instance);
  void reset(InstanceIndex instance);
  void shift_time(SimTime us);  // sim time was set back by that much
  void exchange(StateArchive& archive) {
    for (Door& door : doors_) archive(door.open, door.wanted);
  }

 private:
  struct Part {
    BodyIndex body;
    Pose X_MB;
  };
  // Stays in place, with a moving surface.
  struct Belt {
    InstanceIndex instance;
    std::vector<Part> parts;
    Pose X_WM;
    Vec3 velocity;  // m/s, in the world
  };
  // Moves between its pose in the file and X_MOpen.
  struct Door {
    InstanceIndex instance;
    std::vector<Part> parts;
    Pose X_WM, X_MOpen;
    double opening_s, distance_m;
    SimTime hold_us;
    double open = 0.0;    // 0 to 1
    SimTime wanted = -1;  // when somebody was last near; -1: never
    Pose pose() const;
  };
  std::vector<Part> parts_of(InstanceIndex instance) const;
  bool is_near(const Door& door) const;
  void guide(const std::vector<Part>& parts, const Pose& X_WM);

  Bound<const world::WorldModel> world_;
  Bound<const world::BodyLayout> layout_;
  Bound<physics::PhysicsWorld> physics_;
  double step_s_;
  std::vector<Belt> belts_;
  std::vector<Door> doors_;
};

}  // namespace ruedo::robot
