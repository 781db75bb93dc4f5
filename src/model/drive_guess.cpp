// Wheels are joints that turn without end about a level axis and stand on the ground. Those with
// "wheel" in their names count first; without any, the round things that stand in pairs.
#include "model/drive_guess.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "model/geometry.h"

namespace ruedo::model {
namespace {

constexpr double kLevel = 0.35;     // of an axis' unit vector, upwards
constexpr double kGround_m = 0.03;  // above the lowest wheel
constexpr double kAside_m = 0.02;   // nearer to the middle is neither left nor right
constexpr double kParallel = 0.95;  // cosine

std::string lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

bool has_any(const std::string& name, std::initializer_list<const char*> words) {
  return std::any_of(words.begin(), words.end(),
                     [&](const char* word) { return name.find(word) != std::string::npos; });
}

bool unlimited(const Joint& joint) {
  return joint.type == JointType::continuous ||
         (joint.type == JointType::revolute && std::isinf(joint.axis.lower) &&
          std::isinf(joint.axis.upper));
}

Vec3 axis_in_model(const Joint& joint) { return joint.X_MJ.rotation * joint.axis.axis_in_J; }

struct Wheel {
  ModelJointIndex joint;
  ModelJointIndex steer;  // the joint about the vertical that it hangs on
  Vec3 axis, at;          // in the model
  double lowest = 0.0;
  std::string name;  // of joint and link, in small letters
};

// The joint about the vertical between the wheel and the base, if there is one.
ModelJointIndex steering_above(const Model& model, ModelJointIndex joint) {
  ModelLinkIndex link = model.joints[joint].parent;
  for (size_t steps = 0; link.valid() && steps <= model.joints.size(); ++steps) {
    const auto above = std::find_if(model.joints.begin(), model.joints.end(),
                                    [&](const Joint& each) { return each.child == link; });
    if (above == model.joints.end()) return {};
    const bool turns = above->type == JointType::revolute || above->type == JointType::continuous;
    if (turns && std::abs(axis_in_model(*above).z()) > 1.0 - kLevel)
      return ModelJointIndex(above - model.joints.begin());
    link = above->parent;
  }
  return {};
}

bool is_round(const Model& model, ModelLinkIndex link) {
  for (const Collision& c : model.links[link].collisions) {
    if (c.geometry.shape == Shape::cylinder || c.geometry.shape == Shape::sphere ||
        c.geometry.shape == Shape::mesh)
      return true;
  }
  return false;
}

std::vector<Wheel> wheels_of(const Model& model, bool by_name) {
  std::vector<Wheel> wheels;
  for (const ModelJointIndex j : model.joints.indices()) {
    const Joint& joint = model.joints[j];
    if (!unlimited(joint) || joint.parent < 0) continue;
    Wheel wheel;
    wheel.joint = j;
    wheel.axis = axis_in_model(joint);
    if (std::abs(wheel.axis.z()) > kLevel) continue;
    wheel.name = lower(joint.name + " " + model.links[joint.child].name);
    if (has_any(wheel.name, {"caster", "castor", "idler", "swivel", "roller", "passive", "laser",
                             "lidar", "scan", "sonar", "camera", "rotor", "prop"}))
      continue;
    if (by_name ? !has_any(wheel.name, {"wheel", "whl", "tire", "tyre"})
                : !is_round(model, joint.child))
      continue;
    wheel.steer = steering_above(model, wheel.joint);
    if (wheel.steer.valid() && unlimited(model.joints[wheel.steer]) &&
        has_any(lower(model.joints[wheel.steer].name), {"caster", "castor", "swivel"}))
      continue;
    wheel.at = joint.X_MJ.translation;
    wheel.lowest = lowest_point_below(model, wheel.joint);
    wheels.push_back(wheel);
  }
  double ground = std::numeric_limits<double>::infinity();
  for (const Wheel& wheel : wheels) ground = std::min(ground, wheel.lowest);
  std::erase_if(wheels, [&](const Wheel& wheel) { return wheel.lowest > ground + kGround_m; });
  return wheels;
}

void add(Element& drive, const char* name, const std::string& text) {
  drive.children.push_back(std::make_unique<Element>());
  Element& child = *drive.children.back();
  child.name = name;
  child.text = text;
  child.source = drive.source;
}

}  // namespace

double lowest_point_below(const Model& model, ModelJointIndex joint) {
  const Joint& top = model.joints[joint];
  std::vector<ModelLinkIndex> links{top.child};
  for (size_t i = 0; i < links.size(); ++i) {
    for (const Joint& each : model.joints) {
      if (each.parent == links[i] &&
          std::find(links.begin(), links.end(), each.child) == links.end())
        links.push_back(each.child);
    }
  }
  double lowest = top.X_MJ.translation.z();
  const auto reach = [&](const Pose& X, const Geometry& geometry) {
    const Eigen::AlignedBox3d box = bounds(geometry);
    if (box.isEmpty()) return;
    for (int corner = 0; corner < 8; ++corner)
      lowest = std::min(lowest,
                        (X * box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner))).z());
  };
  for (const ModelLinkIndex index : links) {
    const Link& link = model.links[index];
    for (const Collision& each : link.collisions) reach(link.X_ML * each.X_LC, each.geometry);
  }
  return lowest;
}

GuessedDrive guess_drive(const Model& model, const std::vector<std::string>& controlled) {
  GuessedDrive result;
  std::vector<Wheel> wheels = wheels_of(model, true);
  if (wheels.size() < 2) wheels = wheels_of(model, false);
  const auto is_controlled = [&](const Wheel& wheel) {
    return std::any_of(controlled.begin(), controlled.end(), [&](const std::string& name) {
      return name == model.joints[wheel.joint].name;
    });
  };
  if (std::count_if(wheels.begin(), wheels.end(), is_controlled) >= 2)
    std::erase_if(wheels, [&](const Wheel& wheel) { return !is_controlled(wheel); });
  for (const Wheel& wheel : wheels) result.wheels.push_back(model.joints[wheel.joint].name);
  if (wheels.size() < 2) return result;

  const auto parallel = [&](const Wheel& wheel) {
    return std::abs(wheel.axis.dot(wheels[0].axis)) > kParallel;
  };
  const bool all_parallel = std::all_of(wheels.begin(), wheels.end(), parallel);
  const auto steered = static_cast<size_t>(std::count_if(
      wheels.begin(), wheels.end(), [](const Wheel& wheel) { return wheel.steer.valid(); }));
  const bool rollers = std::any_of(wheels.begin(), wheels.end(), [](const Wheel& wheel) {
    return has_any(wheel.name, {"mecanum", "meca", "omni"});
  });

  auto drive = std::make_unique<Element>();
  drive->name = "ruedo:drive";
  drive->source = model.source;
  Vec3 middle = Vec3::Zero();
  for (const Wheel& wheel : wheels) middle += wheel.at / static_cast<double>(wheels.size());
  Vec3 left = wheels[0].axis;
  left.z() = 0;
  left.normalize();
  const Vec3 ahead = left.cross(Vec3::UnitZ());
  if (ahead.x() < -1e-6 || (std::abs(ahead.x()) <= 1e-6 && ahead.y() < 0)) left = -left;

  std::string lefts, rights, steers, steering = "differential";
  const auto name_of = [&](ModelJointIndex joint) -> const std::string& {
    return model.joints[joint].name;
  };
  const auto list = [](std::string& names, const std::string& name) {
    names += (names.empty() ? "" : "+") + name;
  };
  const auto sides = [&](bool with_steered) {
    for (const Wheel& wheel : wheels) {
      if (!with_steered && wheel.steer.valid()) continue;
      const double aside = left.dot(wheel.at - middle);
      if (std::abs(aside) < kAside_m) continue;
      add(*drive, aside > 0 ? "ruedo:left_joint" : "ruedo:right_joint", name_of(wheel.joint));
      list(aside > 0 ? lefts : rights, name_of(wheel.joint));
    }
  };
  if (!all_parallel) {
    if (wheels.size() < 3) return result;
    steering = "omni";
    for (const Wheel& wheel : wheels)
      add(*drive, "ruedo:left_joint", name_of(wheel.joint)), list(lefts, name_of(wheel.joint));
  } else if (steered == wheels.size()) {
    steering = "holonomic";  // each wheel turns where it has to go
    for (const Wheel& wheel : wheels) add(*drive, "ruedo:steer_joint", name_of(wheel.steer));
    sides(true);
  } else if (steered > 0) {
    std::vector<ModelJointIndex> joints;
    for (const Wheel& wheel : wheels) {
      if (!wheel.steer.valid() ||
          std::find(joints.begin(), joints.end(), wheel.steer) != joints.end())
        continue;
      joints.push_back(wheel.steer);
      add(*drive, "ruedo:steer_joint", name_of(wheel.steer));
      list(steers, name_of(wheel.steer));
      if (std::abs(left.dot(wheel.at - middle)) < kAside_m)
        add(*drive, "ruedo:left_joint", name_of(wheel.joint));
    }
    steering = joints.size() > 1 ? "ackermann" : "tricycle";
    sides(true);
  } else {
    sides(true);
    if (rollers && wheels.size() == 4) steering = "mecanum";
  }
  if (lefts.empty() || (rights.empty() && steering != "omni")) return result;
  drive->attributes.emplace_back("steering", steering);
  result.in_words =
      steering + ", " +
      (steering == "omni" ? "wheels " + lefts : "left " + lefts + ", right " + rights) +
      (steers.empty() ? "" : ", steered by " + steers);
  result.drive = std::move(drive);
  return result;
}

}  // namespace ruedo::model
