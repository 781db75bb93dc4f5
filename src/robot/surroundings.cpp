// Belts and doors are moved bodies, like models on a path.
#include "robot/surroundings.h"

#include <algorithm>
#include <cmath>

#include "base/whole.h"

namespace ruedo::robot {

namespace {

struct DoorDescription {
  Pose X_MOpen;
  double opening_s, distance_m;
  SimTime hold_us;

  explicit DoorDescription(const Element& e) {
    e.refuse_unknown({"ruedo:open", "ruedo:time", "ruedo:distance", "ruedo:hold"}, false);
    if (!e.has("ruedo:open")) e.fail("has no <ruedo:open>");
    X_MOpen = e.pose("ruedo:open");
    opening_s = e.number("ruedo:time", 2.0, Allowed::between(0.01, 1e6));
    distance_m = e.number("ruedo:distance", 2.0, Allowed::positive(quantity::kLength));
    hold_us = microseconds(e.number("ruedo:hold", 2.0, Allowed::between(0, 1e6)));
  }
};

Vec3 velocity_of(const Element& belt) {
  belt.refuse_unknown({"ruedo:velocity"}, false);
  if (!belt.has("ruedo:velocity")) belt.fail("has no <ruedo:velocity>");
  return belt.vector3("ruedo:velocity", Vec3::Zero(), Allowed::between(-100, 100));
}

bool is(const world::Model& model, const char* name) {
  return model.path && model.path->name == name;
}

}  // namespace

void check_belt(const Element& belt) { velocity_of(belt); }
void check_door(const Element& door) { DoorDescription{door}; }

Surroundings::Surroundings(const world::WorldModel& world, const world::BodyLayout& layout,
                           physics::PhysicsWorld& physics)
    : world_(world),
      layout_(layout),
      physics_(physics),
      step_s_(1e-6 * static_cast<double>(world.step_us)) {
  for (const InstanceIndex i : world.models.indices()) add(i);
}

void Surroundings::add(InstanceIndex instance) {
  const world::ModelInstance& placed = world_->models[instance];
  if (is(*placed.model, "ruedo:belt"))
    belts_.push_back({instance, parts_of(instance), placed.X_WM,
                      placed.X_WM.rotation * velocity_of(*placed.model->path)});
  if (is(*placed.model, "ruedo:door")) {
    const DoorDescription door(*placed.model->path);
    doors_.push_back({instance, parts_of(instance), placed.X_WM, door.X_MOpen, door.opening_s,
                      door.distance_m, door.hold_us});
  }
}

std::vector<Surroundings::Part> Surroundings::parts_of(InstanceIndex instance) const {
  std::vector<Part> parts;
  const Pose X_MW = world_->models[instance].X_WM.inverse();
  for (const BodyIndex b : layout_->bodies.indices()) {
    if (layout_->bodies[b].instance == instance)
      parts.push_back({b, X_MW * layout_->bodies[b].X_WB});
  }
  return parts;
}

void Surroundings::remove(InstanceIndex instance) {
  const auto of_it = [instance](const auto& each) { return each.instance == instance; };
  std::erase_if(belts_, of_it);
  std::erase_if(doors_, of_it);
}

void Surroundings::reset(InstanceIndex instance) {
  for (Door& door : doors_) {
    if (door.instance != instance) continue;
    door.open = 0.0;
    door.wanted = -1;
  }
}

void Surroundings::shift_time(SimTime us) {
  for (Door& door : doors_) {
    if (door.wanted >= 0) door.wanted = std::max<SimTime>(0, door.wanted - us);
  }
}

Pose Surroundings::Door::pose() const {
  return X_WM * Pose{Quat::Identity().slerp(open, X_MOpen.rotation), open * X_MOpen.translation};
}

// The centre of a robot or person, seen from above.
bool Surroundings::is_near(const Door& door) const {
  for (const BodyIndex b : layout_->bodies.indices()) {
    const world::ModelInstance& instance = world_->models[layout_->bodies[b].instance];
    const bool walks = is(*instance.model, "ruedo:path") || is(*instance.model, "ruedo:crowd");
    if (instance.removed || !(walks || instance.is_robot())) continue;
    const Vec3 way = physics_->pose(b).translation - door.X_WM.translation;
    if (way.head<2>().norm() < door.distance_m) return true;
  }
  return false;
}

void Surroundings::guide(const std::vector<Part>& parts, const Pose& X_WM) {
  for (const Part& part : parts) {
    const Pose end = (X_WM * part.X_MB).normalized();
    const Pose& begin = physics_->pose(part.body);
    const Eigen::AngleAxisd turn(end.rotation * begin.rotation.conjugate());
    physics_->guide(
        part.body,
        {(end.translation - begin.translation) / step_s_, turn.axis() * (turn.angle() / step_s_)},
        end);
  }
}

void Surroundings::before_step(SimTime now) {
  for (const Belt& belt : belts_) {
    for (const Part& part : belt.parts)
      physics_->guide(part.body, {belt.velocity, Vec3::Zero()},
                      (belt.X_WM * part.X_MB).normalized());
  }
  for (Door& door : doors_) {
    if (is_near(door)) door.wanted = now;
    const bool opens = door.wanted >= 0 && now - door.wanted <= door.hold_us;
    const double way = step_s_ / door.opening_s;
    door.open = std::clamp(door.open + (opens ? way : -way), 0.0, 1.0);
    guide(door.parts, door.pose());
  }
}

}  // namespace ruedo::robot
