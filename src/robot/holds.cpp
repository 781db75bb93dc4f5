// A hold is a tie in the physics, created once both bodies exist.
#include "robot/holds.h"

#include <algorithm>

namespace ruedo::robot {

Holds::Holds(const world::WorldModel& world, const world::BodyLayout& layout,
             physics::PhysicsWorld& physics)
    : world_(world), layout_(layout), physics_(physics) {
  for (const InstanceIndex instance : world.models.indices()) start(instance);
}

bool Holds::has(InstanceIndex instance, const std::string& name) const {
  return std::any_of(held_.begin(), held_.end(), [&](const Held& each) {
    return each.instance == instance && each.description->name == name;
  });
}

void Holds::set(InstanceIndex instance, const std::string& name, bool attached) {
  for (Held& each : held_) {
    if (each.instance == instance && each.description->name == name) each.wanted = attached;
  }
}

void Holds::start(InstanceIndex instance) {
  const world::ModelInstance& placed = world_->models[instance];
  for (const world::Hold& description : placed.model->holds) {
    const auto known = std::find_if(held_.begin(), held_.end(), [&](const Held& each) {
      return each.instance == instance && each.description == &description;
    });
    if (known == held_.end())
      held_.push_back({instance, &description});
    else
      known->wanted = true;
  }
}

void Holds::forget(InstanceIndex instance) {
  for (Held& each : held_) {
    if (each.instance != instance) continue;
    each.wanted = false;
    open(each);
  }
}

void Holds::moved(InstanceIndex instance) {
  for (Held& each : held_) {
    if (each.other == instance && each.instance != instance) open(each);
  }
}

std::vector<InstanceIndex> Holds::carried_by(InstanceIndex instance) const {
  std::vector<InstanceIndex> all{instance};
  for (size_t i = 0; i < all.size(); ++i) {
    for (const Held& each : held_) {
      if (each.instance == all[i] && is_closed(each) &&
          std::find(all.begin(), all.end(), each.other) == all.end())
        all.push_back(each.other);
    }
  }
  all.erase(all.begin());
  return all;
}

void Holds::before_step() {
  for (Held& each : held_) {
    if (each.wanted == is_closed(each)) continue;
    each.wanted ? close(each) : open(each);
  }
}

InstanceIndex Holds::find(const std::string& name) const {
  for (const InstanceIndex i : world_->models.indices()) {
    if (world_->models[i].name == name && !world_->models[i].removed) return i;
  }
  return {};
}

LinkIndex Holds::link_of(InstanceIndex instance, const std::string& name) const {
  const auto& links = world_->models[instance].model->links;
  for (const ModelLinkIndex link : links.indices()) {
    if (links[link].name == name) return layout_->link_of(instance, link);
  }
  return {};
}

bool Holds::is_closed(const Held& held) const {
  return held.tie.valid() && physics_->is_closed(held.tie);
}

void Holds::close(Held& held) {
  if (world_->models[held.instance].removed) return;
  const world::Hold& description = *held.description;
  const InstanceIndex other =
      description.other_model.empty() ? held.instance : find(description.other_model);
  if (!other.valid()) return;
  const LinkIndex child_link = link_of(other, description.other_link);
  if (!child_link.valid()) return;
  const BodyIndex body = layout_->links[layout_->link_of(held.instance, description.link)].body;
  const BodyIndex child = layout_->links[child_link].body;
  if (child == body) return;  // the same body, or neither moves
  if (!held.tie.valid() || held.other != other)
    held.tie = child.valid() ? physics_->make_tie(child, body) : physics_->make_tie(body, child);
  held.other = other;
  physics_->close_tie(held.tie);
}

void Holds::open(Held& held) {
  if (is_closed(held)) physics_->open_tie(held.tie);
}

}  // namespace ruedo::robot
