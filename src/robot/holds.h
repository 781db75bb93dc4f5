// Detachable joints: what a model holds of other models, by name, until it is told to let go.
//
// They are closed at the start, where both models stand then; a model that comes later is held
// where it is as it comes. Not thread safe: the kinematics module owns it.
#pragma once

#include <string>
#include <vector>

#include "model/body_layout.h"
#include "physics/physics_world.h"
#include "ruedo/bound.h"

namespace ruedo::robot {

class Holds {
 public:
  // All must outlive it.
  Holds(const model::WorldModel& world, const model::BodyLayout& layout,
        physics::PhysicsWorld& physics);

  bool has(InstanceIndex instance, const std::string& name) const;
  // Takes hold where both are now, or lets go, at the beginning of the next step.
  void set(InstanceIndex instance, const std::string& name, bool attached);
  void before_step();

  // Changes between two steps.
  void start(InstanceIndex instance);   // its holds are as at the start
  void forget(InstanceIndex instance);  // its holds are open
  void moved(InstanceIndex instance);   // others that hold it do so where it is now
  // What it holds, and what that holds.
  std::vector<InstanceIndex> carried_by(InstanceIndex instance) const;

 private:
  struct Held {
    InstanceIndex instance;
    const model::Hold* description;
    bool wanted = true;
    InstanceIndex other = {};    // that is held
    physics::TieIndex tie = {};  // none until it is closed for the first time
  };

  InstanceIndex find(const std::string& name) const;
  LinkIndex link_of(InstanceIndex instance, const std::string& name) const;
  void close(Held& held);
  void open(Held& held);
  bool is_closed(const Held& held) const;

  Bound<const model::WorldModel> world_;
  Bound<const model::BodyLayout> layout_;
  Bound<physics::PhysicsWorld> physics_;
  std::vector<Held> held_;
};

}  // namespace ruedo::robot
