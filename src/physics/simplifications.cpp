// Joints and surfaces that are simplified. Reported once while a world loads, so that nobody has to
// find out.
#include "physics/simplifications.h"

#include <algorithm>
#include <string>

namespace ruedo::physics {

namespace {

const model::Model& model_of(const model::WorldModel& world, InstanceIndex instance) {
  return *world.models[instance].model;
}

void look_at_joints(const model::WorldModel& world, const model::BodyLayout& layout,
                    std::vector<Finding>& findings) {
  for (const auto& placement : layout.joints) {
    const model::Joint& joint = model_of(world, placement.instance).joints[placement.joint];
    const bool led =
        std::any_of(layout.joints.begin(), layout.joints.end(), [&](const auto& other) {
          return other.instance == placement.instance && other.joint == joint.leader;
        });
    if (joint.leader.valid() && !led) {
      findings.push_back({Finding::Kind::unsupported, joint.source,
                          "model " + world.models[placement.instance].name + "/joint " + joint.name,
                          "<mimic> of a driven wheel is not supported; the joint moves freely"});
    }
    const bool ball = joint.type == model::JointType::ball;
    if (!ball && joint.type != model::JointType::universal) continue;
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
void look_at_friction(const model::WorldModel& world, const model::BodyLayout& layout,
                      std::vector<Finding>& findings) {
  for (const auto& placement : layout.links) {
    const model::ModelInstance& instance = world.models[placement.instance];
    const model::Link& link = instance.model->links[placement.link];
    const bool rolls = placement.wheel.valid();  // its axle gives the direction
    for (const auto& collision : link.collisions) {
      const model::Surface& surface = collision.surface;
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

}  // namespace

std::vector<Finding> simplifications(const model::WorldModel& world,
                                     const model::BodyLayout& layout) {
  std::vector<Finding> findings;
  look_at_joints(world, layout, findings);
  look_at_friction(world, layout, findings);
  return findings;
}

}  // namespace ruedo::physics
