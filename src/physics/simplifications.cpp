// Joints and surfaces that are simplified. Said once, while a world loads, so that nobody has to find out.
#include "physics/simplifications.h"

#include <string>

namespace ruedo::physics {

namespace {

const model::Model& model_of(const model::WorldModel& world, int instance) {
  return *world.models[static_cast<size_t>(instance)].model;
}

void look_at_joints(const model::WorldModel& world, const model::BodyLayout& layout, std::vector<Finding>& findings) {
  for (const auto& placement : layout.joints) {
    const model::Joint& joint = model_of(world, placement.instance).joints[static_cast<size_t>(placement.joint)];
    const bool ball = joint.type == model::JointType::ball;
    if (!ball && joint.type != model::JointType::universal) continue;
    findings.push_back({Finding::Kind::unsupported, joint.source,
                        "model " + world.models[static_cast<size_t>(placement.instance)].name + "/joint " + joint.name,
                        ball ? "a ball joint holds its links together; it takes no commands, and its position is published as 0"
                             : "a universal joint takes commands for its first axis, and publishes that one's position"});
  }
}

// A kinematic drive has no friction at all; of other bodies the first shape's counts.
void look_at_friction(const model::WorldModel& world, const model::BodyLayout& layout, std::vector<Finding>& findings) {
  std::vector<bool> drives(layout.bodies.size());
  for (const auto& robot : layout.robots) {
    const auto& drive = model_of(world, robot.instance).drive;
    if (robot.body >= 0 && drive && drive->kind == model::DriveDescription::Kind::kinematic) drives[static_cast<size_t>(robot.body)] = true;
  }
  for (size_t i = 0; i < layout.bodies.size(); ++i) {
    if (drives[i]) continue;
    const auto& body = layout.bodies[i];
    const model::Collision* first = nullptr;
    const model::Collision* other = nullptr;
    for (const int link : body.links) {
      const auto& placement = layout.links[static_cast<size_t>(link)];
      for (const auto& collision : model_of(world, body.instance).links[static_cast<size_t>(placement.link)].collisions) {
        if (!first) first = &collision;
        if (!other && collision.surface.friction != first->surface.friction) other = &collision;
      }
    }
    if (!other) continue;
    findings.push_back({Finding::Kind::unsupported, other->source, "body " + body.name + "/collision " + other->name,
                        "its friction is not that of " + first->name + ", the body's first shape, which counts for the whole body"});
  }
}

}  // namespace

std::vector<Finding> simplifications(const model::WorldModel& world, const model::BodyLayout& layout) {
  std::vector<Finding> findings;
  look_at_joints(world, layout, findings);
  look_at_friction(world, layout, findings);
  return findings;
}

}  // namespace ruedo::physics
