// <ruedo:drive> and <ruedo:odometry>. Missing values are derived from the wheels' joints and
// shapes.
#include "world/drives/drive.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "base/whole.h"
#include "ruedo/drive.h"
#include "ruedo/math.h"
#include "world/compat/joint_plugins.h"
#include "world/compat/plugin_parameters.h"
#include "world/compat/plugins.h"
#include "world/compat/ros_control.h"
#include "world/compat/ros_gains.h"
#include "world/drives/drive_guess.h"
#include "world/drives/holds.h"
#include "world/drives/lifts.h"
#include "world/drives/odd_drive.h"
#include "world/model/bounds.h"
#include "world/model/own_plugins.h"

namespace ruedo::world {
namespace {

constexpr double kStandardGravity = 9.80665;  // m/s^2

ModelJointIndex joint_of(const Element& element, const Model& model) {
  const std::string name = dotted(element.text);
  std::vector<std::string> names;
  for (const ModelJointIndex i : model.joints.indices()) {
    const Joint& joint = model.joints[i];
    // Gazebo's plugins also take "MODEL::JOINT".
    if (joint.name == name || model.name + "." + joint.name == name) {
      if (joint.type != JointType::revolute && joint.type != JointType::continuous) {
        element.fail("the joint '" + name +
                     "' does not turn; a wheel's joint is revolute or continuous");
      }
      return i;
    }
    names.push_back(joint.name);
  }
  const std::string near = nearest_word(name, names);
  element.fail("there is no joint '" + name + "' in the model '" + model.name + "'" +
               (near.empty() ? "" : "; did you mean '" + near + "'?"));
}

// The radius of the wheel on a joint: of the round shapes of its link, and of links fixed to it,
// measured across the axis. 0: no round shape.
double radius_of(const Model& model, const Joint& joint) {
  std::vector<ModelLinkIndex> links{joint.child};
  for (size_t i = 0; i < links.size(); ++i) {
    for (const Joint& other : model.joints) {
      if (other.type == JointType::fixed && other.parent == links[i]) links.push_back(other.child);
    }
  }
  double radius = 0;
  const Vec3 axis_M = joint.X_MJ.rotation * joint.axis.axis_in_J;
  for (const ModelLinkIndex index : links) {
    const Link& link = model.links[index];
    for (const Collision& c : link.collisions) {
      const Geometry& g = c.geometry;
      if (g.shape == Shape::cylinder || g.shape == Shape::sphere || g.shape == Shape::capsule) {
        radius = std::max(radius, g.size.x());
      } else if (g.shape == Shape::mesh) {
        const Pose X_MC = link.X_ML * c.X_LC;
        for (const auto& p : g.mesh->positions) {
          const Vec3 arm = X_MC * g.scale.cwiseProduct(p.cast<double>()) - joint.X_MJ.translation;
          radius = std::max(radius, (arm - arm.dot(axis_M) * axis_M).norm());
        }
      }
    }
  }
  return radius;
}

Vec3 middle(const Model& model, const std::vector<ModelJointIndex>& joints) {
  Vec3 sum = Vec3::Zero();
  for (const ModelJointIndex joint : joints) sum += model.joints[joint].X_MJ.translation;
  return sum / static_cast<double>(joints.size());
}

// x points forward, with the left wheels on the left. If the file swaps the wheels (as some robots
// do), the model's own x stays forward.
Quat heading_of(const Vec3& left, const Vec3& right, DriveDescription& drive,
                const Element& element) {
  Vec3 across = left - right;
  across.z() = 0;
  if (!(across.norm() > 1e-6)) element.fail("the left and the right wheels are in one place");
  across.normalize();
  Vec3 ahead = across.cross(Vec3::UnitZ());
  if (ahead.x() < -0.5) {
    std::swap(drive.left_joints, drive.right_joints);
    ahead = -ahead;
  }
  if (drive.steering == DriveDescription::Steering::holonomic) {  // not led by its wheels
    const int along = std::abs(ahead.x()) > std::abs(ahead.y()) ? 0 : 1;
    ahead = Vec3::Unit(along) * (ahead[along] > 0 ? 1.0 : -1.0);
  }
  return Quat(Eigen::AngleAxisd(math::atan2(ahead.y(), ahead.x()), Vec3::UnitZ()));
}

// Sorted front first, whatever their order in the file.
void sort_by_front(const Model& model, const Pose& X_MBase, std::vector<ModelJointIndex>& joints) {
  const Pose X_BaseM = X_MBase.inverse();
  std::stable_sort(joints.begin(), joints.end(), [&](ModelJointIndex a, ModelJointIndex b) {
    return (X_BaseM * model.joints[a].X_MJ.translation).x() >
           (X_BaseM * model.joints[b].X_MJ.translation).x() + 1e-9;
  });
}

using Steering = DriveDescription::Steering;

constexpr double kMostSteering_rad = 1.56;  // a wheel that points sideways cannot roll
constexpr double kUsualSteering_rad = 0.6;

const std::vector<std::pair<std::string, Steering>>& steerings() {
  static const std::vector<std::pair<std::string, Steering>> list = {
      {"differential", Steering::differential}, {"tracked", Steering::tracked},
      {"ackermann", Steering::ackermann},       {"tricycle", Steering::tricycle},
      {"mecanum", Steering::mecanum},           {"omni", Steering::omni},
      {"holonomic", Steering::holonomic}};
  return list;
}

Steering read_steering(const Element& e) {
  const std::string* written = e.attribute("steering");
  if (!written) return Steering::differential;
  std::string allowed;
  for (const auto& [name, steering] : steerings()) {
    if (name == *written) return steering;
    allowed += (allowed.empty() ? "" : ", ") + name;
  }
  e.fail("steering '" + *written + "' is not allowed; allowed are " + allowed);
}

bool is_steered(const Model& model, const DriveDescription& drive, ModelJointIndex joint) {
  ModelLinkIndex link = model.joints[joint].parent;
  for (size_t steps = 0; link.valid() && steps <= model.joints.size(); ++steps) {
    for (const ModelJointIndex steer : drive.steer_joints) {
      if (model.joints[steer].child == link) return true;
    }
    const auto above = std::find_if(model.joints.begin(), model.joints.end(),
                                    [&](const Joint& each) { return each.child == link; });
    link = above == model.joints.end() ? ModelLinkIndex() : above->parent;
  }
  return false;
}

void read_joints(const Element& e, const Model& model, DriveDescription& drive) {
  const auto read = [&](const char* name, std::vector<ModelJointIndex>& into) {
    for (const Element* joint : e.all(name)) into.push_back(joint_of(*joint, model));
  };
  read("ruedo:left_joint", drive.left_joints);
  read("ruedo:right_joint", drive.right_joints);
  read("ruedo:wheel_joint", drive.left_joints);
  read("ruedo:steer_joint", drive.steer_joints);
  std::vector<ModelJointIndex> all = drive.left_joints;
  all.insert(all.end(), drive.right_joints.begin(), drive.right_joints.end());
  all.insert(all.end(), drive.steer_joints.begin(), drive.steer_joints.end());
  for (size_t i = 0; i < all.size(); ++i) {
    const auto first = std::find(all.begin(), all.end(), all[i]) - all.begin();
    if (first == static_cast<ptrdiff_t>(i)) continue;
    const size_t left = drive.left_joints.size(), sides = left + drive.right_joints.size();
    e.fail("the joint '" + model.joints[all[i]].name +
           (static_cast<size_t>(first) < left && left <= i && i < sides ? "' is left and right"
                                                                        : "' is named twice"));
  }
  const auto need = [&](bool there, const char* name) {
    if (!there) e.fail(std::string("has no <") + name + ">");
  };
  switch (drive.steering) {
    case Steering::differential:
    case Steering::mecanum:
      need(!drive.left_joints.empty(), "ruedo:left_joint");
      need(!drive.right_joints.empty(), "ruedo:right_joint");
      if (drive.steering == Steering::mecanum &&
          (drive.left_joints.size() != 2 || drive.right_joints.size() != 2))
        e.fail("a mecanum drive has two left and two right wheels");
      break;
    case Steering::omni:
      if (all.size() < 3) e.fail("an omni drive has three wheels or more");
      break;
    case Steering::ackermann:
    case Steering::tricycle:
      need(!drive.left_joints.empty() || !drive.right_joints.empty(),
           drive.steering == Steering::tricycle ? "ruedo:wheel_joint" : "ruedo:left_joint");
      need(!drive.steer_joints.empty(), "ruedo:steer_joint");
      break;
    case Steering::tracked:
    case Steering::holonomic:
      if (drive.left_joints.empty() != drive.right_joints.empty() &&
          drive.steering == Steering::tracked)
        e.fail("has wheels on one side only");
      break;
  }
}

// The lowest point of the collision shapes, below the model's first link.
Vec3 below_model(const Model& model) {
  Vec3 at = model.links[0].X_ML.translation;
  double lowest = std::numeric_limits<double>::infinity();
  for (const Link& link : model.links) {
    for (const Collision& each : link.collisions) {
      const Eigen::AlignedBox3d box = bounds(each.geometry);
      if (box.isEmpty()) continue;
      for (int corner = 0; corner < 8; ++corner) {
        lowest = std::min(lowest, (link.X_ML * each.X_LC *
                                   box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner)))
                                      .z());
      }
    }
  }
  if (std::isfinite(lowest)) at.z() = lowest;
  return at;
}

std::vector<ModelJointIndex> not_steered(const Model& model, const DriveDescription& drive,
                                         const std::vector<ModelJointIndex>& wheels) {
  std::vector<ModelJointIndex> fixed;
  std::copy_if(wheels.begin(), wheels.end(), std::back_inserter(fixed),
               [&](ModelJointIndex joint) { return !is_steered(model, drive, joint); });
  return fixed;
}

bool steers(const DriveDescription& drive) {
  return drive.steering == Steering::ackermann || drive.steering == Steering::tricycle;
}

// Where the wheels stand in the model's frame.
struct Stance {
  Quat heading = Quat::Identity();
  Vec3 at = Vec3::Zero();  // on the ground, at the centre of the wheels that are not steered
  double track = 0;        // 0: wheels on one side only, or none
};

Stance stance_of(const Element& e, const Model& model, const std::vector<ModelJointIndex>& wheels,
                 DriveDescription& drive) {
  const Vec3 above_ground(0, 0, drive.wheel_radius);
  Stance stance;
  stance.at = wheels.empty() ? below_model(model) : Vec3(middle(model, wheels) - above_ground);
  std::vector<ModelJointIndex> lefts = drive.left_joints, rights = drive.right_joints;
  if (steers(drive)) {
    lefts = not_steered(model, drive, lefts);
    rights = not_steered(model, drive, rights);
  }
  if (lefts.empty() || rights.empty() || drive.steering == Steering::omni) return stance;
  const Vec3 left = middle(model, lefts), right = middle(model, rights);
  stance.heading = heading_of(left, right, drive, e);
  stance.at = (left + right) / 2 - above_ground;
  stance.track = math::hypot((left - right).x(), (left - right).y());
  return stance;
}

// The steering range that the joints' limits allow.
double joint_limit(const Model& model, const DriveDescription& drive) {
  double limit = std::numeric_limits<double>::infinity();
  for (const ModelJointIndex joint : drive.steer_joints) {
    const JointAxis& axis = model.joints[joint].axis;
    limit = std::min({limit, std::abs(axis.lower), std::abs(axis.upper)});
  }
  if (std::isinf(limit) && drive.steering == Steering::tricycle) return kMostSteering_rad;
  return limit > 0 && !std::isinf(limit) ? limit : kUsualSteering_rad;
}

// Steered wheels: base_link is on the fixed axle, a wheelbase from the steered one.
void read_steered(const Element& e, const Model& model, const std::vector<ModelJointIndex>& wheels,
                  DriveDescription& drive, Stance& stance) {
  const Allowed positive = Allowed::positive(quantity::kLength);
  const std::vector<ModelJointIndex> fixed = not_steered(model, drive, wheels);
  const Vec3 steered = middle(model, drive.steer_joints);
  if (fixed.empty()) {
    const double wheelbase = e.number("ruedo:wheelbase", 0, positive);
    if (wheelbase == 0)
      e.fail("has no <ruedo:wheelbase>, and no wheel that is not steered to take it from");
    const Vec3 ahead = stance.heading * Vec3::UnitX();
    stance.at = Vec3(steered.x(), steered.y(), stance.at.z()) - wheelbase * ahead;
  } else {
    const Vec3 axle = middle(model, fixed);
    stance.at = {axle.x(), axle.y(), axle.z() - drive.wheel_radius};
  }
  const double ahead = (stance.heading.conjugate() * Vec3(steered - stance.at)).x();
  if (std::abs(ahead) < 1e-3)
    e.fail("the steered wheels are beside the fixed ones; they have to be ahead of them or behind");
  drive.wheelbase = std::copysign(e.number("ruedo:wheelbase", std::abs(ahead), positive), ahead);
  drive.max_steering_angle = std::min(
      e.number("ruedo:max_steering_angle", joint_limit(model, drive), positive), kMostSteering_rad);
  drive.max_steering_rate = e.number("ruedo:max_steering_rate", drive.max_steering_rate,
                                     Allowed::positive(quantity::kSpeed).or_infinite());
}

// The wheels of an omni drive: left and right only say on which side they lie.
void sort_by_side(const Model& model, const std::vector<ModelJointIndex>& wheels,
                  DriveDescription& drive) {
  const Pose X_BaseM = drive.X_MBase.inverse();
  drive.left_joints.clear();
  drive.right_joints.clear();
  for (const ModelJointIndex joint : wheels) {
    const bool left = (X_BaseM * model.joints[joint].X_MJ.translation).y() > 0;
    (left ? drive.left_joints : drive.right_joints).push_back(joint);
  }
}

// Distance from the rear to the front wheels of a mecanum drive, which are sorted by now; the mean
// of both sides.
double mecanum_wheelbase(const Element& e, const Model& model, const DriveDescription& drive) {
  const Pose X_BaseM = drive.X_MBase.inverse();
  const auto x = [&](ModelJointIndex joint) {
    return (X_BaseM * model.joints[joint].X_MJ.translation).x();
  };
  const double apart = (x(drive.left_joints[0]) - x(drive.left_joints[1]) +
                        x(drive.right_joints[0]) - x(drive.right_joints[1])) /
                       2;
  if (!(apart > 1e-6)) e.fail("the front and the rear wheels are in one place");
  return apart;
}

// The wheels of a car that is described without sides are left or right by where they are, along
// the axis of those that are not steered.
void split_sides(const Model& model, DriveDescription& drive) {
  if (drive.left_joints.empty() == drive.right_joints.empty()) return;
  std::vector<ModelJointIndex> wheels = drive.left_joints;
  wheels.insert(wheels.end(), drive.right_joints.begin(), drive.right_joints.end());
  const std::vector<ModelJointIndex> fixed = not_steered(model, drive, wheels);
  if (fixed.size() < 2) return;
  const Joint& first = model.joints[fixed[0]];
  Vec3 left = first.X_MJ.rotation * first.axis.axis_in_J;
  if (left.y() < 0) left = -left;
  const Vec3 center = middle(model, fixed);
  const auto aside = [&](ModelJointIndex joint) {
    return left.dot(model.joints[joint].X_MJ.translation - center);
  };
  constexpr double kInTheMiddle_m = 1e-3;
  const auto is_right = [&](ModelJointIndex joint) { return aside(joint) < -kInTheMiddle_m; };
  if (std::none_of(fixed.begin(), fixed.end(), is_right)) return;
  drive.left_joints.clear();
  drive.right_joints.clear();
  for (const ModelJointIndex joint : wheels)
    (is_right(joint) ? drive.right_joints : drive.left_joints).push_back(joint);
}

// base_link and what follows from it: track, wheelbase, the order of the wheels.
void place_base(const Element& e, const Model& model, DriveDescription& drive) {
  const Allowed positive = Allowed::positive(quantity::kLength);
  if (steers(drive)) split_sides(model, drive);
  std::vector<ModelJointIndex> wheels = drive.left_joints;
  wheels.insert(wheels.end(), drive.right_joints.begin(), drive.right_joints.end());
  Stance stance = stance_of(e, model, wheels, drive);
  if (steers(drive)) read_steered(e, model, wheels, drive, stance);
  drive.track = stance.track > 0
                    ? e.number("ruedo:track", stance.track, positive)
                    : e.number("ruedo:track", 0, Allowed::not_negative(quantity::kLength));
  if (drive.steering == Steering::tracked && drive.track == 0)
    e.fail("has no <ruedo:track>, and no wheels to take it from");
  drive.X_MBase = e.pose("ruedo:base", {stance.heading, stance.at});
  if (drive.steering == Steering::omni) sort_by_side(model, wheels, drive);
  sort_by_front(model, drive.X_MBase, drive.left_joints);
  sort_by_front(model, drive.X_MBase, drive.right_joints);
  if (drive.steering == Steering::mecanum)
    drive.wheelbase = e.number("ruedo:wheelbase", mecanum_wheelbase(e, model, drive), positive);
}

void read_limits(const Element& e, const Model& model, DriveDescription& drive) {
  const Allowed speed = Allowed::positive(quantity::kSpeed).or_infinite(),
                acceleration = Allowed::positive(quantity::kAcceleration).or_infinite(),
                effort = Allowed::positive(quantity::kEffort).or_infinite();
  drive.max_speed = e.number("ruedo:max_speed", drive.max_speed, speed);
  drive.max_side_speed = e.number("ruedo:max_side_speed", drive.max_speed, speed);
  drive.max_turn_rate = e.number("ruedo:max_turn_rate", drive.max_turn_rate, speed);
  drive.acceleration = e.number("ruedo:acceleration", drive.acceleration, acceleration);
  drive.deceleration = e.number("ruedo:deceleration", drive.acceleration, acceleration);
  drive.turn_acceleration =
      e.number("ruedo:turn_acceleration", drive.turn_acceleration, acceleration);
  double mass = 0;
  for (const Link& link : model.links) mass += link.inertial.mass;
  const bool wheels = drive.kind == DriveDescription::Kind::wheels;  // friction limits them
  drive.max_force =
      e.number("ruedo:max_force", wheels ? drive.max_force : mass * kStandardGravity, effort);
  drive.max_wheel_torque = e.number("ruedo:max_wheel_torque", drive.max_wheel_torque, effort);
  drive.max_wheel_rate = e.number("ruedo:max_wheel_rate", drive.max_wheel_rate, speed);
}

void read_servo(const Element& e, DriveDescription& drive) {
  const Allowed gain = Allowed::not_negative(quantity::kDamping);
  drive.servo_rate_gain = e.number("ruedo:servo_rate_gain", 0.0, gain);
  drive.servo_angle_gain = e.number("ruedo:servo_angle_gain", 0.0, gain);
  drive.gear = e.number("ruedo:gear", drive.gear, Allowed::positive(quantity::kFactor));
  drive.stall_torque = e.number("ruedo:stall_torque", drive.stall_torque,
                                Allowed::positive(quantity::kEffort).or_infinite());
  drive.no_load_rate = e.number("ruedo:no_load_rate", drive.no_load_rate,
                                Allowed::positive(quantity::kSpeed).or_infinite());
  drive.yaw_gain = e.number("ruedo:yaw_gain", 0.0, gain);
  drive.gyro_bias = e.number("ruedo:gyro_bias", 0.0, Allowed::any(quantity::kSpeed));
  drive.gyro_scale_error =
      e.number("ruedo:gyro_scale_error", 0.0, {.min = -1.0, .max = 1.0, .min_excluded = true});
}

// The sensor's own reader reads the rest, and reports what is wrong with these.
void read_odometry(const Element& odometry, DriveDescription& drive) {
  drive.odometry_rate = odometry.rate("ruedo:rate", drive.odometry_rate);
  if (const Element* errors = odometry.child("ruedo:radius_error")) {
    const std::vector<double> values = errors->as_numbers(Allowed::any(quantity::kFactor));
    for (size_t side : {0u, 1u}) {
      if (values.size() == 2 && values[side] > -1.0) drive.radius_error[side] = values[side];
    }
  }
  drive.track_error =
      odometry.number("ruedo:track_error", 0.0,
                      {.min = -1.0, .min_excluded = true, .quantity = &quantity::kFactor});
}

}  // namespace

std::string name_of(Steering steering) {
  for (const auto& [name, each] : steerings()) {
    if (each == steering) return name;
  }
  return "";
}

const std::vector<std::string>& drive_elements() {
  static const std::vector<std::string> names = {"ruedo:left_joint",
                                                 "ruedo:right_joint",
                                                 "ruedo:wheel_joint",
                                                 "ruedo:steer_joint",
                                                 "ruedo:wheel_radius",
                                                 "ruedo:track",
                                                 "ruedo:wheelbase",
                                                 "ruedo:max_steering_angle",
                                                 "ruedo:max_steering_rate",
                                                 "ruedo:base",
                                                 "ruedo:max_speed",
                                                 "ruedo:max_side_speed",
                                                 "ruedo:max_turn_rate",
                                                 "ruedo:acceleration",
                                                 "ruedo:deceleration",
                                                 "ruedo:turn_acceleration",
                                                 "ruedo:max_force",
                                                 "ruedo:max_wheel_torque",
                                                 "ruedo:max_wheel_rate",
                                                 "ruedo:watchdog",
                                                 "ruedo:pose_rate",
                                                 "ruedo:status_rate",
                                                 "ruedo:traction",
                                                 "ruedo:primitives",
                                                 "ruedo:servo_rate_gain",
                                                 "ruedo:servo_angle_gain",
                                                 "ruedo:gear",
                                                 "ruedo:stall_torque",
                                                 "ruedo:no_load_rate",
                                                 "ruedo:yaw_gain",
                                                 "ruedo:gyro_bias",
                                                 "ruedo:gyro_scale_error"};
  return names;
}

const std::vector<std::string>& odometry_elements() {
  static const std::vector<std::string> names = {
      "ruedo:rate",         "ruedo:integrator",     "ruedo:ticks_per_turn",
      "ruedo:counter_bits", "ruedo:radius_error",   "ruedo:track_error",
      "ruedo:slip_noise",   "ruedo:steering_error", "ruedo:phase"};
  return names;
}

namespace {

bool is_own_drive(const std::string& type) {
  const auto& kinds = drive_kinds();
  return std::any_of(kinds.begin(), kinds.end(),
                     [&](const DriveKind& kind) { return kind.type == type; });
}

std::string drive_types() {
  std::string all = "kinematic";
  for (const DriveKind& kind : drive_kinds()) all += ", " + kind.type;
  return all + ", wheels and none";
}

}  // namespace

DriveDescription read_drive(std::shared_ptr<const Element> element,
                            std::shared_ptr<const Element> odometry, const Model& model) {
  const Element& e = *element;
  DriveDescription drive;
  const std::string* type = e.attribute("type");
  const bool own = type && is_own_drive(*type);
  if (type && *type != "kinematic" && *type != "wheels" && !own)
    e.fail("type '" + *type + "' is not allowed; allowed are " + drive_types());
  e.refuse_unknown(drive_elements(), own);  // a plugin's drive reads children of its own
  if (type && *type == "wheels") drive.kind = DriveDescription::Kind::wheels;
  drive.steering = read_steering(e);
  read_joints(e, model, drive);
  if (drive.kind == DriveDescription::Kind::wheels &&
      (drive.steering == Steering::holonomic ||
       (drive.left_joints.empty() && drive.right_joints.empty()))) {
    e.fail("type 'wheels' is not allowed with steering '" + name_of(drive.steering) +
           "', which has no wheels that could drive it; allowed is kinematic");
  }
  if (drive.left_joints.empty() && drive.right_joints.empty()) {
    drive.wheel_radius =
        e.number("ruedo:wheel_radius", 0, Allowed::not_negative(quantity::kLength));
  } else {
    const auto& side = drive.left_joints.empty() ? drive.right_joints : drive.left_joints;
    const double found_radius = radius_of(model, model.joints[side[0]]);
    if (!e.has("ruedo:wheel_radius") && found_radius <= 0)
      e.fail("has no <ruedo:wheel_radius>, and the wheel has no collision shape to take it from");
    drive.wheel_radius =
        e.number("ruedo:wheel_radius", found_radius, Allowed::positive(quantity::kLength));
  }
  place_base(e, model, drive);
  read_limits(e, model, drive);
  drive.watchdog_us = microseconds(e.number("ruedo:watchdog", 0.6, Allowed::between(0, 1e6)));
  read_servo(e, drive);
  drive.traction = e.boolean("ruedo:traction", true);
  const bool wheels = drive.kind == DriveDescription::Kind::wheels;
  drive.on_odometry = e.choice("ruedo:primitives", wheels ? "odometry" : "truth",
                               {"truth", "odometry"}) == "odometry";
  if (drive.on_odometry && !wheels && drive.steering != Steering::differential) {
    e.child("ruedo:primitives")
        ->fail("'odometry' is not allowed with steering '" + name_of(drive.steering) +
               "'; allowed is truth");
  }
  if (own && drive.on_odometry)
    e.child("ruedo:primitives")
        ->fail("'odometry' is not allowed with a plugin's drive; allowed is truth");
  if (wheels && !drive.on_odometry)
    e.child("ruedo:primitives")
        ->fail(
            "'truth' is not allowed with the wheels drive, whose primitives end by odometry; "
            "allowed is odometry");
  drive.pose_rate = e.rate("ruedo:pose_rate", drive.pose_rate);
  drive.status_rate = e.rate("ruedo:status_rate", drive.status_rate);
  if (odometry) {
    odometry->refuse_unknown(odometry_elements(), false);
    read_odometry(*odometry, drive);
  }
  drive.element = std::move(element);
  drive.odometry = std::move(odometry);
  return drive;
}

namespace {

// Elements without a counterpart here, each once.
void name_plugin(const Element& plugin, const PluginKind& kind, const Model& model,
                 const std::string& where, Findings& findings, std::set<std::string>& named) {
  std::string text;
  if (kind.does == PluginKind::Does::unknown && names_wheels(plugin, model))
    return findings.repaired(
        plugin.source, where,
        "the plugin " + kind.name + " is not known; as it names wheels, it is read as a drive");
  if (kind.name == "WindEffects" || kind.name == "WindPlugin")
    text = "the plugin " + kind.name + " does nothing in a model: it belongs into <world>";
  if (kind.does == PluginKind::Does::dead)
    text = "the plugin " + kind.name + " does nothing here: " + kind.would;
  if (kind.name == "slotcar")
    text = "the paths of a fleet manager are not driven; ROBOT/velocity and ROBOT/move drive it";
  if (kind.does == PluginKind::Does::unknown) text = "plugins are not loaded: " + kind.name;
  if (!text.empty() && named.insert(text).second) findings.unsupported(plugin.source, where, text);
}

// A track that is not part of a vehicle: a conveyor, or one that is commanded on its own topic.
void name_lone_tracks(const std::vector<const Element*>& plugins, const Model& model,
                      const std::string& where, Findings& findings) {
  for (const Element* each : plugins) {
    if (kind_of(*each).name != "TrackController") continue;
    const std::string link = dotted(each->string("link", ""));
    const bool driven =
        model.drive && std::any_of(model.drive->belts.begin(), model.drive->belts.end(),
                                   [&](auto belt) { return model.links[belt].name == link; });
    if (!driven)
      findings.unsupported(each->source, where,
                           "the plugin TrackController has no effect here: its belt would follow "
                           "commands; <ruedo:belt> has a fixed velocity");
  }
}

bool looks_like_robot(const Element& model_element, const std::vector<const Element*>& plugins,
                      const Model& model) {
  if (model.is_static) return false;
  if (model_element.has("ruedo:joints") || model_element.has("transmission") ||
      model_element.has("ros2_control") || !model.sensors.empty())
    return true;
  return std::any_of(plugins.begin(), plugins.end(), [](const Element* each) {
    const auto does = kind_of(*each).does;
    return does == PluginKind::Does::control || does == PluginKind::Does::drive;
  });
}

// Joints that have a plugin of their own are not part of a drive.
bool is_turned_by_plugin(const std::vector<const Element*>& plugins, const std::string& joint) {
  return std::any_of(plugins.begin(), plugins.end(), [&](const Element* each) {
    if (kind_of(*each).does != PluginKind::Does::joints ||
        kind_of(*each).name.find("StatePublisher") != std::string::npos)
      return false;
    const auto names = each->all("joint_name");
    return std::any_of(names.begin(), names.end(),
                       [&](const Element* name) { return name->text == joint; });
  });
}

std::string joined(const std::vector<std::string>& names, const char* between) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : between) + name;
  return text;
}

// Null if what looked like wheels turns out not to be.
std::optional<DriveDescription> guessed_drive(std::unique_ptr<Element> guess,
                                              std::shared_ptr<const Element> odometry,
                                              const Model& model) {
  if (!guess) return std::nullopt;
  try {
    DriveDescription drive = read_drive(std::move(guess), std::move(odometry), model);
    drive.guessed = true;
    return drive;
  } catch (const InputError&) {
    return std::nullopt;
  }
}

// The drive of a robot that neither an element nor a drive plugin describes.
void find_drive(const Element& model_element, const std::vector<const Element*>& plugins,
                std::shared_ptr<const Element> odometry, const std::string& where,
                ReadContext& context, Model& model) {
  if (!looks_like_robot(model_element, plugins, model)) return;
  ControllersDrive controllers =
      drive_from_controllers(model_element, plugins, model, where, context);
  if (controllers.drive) {
    const Source source = controllers.drive->source;
    if (!odometry) odometry = std::move(controllers.odometry);
    try {
      model.drive = read_drive(std::move(controllers.drive), odometry, model);
      if (!controllers.named) {
        context.findings.repaired(source, where,
                                  "it drives as the controller " + controllers.controller +
                                      " says, which has its joints; no plugin names the file");
      }
      return;
    } catch (const InputError& error) {
      context.findings.error(
          error, where,
          "the controller " + controllers.controller + " cannot be used: " + error.message());
    }
  }
  if (!model.guess) return;
  GuessedDrive guess = guess_drive(model, controlled_joints(model_element));
  if (std::any_of(guess.wheels.begin(), guess.wheels.end(),
                  [&](const std::string& wheel) { return is_turned_by_plugin(plugins, wheel); }))
    return;
  const std::string flag = "--drive " + model.name + "=LEFT+...,RIGHT+...";
  model.drive = guessed_drive(std::move(guess.drive), odometry, model);
  if (model.drive) {
    context.findings.repaired(model_element.source, where,
                              std::string(kNoDriveIsWritten) + "; guessed from its wheels: " +
                                  guess.in_words + " (" + flag + " says it otherwise)");
    return;
  }
  if (!guess.wheels.empty()) {
    context.findings.unsupported(model_element.source, where,
                                 std::string(kNoDriveIsWritten) + ", and it stands still; " + flag +
                                     " makes it drive, with wheels of " +
                                     joined(guess.wheels, ", "));
  }
}

// The drive that a plugin describes, if it is a drive plugin.
void take_drive(const Element& plugin, const std::shared_ptr<const Element>& odometry,
                const std::string& where, Findings& findings, Model& model) {
  try {
    auto translated = drive_from_plugin(plugin, model, where, findings);
    if (!translated) return;
    if (model.drive)
      return findings.unsupported(plugin.source, where, "a second drive; the first one is used");
    const std::shared_ptr<const Element> of_plugin = odometry_from_plugin(plugin, where, findings);
    model.drive = read_drive(std::move(translated), odometry ? odometry : of_plugin, model);
    model.drive->belts = belts_from_plugin(plugin, model);
  } catch (const InputError& error) {
    findings.error(error, where, "the drive plugin cannot be used: " + error.message());
  }
}

}  // namespace

namespace {

// type="none": the model does not drive, whatever wheels and plugins it has.
bool is_none(const Element& drive) {
  const std::string* type = drive.attribute("type");
  if (!type || *type != "none") return false;
  if (!drive.children.empty())
    drive.children[0]->fail("is not allowed with type 'none', which has no elements");
  return true;
}

// <ruedo:joints/> says that the joints take commands; any URDF file's do, without saying so.
bool may_be_guessed(const Element& model_element) {
  const Element* joints = model_element.child("ruedo:joints");
  return !joints || joints->attribute(kImplied);
}

}  // namespace

void read_drive_of(const Element& model_element, const std::string& where, ReadContext& context,
                   Model& model) {
  std::vector<const Element*> plugins;
  collect_plugins(model_element, plugins);
  load_own_plugins(plugins);
  std::shared_ptr<const Element> odometry;
  if (const Element* written = model_element.child("ruedo:odometry")) odometry = written->clone();
  if (const auto drives = model_element.all("ruedo:drive"); !drives.empty()) {
    if (drives.size() > 1) drives[1]->fail("a second drive; a model has one");
    model.guess = !is_none(*drives[0]);
    if (model.guess) model.drive = read_drive(drives[0]->clone(), odometry, model);
  } else {
    model.guess = may_be_guessed(model_element);
  }
  std::set<std::string> named;
  for (const Element* plugin : plugins) {
    const PluginKind kind = kind_of(*plugin);
    model.commanded |=
        kind.does == PluginKind::Does::joints || kind.does == PluginKind::Does::control;
    name_plugin(*plugin, kind, model, where, context.findings, named);
    name_parameters(*plugin, where, context.findings);
    if (!model_element.has("ruedo:drive"))  // Ruedo's own element takes precedence
      take_drive(*plugin, odometry, where, context.findings, model);
  }
  name_lone_tracks(plugins, model, where, context.findings);
  if (!model.drive && !model_element.has("ruedo:drive"))
    find_drive(model_element, plugins, odometry, where, context, model);
  name_odd_drive(model_element, model, where, context.findings);
  if (!model.is_static) {
    read_holds(plugins, where, context.findings, model);
    read_joint_plugins(plugins, where, context.findings, model);
    read_lifts(plugins, where, context.findings, model);
    read_ros_gains(model_element, plugins, where, context, model);
    read_joint_interfaces(model_element, where, context.findings, model);
  }
  if (odometry && !model.drive)
    model_element.child("ruedo:odometry")->fail("needs a drive: the model has no <ruedo:drive>");
  if (odometry && model.drive &&
      !model.drive->odometry) {  // a nested model's drive, odometry given here
    odometry->refuse_unknown(odometry_elements(), false);
    read_odometry(*odometry, *model.drive);
    model.drive->odometry = odometry;
  }
}

}  // namespace ruedo::world
