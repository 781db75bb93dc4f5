// The state machines of lifts and doors.
#include "robot/lifts.h"

#include <algorithm>
#include <cmath>

namespace ruedo::robot {

namespace {

// Tolerances for having arrived. A cabin with a controller without an integral part stays a little
// below its floor.
constexpr double kCabinNear_m = 0.15, kDoorNear = 0.05, kStands = 0.01;
// cosine between a leaf's motion and a contact's direction above which the leaf is blocked
constexpr double kAgainst = 0.5;
constexpr int64_t kTryAgain_us = 2'000'000;  // time until a blocked door tries to close again

}  // namespace

Lifts::Lifts(const world::WorldModel& world, const world::BodyLayout& layout,
             physics::PhysicsWorld& physics)
    : world_(world),
      layout_(layout),
      physics_(physics),
      step_us_(world.step_us),
      step_s_(static_cast<double>(world.step_us) * 1e-6) {
  for (const InstanceIndex instance : world.models.indices()) start(instance);
}

JointIndex Lifts::joint_of(InstanceIndex instance, ModelJointIndex joint) const {
  for (const JointIndex i : layout_->joints.indices()) {
    if (layout_->joints[i].instance == instance && layout_->joints[i].joint == joint) return i;
  }
  return {};  // both ends are static
}

void Lifts::add_door(InstanceIndex instance, const world::Door& description) {
  const world::Model& model = *world_->models[instance].model;
  Door door{instance, &description, {}, {}};
  for (const world::Door::Leaf& leaf : description.leaves) {
    if (!leaf.joint.valid()) continue;
    const JointIndex index = joint_of(instance, leaf.joint);
    if (!index.valid()) continue;
    const world::Joint& joint = model.joints[leaf.joint];
    const world::LinkPlacement& link = layout_->links[layout_->link_of(instance, joint.child)];
    if (!link.body.valid()) continue;  // it is static, and what it hangs on moves
    const Pose X_BJ = link.X_BL * model.links[joint.child].X_ML.inverse() * joint.X_MJ;
    door.leaves.push_back({index, link.body, X_BJ.rotation * joint.axis.axis_in_J, X_BJ.translation,
                           joint.type == world::JointType::prismatic, leaf.closed, leaf.open});
    door.ways.push_back({index, leaf.closed});
  }
  doors_.push_back(std::move(door));
}

void Lifts::add_lift(InstanceIndex instance, const world::Lift& description) {
  const JointIndex joint = joint_of(instance, description.cabin);
  if (!joint.valid()) return;
  Lift lift;
  lift.instance = instance;
  lift.description = &description;
  lift.way = {joint, physics_->joint_position(joint)};
  if (description.initial_floor) {
    lift.calls = {*description.initial_floor};
    lift.opens = false;
    lift.doing = Doing::closing;
  }
  lifts_.push_back(std::move(lift));
}

void Lifts::start(InstanceIndex instance) {
  forget(instance);
  const world::ModelInstance& placed = world_->models[instance];
  if (placed.removed || placed.model->is_static) return;
  for (const world::Door& door : placed.model->doors) add_door(instance, door);
  for (const world::Lift& lift : placed.model->lifts) add_lift(instance, lift);
}

void Lifts::forget(InstanceIndex instance) {
  const auto of_it = [instance](const auto& each) { return each.instance == instance; };
  std::erase_if(doors_, of_it);
  std::erase_if(lifts_, of_it);
}

bool Lifts::has_floor(InstanceIndex instance, const std::string& name, double floor) const {
  return std::any_of(lifts_.begin(), lifts_.end(), [&](const Lift& lift) {
    return lift.instance == instance && lift.description->name == name && floor >= 0.0 &&
           floor < static_cast<double>(lift.description->floors.size()) &&
           floor == std::floor(floor);
  });
}

bool Lifts::has_door(InstanceIndex instance, const std::string& name) const {
  return std::any_of(doors_.begin(), doors_.end(), [&](const Door& door) {
    return door.instance == instance && door.description->name == name;
  });
}

void Lifts::call(InstanceIndex instance, const std::string& name, int floor) {
  for (Lift& lift : lifts_) {
    if (lift.instance != instance || lift.description->name != name) continue;
    if (std::find(lift.calls.begin(), lift.calls.end(), floor) != lift.calls.end()) return;
    if (lift.doing == Doing::waiting && lift.floor == floor) {
      lift.waited_us = 0;
      return;
    }
    lift.calls.push_back(floor);
  }
}

void Lifts::open(InstanceIndex instance, const std::string& name, bool open) {
  for (Door& door : doors_) {
    if (door.instance == instance && door.description->name == name) door.wanted_open = open;
  }
}

Lifts::Door* Lifts::find_door(InstanceIndex instance, const std::string& name) {
  Door* found = nullptr;
  for (Door& door : doors_) {
    if (door.description->name != name) continue;
    if (door.instance == instance) return &door;
    if (!found) found = &door;
  }
  return found;
}

template <class Visit>
void Lifts::for_each_door(const Lift& lift, Visit visit) {
  for (const std::string& name : lift.description->floors[lift.floor].doors) {
    if (Door* door = find_door(lift.instance, name)) visit(*door);
  }
}

// Whether something movable of another model is in the way of a leaf.
bool Lifts::is_blocked(const Door& door) const {
  for (const Leaf& leaf : door.leaves) {
    const Pose& X_WB = physics_->pose(leaf.body);
    const Vec3 axis = X_WB.rotation * leaf.axis_B;
    for (const Contact& contact : physics_->contacts(leaf.body)) {
      if (!contact.body_b.valid() || layout_->bodies[contact.body_b].instance == door.instance)
        continue;
      Vec3 way = leaf.slides ? axis : axis.cross(contact.position - X_WB * leaf.origin_B);
      if (leaf.closed < leaf.open) way = -way;
      if (-contact.normal.dot(way.normalized()) > kAgainst) return true;
    }
  }
  return false;
}

bool Lifts::is_there(const Way& way, double near) const {
  return std::abs(way.target - physics_->joint_position(way.joint)) < near &&
         std::abs(physics_->joint_velocity(way.joint)) < kStands;
}

bool Lifts::is_at(const Door& door, bool open) const {
  for (size_t i = 0; i < door.leaves.size(); ++i) {
    const double wanted = open ? door.leaves[i].open : door.leaves[i].closed;
    if (door.ways[i].target != wanted || !is_there(door.ways[i], kDoorNear)) return false;
  }
  return true;
}

void Lifts::set_target(Way& way, double target) {
  if (way.told && way.target == target) return;
  way.target = target;
  way.told = false;
}

// The highest speed from which it can still brake in the remaining distance.
void Lifts::move(Way& way, const std::optional<world::Trapezoid>& motion) {
  const auto wake = [&] {
    const world::JointPlacement& joint = layout_->joints[way.joint];
    for (const BodyIndex body : {joint.parent_body, joint.child_body})
      if (body.valid()) physics_->wake(body);
  };
  if (!motion) {
    if (!way.told) {
      orders_.push_back({way.joint, way.target});
      wake();
    }
    way.told = true;
    return;
  }
  const double missing = way.target - physics_->joint_position(way.joint);
  const double far = std::abs(missing);
  const double before = std::copysign(1.0, missing) * way.rate;
  double rate = std::min({motion->rate, std::sqrt(2.0 * motion->acceleration * far),
                          std::max(before, 0.0) + motion->acceleration * step_s_, far / step_s_});
  if (far < 1e-6) rate = 0.0;
  rate = std::copysign(rate, missing);
  if (way.told && rate == way.rate) return;
  if (!way.told) wake();
  physics_->drive_joint_velocity(way.joint, rate, motion->effort);
  way.rate = rate;
  way.told = true;
}

void Lifts::move_door(Door& door) {
  door.held_us = std::max<int64_t>(0, door.held_us - step_us_);
  if (!door.wanted_open && door.held_us == 0 && !is_at(door, false) && is_blocked(door))
    door.held_us = kTryAgain_us;
  const bool open = door.wanted_open || door.held_us > 0;
  for (size_t i = 0; i < door.leaves.size(); ++i) {
    set_target(door.ways[i], open ? door.leaves[i].open : door.leaves[i].closed);
    move(door.ways[i], door.description->motion);
  }
}

void Lifts::next(Lift& lift) {
  using enum Doing;
  bool ready = true;
  const world::Lift& description = *lift.description;
  switch (lift.doing) {
    case nothing:
      if (!lift.calls.empty()) lift.doing = closing;
      break;
    case closing:
      for_each_door(lift, [&](Door& door) {
        door.wanted_open = false;
        ready &= is_at(door, false);
      });
      if (!ready) break;
      if (lift.calls.empty()) {
        lift.doing = nothing;
        break;
      }
      lift.doing = going;
      set_target(lift.way, description.floors[lift.calls.front()].position);
      break;
    case going:
      if (!is_there(lift.way, kCabinNear_m)) break;
      lift.floor = lift.calls.front();
      lift.calls.erase(lift.calls.begin());
      lift.doing = lift.opens ? opening : closing;
      lift.opens = true;
      break;
    case opening:
      for_each_door(lift, [&](Door& door) {
        door.wanted_open = true;
        ready &= is_at(door, true);
      });
      if (!ready) break;
      lift.doing = waiting;
      lift.waited_us = 0;
      break;
    case waiting:
      lift.waited_us += step_us_;
      if (description.wait_us ? lift.waited_us >= *description.wait_us : !lift.calls.empty())
        lift.doing = closing;
      break;
  }
}

const std::vector<Lifts::Order>& Lifts::before_step() {
  orders_.clear();
  for (Lift& lift : lifts_) {
    next(lift);
    if (lift.doing != Doing::nothing || lift.description->motion)
      move(lift.way, lift.description->motion);
  }
  for (Door& door : doors_) move_door(door);
  return orders_;
}

}  // namespace ruedo::robot
