// People who walk to their goals, avoiding each other, walls and robots: <ruedo:crowd>.
//
// The social force model. A person approaches the preferred velocity towards the goal with a time
// constant of 0.5 s. Other people and walls repel, press and slow down by the forces of D. Helbing,
// I. Farkas and T. Vicsek, "Simulating dynamical features of escape panic", Nature 407 (2000) 487
// (eqs. 1 to 3), divided by their 80 kg; robots and other things by those of D. Helbing and P.
// Molnar, "Social force model for pedestrian dynamics", Phys. Rev. E 51 (1995) 4282 (eqs. 3, 4 and
// 8), with a look-ahead of 2 s and half the weight for things behind. Paths around walls are the
// shortest over cells; obstacles on them are walked around. People push things like a moving wall,
// and cannot be pushed.
//
// They are updated every 10 ms of sim time, whatever the step, all from the same state and in world
// order: the same bytes for a seed, whatever else is computed.
#pragma once

#include <memory>
#include <vector>

#include "physics/physics_world.h"
#include "ruedo/bound.h"
#include "ruedo/random.h"
#include "ruedo/state_archive.h"
#include "world/sdf/crowd.h"

namespace ruedo::robot {

class Crowd {
 public:
  // All people of the world. Their start places depend on the seed.
  Crowd(const world::WorldModel& world, const world::BodyLayout& layout,
        physics::PhysicsWorld& physics, uint64_t seed);
  ~Crowd();

  // Moves them to their places one step later.
  void before_step(SimTime now);

  // what they react to from now on
  void add(InstanceIndex instance, const world::BodyLayout& layout);
  void remove(InstanceIndex instance);
  void copy_from(const Crowd& other);  // takes the state of another copy of the world
  void exchange(StateArchive& archive);
  void reseed(uint64_t seed);  // for people's choices from now on
  void reset(InstanceIndex instance, SimTime now);
  void shift_time(SimTime us) { thought_ -= us; }  // sim time was set back by that much

 private:
  using Vec2 = world::Vec2;
  struct Group;  // a <ruedo:crowd>
  struct Person;
  struct Other;  // a moving body other than a crowd's person

  void gather(const world::BodyLayout& layout);
  void add_other(const world::BodyLayout& layout, BodyIndex body);
  void add_person(const world::BodyLayout& layout, BodyIndex body);
  void begin(Person& person);
  void put(Person& person, const Vec2& at);
  void think();
  void see_others();
  void sort_into_cells();
  Vec2 force_on(const Person& person, size_t index) const;
  Vec2 of_people(const Person& person, size_t index) const;
  Vec2 of_others(const Person& person, const Vec2& ahead) const;
  Vec2 of_walls(const Person& person) const;
  void choose_goal(Person& person);
  void look_for_way(Person& person);
  void go_around_what_stands(Person& person) const;
  bool come_again(Person& person);

  Bound<const world::WorldModel> world_;
  Bound<physics::PhysicsWorld> physics_;
  uint64_t seed_;
  int64_t step_us_;
  SimTime thought_ = 0;  // the time of the people's own states, one tick after those before
  std::vector<std::unique_ptr<Group>> groups_;
  std::vector<Person> people_;
  std::vector<Other> others_;
  std::vector<std::vector<int>> cells_;  // the people in each cell of a grid, in their order
  Vec2 cells_from_ = Vec2::Zero();
  int columns_ = 1, rows_ = 1;
};

}  // namespace ruedo::robot
