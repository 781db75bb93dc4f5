// Joints and surfaces that are simplified. The findings are reported once while a
// world loads.
#include "physics/joints/simplifications.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <string>

#include "physics/joints/joint_block.h"

namespace ruedo::physics {

namespace {

const world::Model& model_of(const world::WorldModel& world, InstanceIndex instance) {
  return *world.models[instance].model;
}

void look_at_joints(const world::WorldModel& world, const world::BodyLayout& layout,
                    std::vector<Finding>& findings) {
  for (const auto& placement : layout.joints) {
    const world::Joint& joint = model_of(world, placement.instance).joints[placement.joint];
    const bool led =
        std::any_of(layout.joints.begin(), layout.joints.end(), [&](const auto& other) {
          return other.instance == placement.instance && other.joint == joint.leader;
        });
    if (joint.leader.valid() && !led) {
      findings.push_back({Finding::Kind::unsupported, joint.source,
                          "model " + world.models[placement.instance].name + "/joint " + joint.name,
                          "<mimic> of a driven wheel is not supported; the joint moves freely"});
    }
    const bool ball = joint.type == world::JointType::ball;
    if (!ball && joint.type != world::JointType::universal) continue;
    findings.push_back({Finding::Kind::unsupported, joint.source,
                        "model " + world.models[placement.instance].name + "/joint " + joint.name,
                        ball ? "a ball joint holds its links together; it takes no commands, and "
                               "its position is published as 0"
                             : "a universal joint takes commands for its first axis, and publishes "
                               "that one's position"});
  }
}

// Without a direction only one coefficient is used; torsional friction without a patch has no lever
// arm.
void look_at_friction(const world::WorldModel& world, const world::BodyLayout& layout,
                      std::vector<Finding>& findings) {
  for (const auto& placement : layout.links) {
    const world::ModelInstance& instance = world.models[placement.instance];
    const world::Link& link = instance.model->links[placement.link];
    const bool rolls = placement.wheel.valid();  // its axle gives the direction
    for (const auto& collision : link.collisions) {
      const world::Surface& surface = collision.surface;
      const auto find = [&](const char* what) {
        findings.push_back(
            {Finding::Kind::unsupported, collision.source,
             "model " + instance.name + "/link " + link.name + "/collision " + collision.name,
             what});
      };
      if (!rolls && surface.friction2 != surface.friction &&
          surface.friction_direction == Vec3::Zero()) {
        find("mu2 differs from mu, and there is no fdir1: mu counts in all directions");
      }
      if (surface.torsional > 0.0 && surface.patch_radius <= 0.0 && surface.surface_radius <= 0.0) {
        find(
            "a torsional coefficient without patch_radius or surface_radius has no lever: it "
            "brakes "
            "nothing");
      }
    }
  }
}

// The number of degrees of freedom that a joint takes from its bodies.
size_t rows_of(const world::Joint& joint) {
  switch (joint.type) {
    case world::JointType::fixed: return 6;
    case world::JointType::ball: return 3;
    case world::JointType::universal: return 4;
    case world::JointType::gearbox: return 1;
    default: return 5;
  }
}

// Bodies that joints connect.
struct Mechanism {
  size_t bodies = 0, joints = 0, hung = 0, rows = 0;  // hung: joints to the world
  const world::JointPlacement* first = nullptr;

  bool has_loops() const { return hung > 1 || joints + (hung == 0 ? 1 : 0) > bodies; }
};

class Mechanisms {
 public:
  Mechanisms(const world::WorldModel& world, const world::BodyLayout& layout)
      : parents_(layout.bodies.size()) {
    std::iota(parents_.begin(), parents_.end(), size_t{0});
    for (const auto& placement : layout.joints) {
      const world::Joint& joint = model_of(world, placement.instance).joints[placement.joint];
      unite(placement.parent_body, placement.child_body);
      if (joint.gear_reference.valid()) {
        const BodyIndex carrier =
            layout.links[layout.link_of(placement.instance, joint.gear_reference)].body;
        unite(carrier, placement.parent_body);
        unite(carrier, placement.child_body);
      }
    }
    for (size_t body = 0; body < parents_.size(); ++body) ++all_[root(body)].bodies;
    for (const auto& placement : layout.joints) {
      const bool hangs = !placement.parent_body.valid() || !placement.child_body.valid();
      const BodyIndex body =
          placement.child_body.valid() ? placement.child_body : placement.parent_body;
      if (!body.valid()) continue;
      Mechanism& mechanism = all_[root(static_cast<size_t>(body))];
      ++mechanism.joints;
      mechanism.hung += hangs;
      mechanism.rows += rows_of(model_of(world, placement.instance).joints[placement.joint]);
      if (!mechanism.first) mechanism.first = &placement;
    }
  }

  const std::map<size_t, Mechanism>& all() const { return all_; }

 private:
  void unite(BodyIndex one, BodyIndex other) {
    if (!one.valid() || !other.valid()) return;
    const size_t a = root(static_cast<size_t>(one)), b = root(static_cast<size_t>(other));
    parents_[std::max(a, b)] = std::min(a, b);
  }
  size_t root(size_t body) {
    while (parents_[body] != body) body = parents_[body] = parents_[parents_[body]];
    return body;
  }

  std::vector<size_t> parents_;
  std::map<size_t, Mechanism> all_;  // by their first body
};

// Trees are solved at once, however long they are.
void look_at_loops(const world::WorldModel& world, const world::BodyLayout& layout,
                   std::vector<Finding>& findings) {
  if (layout.joints.size() <= kMostRowsAtOnce / 6) return;
  const Mechanisms mechanisms(world, layout);
  for (const auto& [body, mechanism] : mechanisms.all()) {
    if (mechanism.rows <= kMostRowsAtOnce || !mechanism.has_loops()) continue;
    const InstanceIndex instance = mechanism.first->instance;
    const world::Model& model = model_of(world, instance);
    findings.push_back(
        {Finding::Kind::unsupported, model.joints[mechanism.first->joint].source,
         "model " + world.models[instance].name,
         "its " + std::to_string(mechanism.joints) + " joints close loops, and hold " +
             std::to_string(mechanism.rows) + " degrees of freedom; " +
             std::to_string(kMostRowsAtOnce) +
             " are solved at once, and the others bit by bit: less exactly, and slowly"});
  }
}

}  // namespace

std::vector<Finding> simplifications(const world::WorldModel& world,
                                     const world::BodyLayout& layout) {
  std::vector<Finding> findings;
  look_at_joints(world, layout, findings);
  look_at_friction(world, layout, findings);
  look_at_loops(world, layout, findings);
  return findings;
}

}  // namespace ruedo::physics
