// Lifts that go to the floors that they are called to, and doors that open when they are told.
//
// A lift at rest has its doors closed. Called, it goes to the floor, opens its doors there, waits,
// closes them, and goes to the next floor that was called, in the order of the calls. A door that
// meets something that can move while it closes opens again, and tries later. Not thread safe: the
// kinematics module owns it.
#pragma once

#include <string>
#include <vector>

#include "model/body_layout.h"
#include "physics/physics_world.h"
#include "ruedo/bound.h"

namespace ruedo::robot {

class Lifts {
 public:
  // All must outlive it.
  Lifts(const model::WorldModel& world, const model::BodyLayout& layout,
        physics::PhysicsWorld& physics);

  // Whether the instance has a lift of that name with that floor, from 0; or a door.
  bool has_floor(InstanceIndex instance, const std::string& lift, double floor) const;
  bool has_door(InstanceIndex instance, const std::string& door) const;
  void call(InstanceIndex instance, const std::string& lift, int floor);
  void open(InstanceIndex instance, const std::string& door, bool open);

  // Where a joint is to go whose own controller takes it there.
  struct Order {
    JointIndex joint;
    double position;  // rad or m
  };
  // Moves the others; returns what is new for these.
  const std::vector<Order>& before_step();

  // Changes between two steps.
  void start(InstanceIndex instance);  // doors are closed, nobody has called
  void forget(InstanceIndex instance);

 private:
  struct Leaf {
    JointIndex joint;
    BodyIndex body;
    Vec3 axis_B, origin_B;
    bool slides;
    double closed, open;
  };
  // A joint that goes somewhere.
  struct Way {
    JointIndex joint;
    double target = 0.0;
    double rate = 0.0;  // of the trapezoid
    bool told = false;
  };
  struct Door {
    InstanceIndex instance;
    const model::Door* description;
    std::vector<Leaf> leaves;
    std::vector<Way> ways;  // as leaves
    bool wanted_open = false;
    int64_t held_us = 0;  // it stays open for so long: something was in its way
  };
  enum class Doing { nothing, closing, going, opening, waiting };
  struct Lift {
    InstanceIndex instance;
    const model::Lift* description = nullptr;
    Way way;
    Doing doing = Doing::nothing;
    std::vector<int> calls;  // floors; the first is where it goes
    int floor = 0;           // where it is, or was last
    bool opens = true;       // where it comes to
    int64_t waited_us = 0;
  };

  JointIndex joint_of(InstanceIndex instance, ModelJointIndex joint) const;
  void add_door(InstanceIndex instance, const model::Door& description);
  void add_lift(InstanceIndex instance, const model::Lift& description);
  Door* find_door(InstanceIndex instance, const std::string& name);
  template <class Visit>
  void for_each_door(const Lift& lift, Visit visit);
  bool is_blocked(const Door& door) const;
  bool is_there(const Way& way, double near) const;
  bool is_at(const Door& door, bool open) const;
  void move_door(Door& door);
  void move_lift(Lift& lift);
  void next(Lift& lift);
  void set_target(Way& way, double target);
  void move(Way& way, const std::optional<model::Trapezoid>& motion);

  Bound<const model::WorldModel> world_;
  Bound<const model::BodyLayout> layout_;
  Bound<physics::PhysicsWorld> physics_;
  int64_t step_us_;
  double step_s_;
  std::vector<Door> doors_;
  std::vector<Lift> lifts_;
  std::vector<Order> orders_;
};

}  // namespace ruedo::robot
