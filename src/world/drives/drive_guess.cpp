// Wheels are continuous joints with a level axis whose link touches the ground. Links with "wheel"
// in their name come first; without any, round links that come in pairs.
#include "world/drives/drive_guess.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "world/model/bounds.h"

namespace ruedo::world {
namespace {

constexpr double kLevel = 0.35;     // z component of the axis' unit vector
constexpr double kGround_m = 0.03;  // above the lowest wheel
constexpr double kAside_m = 0.02;   // closer to the centre line, a wheel is neither left nor right
constexpr double kParallel = 0.95;  // cosine

std::string lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

constexpr std::initializer_list<const char*> kCasters = {"caster", "castor", "swivel"};

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
  ModelJointIndex steer;  // the vertical joint that it hangs on
  Vec3 axis, at;          // in the model
  double lowest = 0.0;
  std::string name;  // of joint and link, in lower case
};

// The vertical joint between the wheel and the base, if there is one.
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

// Of a link's shapes, in the model.
double lowest_of(const Link& link) {
  double lowest = std::numeric_limits<double>::infinity();
  for (const Collision& each : link.collisions) {
    const Eigen::AlignedBox3d box = bounds(each.geometry);
    if (box.isEmpty()) continue;
    for (int corner = 0; corner < 8; ++corner)
      lowest = std::min(lowest, (link.X_ML * each.X_LC *
                                 box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner)))
                                    .z());
  }
  return lowest;
}

// One on the axle of a wheel that stands is a wheel as well, however roughly its mesh is made.
void keep_standing(std::vector<Wheel>& wheels, double ground) {
  const auto stands = [&](const Wheel& wheel) { return wheel.lowest <= ground + kGround_m; };
  const auto on_axle = [](const Wheel& one, const Wheel& other) {
    return std::abs((one.at - other.at).normalized().dot(one.axis)) > 1.0 - 1e-3;
  };
  std::vector<Wheel> kept;
  for (const Wheel& wheel : wheels) {
    if (stands(wheel) || std::any_of(wheels.begin(), wheels.end(), [&](const Wheel& other) {
          return stands(other) && on_axle(wheel, other);
        }))
      kept.push_back(wheel);
  }
  wheels = std::move(kept);
}

// by_name: or else those that are round. controlled: joints that are driven whatever their names.
std::vector<Wheel> wheels_of(const Model& model, bool by_name,
                             const std::vector<std::string>& controlled = {}) {
  std::vector<Wheel> wheels;
  for (const ModelJointIndex j : model.joints.indices()) {
    const Joint& joint = model.joints[j];
    if (!unlimited(joint) || !joint.parent.valid()) continue;
    Wheel wheel;
    wheel.joint = j;
    wheel.axis = axis_in_model(joint);
    if (std::abs(wheel.axis.z()) > kLevel) continue;
    wheel.name = lower(joint.name + " " + model.links[joint.child].name);
    const bool is_driven =
        std::find(controlled.begin(), controlled.end(), joint.name) != controlled.end();
    if (has_any(wheel.name, {"idler", "roller", "passive", "laser", "lidar", "scan", "sonar",
                             "camera", "rotor", "prop"}) ||
        (!is_driven && has_any(wheel.name, kCasters)))
      continue;
    if (by_name ? !has_any(wheel.name, {"wheel", "whl", "tire", "tyre"})
                : !is_round(model, joint.child))
      continue;
    wheel.steer = steering_above(model, wheel.joint);
    if (!is_driven && wheel.steer.valid() && unlimited(model.joints[wheel.steer]) &&
        has_any(lower(model.joints[wheel.steer].name), kCasters))
      continue;
    wheel.at = joint.X_MJ.translation;
    wheel.lowest = lowest_point_below(model, wheel.joint);
    wheels.push_back(wheel);
  }
  double ground = std::numeric_limits<double>::infinity();
  for (const Wheel& wheel : wheels) ground = std::min(ground, wheel.lowest);
  if (!by_name) ground = std::min(ground, lowest_point(model));
  keep_standing(wheels, ground);
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
  for (const ModelLinkIndex index : links) lowest = std::min(lowest, lowest_of(model.links[index]));
  return lowest;
}

double lowest_point(const Model& model) {
  double lowest = std::numeric_limits<double>::infinity();
  for (const Link& link : model.links) lowest = std::min(lowest, lowest_of(link));
  return lowest;
}

namespace {

// The candidate wheels; if a controller names some of them, only those.
std::vector<Wheel> driven_wheels(const Model& model, const std::vector<std::string>& controlled) {
  std::vector<Wheel> wheels = wheels_of(model, true);
  if (wheels.size() < 2) wheels = wheels_of(model, true, controlled);
  if (wheels.size() < 2) wheels = wheels_of(model, false);
  const auto is_controlled = [&](const Wheel& wheel) {
    return std::any_of(controlled.begin(), controlled.end(), [&](const std::string& name) {
      return name == model.joints[wheel.joint].name;
    });
  };
  if (std::count_if(wheels.begin(), wheels.end(), is_controlled) >= 2)
    std::erase_if(wheels, [&](const Wheel& wheel) { return !is_controlled(wheel); });
  return wheels;
}

// Points to the robot's left along the wheel axes, so that forward has a positive x, or else a
// positive y.
Vec3 left_of(const std::vector<Wheel>& wheels) {
  Vec3 left = wheels[0].axis;
  left.z() = 0;
  left.normalize();
  const Vec3 ahead = left.cross(Vec3::UnitZ());
  if (ahead.x() < -1e-6 || (std::abs(ahead.x()) <= 1e-6 && ahead.y() < 0)) left = -left;
  return left;
}

// Builds the <ruedo:drive> element from the wheels, and a text that says what was guessed.
class Guesser {
 public:
  Guesser(const Model& model, const std::vector<Wheel>& wheels)
      : model_(model), wheels_(wheels), left_(left_of(wheels)) {
    drive_->name = "ruedo:drive";
    drive_->source = model.source;
    for (const Wheel& wheel : wheels) middle_ += wheel.at / static_cast<double>(wheels.size());
  }

  void guess(GuessedDrive& result) {
    const std::string steering = find_steering();
    if (lefts_.empty() || (rights_.empty() && steering != "omni")) return;
    drive_->attributes.emplace_back("steering", steering);
    result.in_words =
        steering + ", " +
        (steering == "omni" ? "wheels " + lefts_ : "left " + lefts_ + ", right " + rights_) +
        (steers_.empty() ? "" : ", steered by " + steers_);
    result.drive = std::move(drive_);
  }

 private:
  std::string find_steering() {
    const auto parallel = [&](const Wheel& wheel) {
      return std::abs(wheel.axis.dot(wheels_[0].axis)) > kParallel;
    };
    const auto steered = static_cast<size_t>(std::count_if(
        wheels_.begin(), wheels_.end(), [](const Wheel& wheel) { return wheel.steer.valid(); }));
    if (!std::all_of(wheels_.begin(), wheels_.end(), parallel)) {
      if (wheels_.size() < 3) return "";
      for (const Wheel& wheel : wheels_) name("ruedo:left_joint", wheel.joint, &lefts_);
      return "omni";
    }
    if (steered == wheels_.size()) {  // every wheel can be steered
      for (const ModelJointIndex joint : steering_joints()) name("ruedo:steer_joint", joint);
      name_sides();
      return "holonomic";
    }
    if (steered > 0) {
      const size_t joints = name_steered();
      name_sides();
      return joints > 1 ? "ackermann" : "tricycle";
    }
    name_sides();
    const bool rollers = std::any_of(wheels_.begin(), wheels_.end(), [](const Wheel& wheel) {
      return has_any(wheel.name, {"mecanum", "meca", "omni"});
    });
    return rollers && wheels_.size() == 4 ? "mecanum" : "differential";
  }

  double aside(const Wheel& wheel) const { return left_.dot(wheel.at - middle_); }

  void name_sides() {
    for (const Wheel& wheel : wheels_) {
      if (aside(wheel) >= kAside_m)
        name("ruedo:left_joint", wheel.joint, &lefts_);
      else if (aside(wheel) <= -kAside_m)
        name("ruedo:right_joint", wheel.joint, &rights_);
    }
  }

  // Each once: a caster may have two wheels (PR2).
  std::vector<ModelJointIndex> steering_joints() const {
    std::vector<ModelJointIndex> joints;
    for (const Wheel& wheel : wheels_) {
      if (wheel.steer.valid() &&
          std::find(joints.begin(), joints.end(), wheel.steer) == joints.end())
        joints.push_back(wheel.steer);
    }
    return joints;
  }

  size_t name_steered() {
    const std::vector<ModelJointIndex> joints = steering_joints();
    for (const ModelJointIndex joint : joints) {
      name("ruedo:steer_joint", joint, &steers_);
      const auto wheel = std::find_if(wheels_.begin(), wheels_.end(),
                                      [&](const Wheel& each) { return each.steer == joint; });
      if (std::abs(aside(*wheel)) < kAside_m) name("ruedo:left_joint", wheel->joint);
    }
    return joints.size();
  }

  void name(const char* element, ModelJointIndex joint, std::string* words = nullptr) {
    const std::string& joint_name = model_.joints[joint].name;
    add(*drive_, element, joint_name);
    if (words) *words += (words->empty() ? "" : "+") + joint_name;
  }

  const Model& model_;
  const std::vector<Wheel>& wheels_;
  Vec3 left_, middle_ = Vec3::Zero();
  std::unique_ptr<Element> drive_ = std::make_unique<Element>();
  std::string lefts_, rights_, steers_;
};

}  // namespace

GuessedDrive guess_drive(const Model& model, const std::vector<std::string>& controlled) {
  GuessedDrive result;
  const std::vector<Wheel> wheels = driven_wheels(model, controlled);
  for (const Wheel& wheel : wheels) result.wheels.push_back(model.joints[wheel.joint].name);
  if (wheels.size() >= 2) Guesser(model, wheels).guess(result);
  return result;
}

}  // namespace ruedo::world
