// Lifts that go to floors when called, and doors that open on command.
//
// A lift at rest has its doors closed. When called, it goes to the floor, opens its doors, waits,
// closes them, and goes to the next floor in the order of calls. A closing door that meets
// something movable opens again and retries later. Not thread-safe: owned by the kinematics module.
#pragma once

#include <string>
#include <vector>

#include "physics/physics_world.h"
#include "ruedo/bound.h"
#include "ruedo/state_archive.h"
#include "world/model/body_layout.h"

namespace ruedo::robot {

class Lifts {
 public:
  // The arguments must outlive it.
  Lifts(const world::WorldModel& world, const world::BodyLayout& layout,
        physics::PhysicsWorld& physics);

  // Whether the instance has a lift of that name with that floor, counted from 0; or a door.
  bool has_floor(InstanceIndex instance, const std::string& lift, double floor) const;
  bool has_door(InstanceIndex instance, const std::string& door) const;
  void call(InstanceIndex instance, const std::string& lift, int floor);
  void open(InstanceIndex instance, const std::string& door, bool open);

  // A target for a joint that has its own controller.
  struct Order {
    JointIndex joint;
    double position;  // rad or m
  };
  // Moves joints without a controller; returns new targets for the others.
  const std::vector<Order>& before_step();

  // Changes between two steps.
  void start(InstanceIndex instance);  // doors closed, no calls
  void forget(InstanceIndex instance);
  void exchange(StateArchive& archive) {
    for (Door& door : doors_) archive(door.ways, door.wanted_open, door.held_us);
    for (Lift& lift : lifts_)
      archive(lift.way, lift.doing, lift.calls, lift.floor, lift.opens, lift.waited_us);
  }

 private:
  struct Leaf {
    JointIndex joint;
    BodyIndex body;
    Vec3 axis_B, origin_B;
    bool slides;
    double closed, open;
  };
  // A joint that is moving to a target.
  struct Way {
    JointIndex joint;
    double target = 0.0;
    double rate = 0.0;  // of the trapezoidal profile
    bool told = false;
  };
  struct Door {
    InstanceIndex instance;
    const world::Door* description;
    std::vector<Leaf> leaves;
    std::vector<Way> ways;  // leaves
    bool wanted_open = false;
    int64_t held_us = 0;  // remaining time to stay open, after something was in its way
  };
  enum class Doing { nothing, closing, going, opening, waiting };
  struct Lift {
    InstanceIndex instance;
    const world::Lift* description = nullptr;
    Way way;
    Doing doing = Doing::nothing;
    std::vector<int> calls;  // floors; the first is the current target
    int floor = 0;           // the current or last floor
    bool opens = true;       // whether to open doors on arrival
    int64_t waited_us = 0;
  };

  JointIndex joint_of(InstanceIndex instance, ModelJointIndex joint) const;
  void add_door(InstanceIndex instance, const world::Door& description);
  void add_lift(InstanceIndex instance, const world::Lift& description);
  Door* find_door(InstanceIndex instance, const std::string& name);
  template <class Visit>
  void for_each_door(const Lift& lift, Visit visit);
  bool is_blocked(const Door& door) const;
  bool is_there(const Way& way, double near) const;
  bool is_at(const Door& door, bool open) const;
  void move_door(Door& door);
  void next(Lift& lift);
  void set_target(Way& way, double target);
  void move(Way& way, const std::optional<world::Trapezoid>& motion);

  Bound<const world::WorldModel> world_;
  Bound<const world::BodyLayout> layout_;
  Bound<physics::PhysicsWorld> physics_;
  int64_t step_us_;
  double step_s_;
  std::vector<Door> doors_;
  std::vector<Lift> lifts_;
  std::vector<Order> orders_;
};

}  // namespace ruedo::robot
