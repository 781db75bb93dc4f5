// Detachable joints: a model holds other models, by name, until a command releases them.
//
// They are closed at the start, with both models where they are then; a model that arrives later is
// held where it arrives. Not thread-safe: owned by the kinematics module.
#pragma once

#include <string>
#include <vector>

#include "physics/physics_world.h"
#include "ruedo/bound.h"
#include "ruedo/state_archive.h"
#include "world/model/body_layout.h"

namespace ruedo::robot {

class Holds {
 public:
  // The arguments must outlive it.
  Holds(const world::WorldModel& world, const world::BodyLayout& layout,
        physics::PhysicsWorld& physics);

  bool has(InstanceIndex instance, const std::string& name) const;
  // Holds both where they are, or releases, at the beginning of the next step.
  void set(InstanceIndex instance, const std::string& name, bool attached);
  void before_step();

  // Changes between two steps.
  void start(InstanceIndex instance);   // resets its holds to those at the start
  void forget(InstanceIndex instance);  // its holds are open
  void moved(InstanceIndex instance);   // others keep holding it, where it is now
  // The instances that it holds, directly or indirectly.
  std::vector<InstanceIndex> carried_by(InstanceIndex instance) const;
  void exchange(StateArchive& archive) {
    for (Held& held : held_) archive(held.wanted, held.other, held.tie);
  }

 private:
  struct Held {
    InstanceIndex instance;
    const world::Hold* description;
    bool wanted = true;
    InstanceIndex other = {};    // the one held
    physics::TieIndex tie = {};  // none until first closed
  };

  InstanceIndex find(const std::string& name) const;
  LinkIndex link_of(InstanceIndex instance, const std::string& name) const;
  void close(Held& held);
  void open(Held& held);
  bool is_closed(const Held& held) const;

  Bound<const world::WorldModel> world_;
  Bound<const world::BodyLayout> layout_;
  Bound<physics::PhysicsWorld> physics_;
  std::vector<Held> held_;
};

}  // namespace ruedo::robot
