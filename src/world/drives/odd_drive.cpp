#include "world/drives/odd_drive.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>

#include "base/text.h"
#include "world/drives/drive.h"

namespace ruedo::world {
namespace {

using Steering = DriveDescription::Steering;

constexpr double kAlong = 0.5;  // cosine

bool has_side_wheels(Steering steering) {
  return steering != Steering::omni && steering != Steering::holonomic;
}

struct Of {
  const char* element;
  std::initializer_list<Steering> steerings;
};

const Of kOf[] = {
    {"ruedo:max_side_speed", {Steering::mecanum, Steering::omni, Steering::holonomic}},
    {"ruedo:wheelbase", {Steering::ackermann, Steering::tricycle, Steering::mecanum}},
    {"ruedo:max_steering_angle", {Steering::ackermann, Steering::tricycle}},
    {"ruedo:max_steering_rate", {Steering::ackermann, Steering::tricycle}},
};

void name_without_effect(const DriveDescription& drive, const std::string& where,
                         Findings& findings) {
  for (const Of& each : kOf) {
    const Element* written = drive.element->child(each.element);
    if (written && !steering_has(drive.steering, each.element))
      findings.unsupported(
          written->source, where,
          "<" + written->name + "> does nothing with steering '" + name_of(drive.steering) + "'");
  }
}

class Look {
 public:
  Look(const Model& model, const std::string& where, Findings& findings)
      : model_(model), drive_(*model.drive), where_(where), findings_(findings) {}

  void all() {
    for (const auto* side : {&drive_.left_joints, &drive_.right_joints})
      for (const ModelJointIndex joint : *side) wheel(model_.joints[joint]);
    for (const ModelJointIndex joint : drive_.steer_joints) steered(model_.joints[joint]);
    swapped();
  }

 private:
  void wheel(const Joint& joint) {
    const Vec3 axis = axis_in_base(joint);
    if (std::abs(axis.z()) > kAlong)
      cannot("roll", joint, "its axis is upright");
    else if (has_side_wheels(drive_.steering) && std::abs(axis.y()) < kAlong)
      cannot("roll", joint, "its axis points ahead");
    if (joint.type == JointType::revolute &&
        (std::isfinite(joint.axis.lower) || std::isfinite(joint.axis.upper)))
      cannot("roll", joint,
             "it turns from " + shown(joint.axis.lower) + " to " + shown(joint.axis.upper) +
                 " rad only");
    follows(joint);
  }

  void steered(const Joint& joint) {
    if (std::abs(axis_in_base(joint).z()) < kAlong) cannot("steer", joint, "its axis is level");
    follows(joint);
  }

  void follows(const Joint& joint) {
    if (joint.leader.valid())
      findings_.unsupported(joint.source, where_,
                            "the drive turns the joint '" + joint.name + "': that it follows '" +
                                model_.joints[joint.leader].name + "' does nothing");
  }

  // With them, x would point backwards.
  void swapped() {
    const Element* left = drive_.element->child("ruedo:left_joint");
    if (!left || !drive_.element->has("ruedo:right_joint") || !has_side_wheels(drive_.steering))
      return;
    const auto is_it = [&](ModelJointIndex joint) {
      const std::string& name = model_.joints[joint].name;
      return dotted(left->text) == name || dotted(left->text) == model_.name + "." + name;
    };
    if (std::any_of(drive_.right_joints.begin(), drive_.right_joints.end(), is_it))
      findings_.repaired(left->source, where_,
                         "the left wheels stand on the right, seen along the model's x: left and "
                         "right are taken the other way round");
  }

  Vec3 axis_in_base(const Joint& joint) const {
    return drive_.X_MBase.rotation.conjugate() * (joint.X_MJ.rotation * joint.axis.axis_in_J);
  }

  // The kinematic drive moves the robot whatever its wheels are.
  void cannot(const char* what, const Joint& joint, const std::string& why) {
    const std::string text = "the joint '" + joint.name + "' cannot " + what + " a wheel: " + why;
    if (drive_.kind == DriveDescription::Kind::wheels)
      findings_.error(joint.source, where_, text);
    else
      findings_.repaired(joint.source, where_,
                         text + "; the kinematic drive moves the robot regardless");
  }

  const Model& model_;
  const DriveDescription& drive_;
  const std::string& where_;
  Findings& findings_;
};

}  // namespace

bool steering_has(Steering steering, const std::string& element) {
  return std::none_of(std::begin(kOf), std::end(kOf), [&](const Of& each) {
    return element == each.element && std::find(each.steerings.begin(), each.steerings.end(),
                                                steering) == each.steerings.end();
  });
}

void name_odd_drive(const Element& model_element, const Model& model, const std::string& where,
                    Findings& findings) {
  if (!model.drive) return;
  const Source& source = model.drive->element->source;
  for (const char* way : {"ruedo:path", "ruedo:belt", "ruedo:door"}) {
    if (model_element.has(way))
      return findings.error(
          source, where,
          "the model moves by its <" + std::string(way) + ">: its drive moves nothing");
  }
  if (model.is_static)
    return findings.error(source, where, "the model is static: its drive moves nothing");
  if (model_element.has("ruedo:drive")) {
    name_without_effect(*model.drive, where, findings);
  }
  Look(model, where, findings).all();
}

}  // namespace ruedo::world
