// People who walk to their goals and around each other, walls and robots: <ruedo:crowd>.
//
// The social force model: each person comes to the speed that he likes, towards his goal, within
// 0.5 s. Other people and walls keep him away, press and slow him by the forces of D. Helbing,
// I. Farkas and T. Vicsek, "Simulating dynamical features of escape panic", Nature 407 (2000) 487
// (eqs. 1 to 3), divided by their 80 kg; robots and other things by those of D. Helbing and
// P. Molnar, "Social force model for pedestrian dynamics", Phys. Rev. E 51 (1995) 4282 (eqs. 3, 4
// and 8), by which he looks ahead by the way that they make in 2 s and sees half as much of what is
// behind him. The ways around walls are the shortest, over cells; what stands in the way is gone
// around. People push things as a moving wall would, and are pushed by nothing.
//
// They think every 10 ms of simulated time, whatever the step is, all from the same state and in
// the order of the world: the same bytes for one seed, whatever else is computed beside them.
#pragma once

#include <memory>
#include <vector>

#include "model/crowd.h"
#include "physics/physics_world.h"
#include "ruedo/bound.h"
#include "ruedo/random.h"

namespace ruedo::robot {

class Crowd {
 public:
  // All people of the world. They are put where the seed has them.
  Crowd(const model::WorldModel& world, const model::BodyLayout& layout,
        physics::PhysicsWorld& physics, uint64_t seed);
  ~Crowd();

  // Sends them to where they are one step later.
  void before_step(SimTime now);

  void add(InstanceIndex instance, const model::BodyLayout& layout);  // what they see from now on
  void remove(InstanceIndex instance);
  void take(const Crowd& other);  // becomes what it is in another copy of the world
  void reseed(uint64_t seed);     // what people choose from now on
  void reset(InstanceIndex instance, SimTime now);
  void shift_time(SimTime us) { thought_ -= us; }  // sim time went back by so much

 private:
  using Vec2 = model::Vec2;
  struct Group;  // a <ruedo:crowd>
  struct Person;
  struct Other;  // a body that moves and is no person of a crowd
  struct Push;   // of a tick

  void gather(const model::BodyLayout& layout);
  void add_other(const model::BodyLayout& layout, BodyIndex body);
  void add_person(const model::BodyLayout& layout, BodyIndex body);
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

  Bound<const model::WorldModel> world_;
  Bound<physics::PhysicsWorld> physics_;
  uint64_t seed_;
  int64_t step_us_;
  SimTime thought_ = 0;  // the people's own states are of this time and of one tick before
  std::vector<std::unique_ptr<Group>> groups_;
  std::vector<Person> people_;
  std::vector<Other> others_;
  std::vector<std::vector<int>> cells_;  // people by where they are, in their order
  Vec2 cells_from_ = Vec2::Zero();
  int columns_ = 1, rows_ = 1;
};

}  // namespace ruedo::robot
