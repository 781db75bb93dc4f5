// Translates the drive plugins of Gazebo Classic and gz-sim to <ruedo:drive>.
//
// Names of parameters are those of the plugins' own documentation; each plugin has had several
// spellings.
#include <algorithm>
#include <cmath>
#include <string_view>

#include "base/text.h"
#include "world/compat/plugins.h"
#include "world/drives/drive.h"
#include "world/drives/drive_guess.h"

namespace ruedo::world {
namespace {

enum class Unit { as_is, half, magnitude };

struct Parameter {
  const char* theirs;
  const char* ours;
  Unit unit = Unit::as_is;
};

// In order of preference: the first that is given counts.
constexpr Parameter kParameters[] = {
    {"wheel_radius", "ruedo:wheel_radius"},
    {"wheel_diameter", "ruedo:wheel_radius", Unit::half},
    {"wheelDiameter", "ruedo:wheel_radius", Unit::half},
    {"wheel_separation", "ruedo:track"},
    {"wheelSeparation", "ruedo:track"},
    {"tracks_separation", "ruedo:track"},
    {"wheel_base", "ruedo:wheelbase"},
    {"wheelbase", "ruedo:wheelbase"},
    {"steering_limit", "ruedo:max_steering_angle"},
    {"max_steer", "ruedo:max_steering_angle"},
    {"max_linear_velocity", "ruedo:max_speed"},
    {"linear_velocity/max_velocity", "ruedo:max_speed"},
    {"max_velocity", "ruedo:max_speed"},
    {"max_speed", "ruedo:max_speed"},
    {"max_angular_velocity", "ruedo:max_turn_rate"},
    {"angular_velocity/max_velocity", "ruedo:max_turn_rate"},
    {"max_velocity", "ruedo:max_turn_rate"},  // gz-sim's limit applies to both
    {"max_linear_acceleration", "ruedo:acceleration"},
    {"linear_velocity/max_acceleration", "ruedo:acceleration"},
    {"max_acceleration", "ruedo:acceleration"},
    {"max_wheel_acceleration", "ruedo:acceleration"},
    {"wheelAcceleration", "ruedo:acceleration"},
    {"min_linear_acceleration", "ruedo:deceleration", Unit::magnitude},
    {"linear_velocity/min_acceleration", "ruedo:deceleration", Unit::magnitude},
    {"min_acceleration", "ruedo:deceleration", Unit::magnitude},
    {"max_angular_acceleration", "ruedo:turn_acceleration"},
    {"angular_velocity/max_acceleration", "ruedo:turn_acceleration"},
    {"max_acceleration", "ruedo:turn_acceleration"},
    {"max_wheel_torque", "ruedo:max_wheel_torque"},
    {"wheelTorque", "ruedo:max_wheel_torque"},
    {"torque", "ruedo:max_wheel_torque"},
    {"MaxForce", "ruedo:max_wheel_torque"},
};

// Below 0, one of these would turn the robot's motion round.
bool is_length(std::string_view ours) {
  return ours == "ruedo:wheel_radius" || ours == "ruedo:track" || ours == "ruedo:wheelbase";
}

std::string not_allowed(const Element& given, const Element& plugin, const char* allowed) {
  return "<" + given.name + "> of the plugin " + kind_of(plugin).name + ": '" + given.text +
         "' is not allowed; allowed is " + allowed;
}

struct Joints {
  const char* ours;
  std::initializer_list<const char*> theirs;
};

const Joints kJoints[] = {
    {"ruedo:left_joint",
     {"left_joint", "leftJoint", "left_front", "leftFrontJoint", "left_rear", "leftRearJoint",
      "front_left_joint", "back_left_joint", "rear_left_joint", "rearLeftJoint", "frontLeftJoint",
      "leftMiddleJoint", "frontLeftWheelJoint", "rearLeftWheelJoint", "left_wheel_joint",
      "left_wheel_joint_name", "leftWheelJoint", "left_joint_name"}},
    {"ruedo:right_joint",
     {"right_joint", "rightJoint", "right_front", "rightFrontJoint", "right_rear", "rightRearJoint",
      "front_right_joint", "back_right_joint", "rear_right_joint", "rearRightJoint",
      "frontRightJoint", "rightMiddleJoint", "frontRightWheelJoint", "rearRightWheelJoint",
      "right_wheel_joint", "right_wheel_joint_name", "rightWheelJoint", "right_joint_name"}},
    {"ruedo:steer_joint",
     {"left_steering_joint", "right_steering_joint", "steeringJoint", "steering_joint",
      "leftHingeJoint", "rightHingeJoint"}},
};

struct Steered {
  const char* plugin;
  const char* steering;
};

constexpr Steered kSteering[] = {
    {"MecanumDrive", "mecanum"},
    {"gazebo_ros_mecanum", "mecanum"},
    {"AckermannSteering", "ackermann"},
    {"gazebo_ros_ackermann_drive", "ackermann"},
    {"gazebo_ros_tricycle_drive", "tricycle"},
    {"TrackedVehicle", "tracked"},
    {"SimpleTrackedVehiclePlugin", "tracked"},
    {"VelocityControl", "holonomic"},
    {"gazebo_ros_planar_move", "holonomic"},
    {"gazebo_ros_force_based_move", "holonomic"},
    {"hector_gazebo_ros_force_based_move", "holonomic"},
    {"ridgeback_ros_force_based_move", "holonomic"},
};

void add(Element& drive, const char* name, const std::string& text, const Source& source) {
  auto child = std::make_unique<Element>();
  child->name = name;
  child->text = text;
  child->source = source;
  drive.children.push_back(std::move(child));
}

bool is_joint_of(const Element& named, const Model& model) {
  return std::any_of(model.joints.begin(), model.joints.end(),
                     [&](const Joint& joint) { return joint.name == dotted(named.text); });
}

// RMF's robots that follow lanes: names of joints and numbers are the plugin's own.
void add_slotcar(const Element& plugin, const Model& model, Element& drive) {
  struct Given {
    const char *theirs, *ours;
    double usual;
  };
  constexpr Given kAll[] = {
      {"tire_radius", "ruedo:wheel_radius", 0.1},
      {"base_width", "ruedo:track", 0.52},
      {"nominal_drive_speed", "ruedo:max_speed", 0.5},
      {"nominal_drive_acceleration", "ruedo:acceleration", 0.05},
      {"max_drive_acceleration", "ruedo:deceleration", 0.1},
      {"nominal_turn_speed", "ruedo:max_turn_rate", M_PI / 8},
      {"nominal_turn_acceleration", "ruedo:turn_acceleration", M_PI / 10},
  };
  for (const Given& each : kAll) {
    const double value =
        plugin.number(each.theirs, each.usual, Allowed::positive(quantity::kSpeed));
    const Element* given = plugin.child(each.theirs);
    add(drive, each.ours, shown(value), given ? given->source : plugin.source);
  }
  const auto has = [&](const char* name) {
    return std::any_of(model.joints.begin(), model.joints.end(),
                       [&](const Joint& joint) { return joint.name == name; });
  };
  if (has("joint_tire_left") && has("joint_tire_right")) {
    add(drive, "ruedo:left_joint", "joint_tire_left", plugin.source);
    add(drive, "ruedo:right_joint", "joint_tire_right", plugin.source);
  } else {  // in gz-sim they move as a whole
    drive.attributes.emplace_back("steering", "tracked");
  }
}

}  // namespace

std::vector<ModelLinkIndex> belts_from_plugin(const Element& plugin, const Model& model) {
  std::vector<ModelLinkIndex> belts;
  const auto take = [&](const std::string& name) {
    for (const ModelLinkIndex i : model.links.indices()) {
      if (model.links[i].name == dotted(name)) belts.push_back(i);
    }
  };
  const std::string kind = kind_of(plugin).name;
  if (kind != "TrackedVehicle" && kind != "SimpleTrackedVehiclePlugin") return belts;
  for (const char* side : {"left_track", "right_track", "left_flipper", "right_flipper"}) {
    for (const Element* track : plugin.all(side)) {
      if (!track->text.empty()) take(track->text);
      for (const Element* link : track->all("link")) take(link->text);
    }
  }
  return belts;
}

bool names_wheels(const Element& plugin, const Model& model) {
  const auto names = [&](const Joints& side) {
    return std::any_of(side.theirs.begin(), side.theirs.end(), [&](const char* name) {
      const Element* joint = plugin.child(name);
      return joint && is_joint_of(*joint, model);
    });
  };
  return names(kJoints[0]) && names(kJoints[1]);
}

std::unique_ptr<Element> odometry_from_plugin(const Element& plugin, const std::string& where,
                                              Findings& findings) {
  for (const char* name : {"odom_publish_frequency", "update_rate", "odometryRate", "updateRate"}) {
    const Element* rate = plugin.child(name);
    // Gazebo's limit; higher rates than the step rate have no effect
    constexpr double kMost_hz = 1000.0;
    const double hz = rate ? rate->as_number(Allowed::any(quantity::kRange)) : 0.0;
    if (hz < 0.0 || hz > kMost_hz)
      findings.error(rate->source, where,
                     not_allowed(*rate, plugin, "0 to 1000; the usual rate is taken"));
    if (!(hz > 0.0) || hz > kMost_hz) continue;
    auto odometry = std::make_unique<Element>();
    odometry->name = "ruedo:odometry";
    odometry->source = rate->source;
    add(*odometry, "ruedo:rate", rate->text, rate->source);
    return odometry;
  }
  return nullptr;
}

namespace {

bool is_speed(std::string_view ours) {
  return ours == "ruedo:max_speed" || ours == "ruedo:max_turn_rate";
}

// In our unit; 0 means "no limit" in most plugins, and a limit below 0 nothing.
double value_of(const Element& given, const Parameter& parameter, const Element& plugin,
                const std::string& where, Findings& findings) {
  if (is_length(parameter.ours)) {
    const double length = given.as_number(Allowed::not_negative(quantity::kEffort));
    if (length == 0)
      findings.error(given.source, where,
                     not_allowed(given, plugin, "a number above 0; it is measured instead"));
    return parameter.unit == Unit::half ? length / 2 : length;
  }
  const double value = given.as_number(Allowed::any(quantity::kEffort));
  if (parameter.unit == Unit::magnitude) {
    if (value > 0)
      findings.repaired(given.source, where,
                        not_allowed(given, plugin, "a number of at most 0; its magnitude counts"));
    return std::abs(value);
  }
  if (value < 0)
    findings.error(given.source, where,
                   not_allowed(given, plugin, "a number of at least 0; there is no limit"));
  // gz-sim would keep such a robot where it is.
  if (value == 0 && is_speed(parameter.ours))
    findings.repaired(given.source, where,
                      not_allowed(given, plugin, "a number above 0; there is no limit"));
  return value;
}

void add_parameters(const Element& plugin, const std::string& where, Findings& findings,
                    Element& drive) {
  for (const Parameter& each : kParameters) {
    const Element* given = plugin.child(each.theirs);
    if (!given) continue;
    for (const Element* other : plugin.all(each.theirs)) {
      if (other->text != given->text)  // plugins with several pairs of wheels repeat them
        findings.unsupported(other->source, where,
                             "a second <" + given->name + "> of the plugin " +
                                 kind_of(plugin).name + " is left out; the first one counts");
    }
    const double value = value_of(*given, each, plugin, where, findings);
    const Element* before = drive.child(each.ours);
    if (before && is_length(each.ours) && before->text != shown(value))
      findings.unsupported(given->source, where,
                           "<" + given->name + "> of the plugin " + kind_of(plugin).name +
                               " is left out: another parameter says something else");
    if (!before && value > 0) add(drive, each.ours, shown(value), given->source);
  }
}

// Why the wheel of a named joint does not carry the model; "" if it does.
std::string lifts(const Element& named, const Model& model) {
  constexpr double kStands_m = 5e-3;
  const auto joint = std::find_if(model.joints.begin(), model.joints.end(), [&](const Joint& each) {
    return each.name == dotted(named.text);
  });
  if (joint == model.joints.end()) return "there is no joint '" + named.text + "'";
  if (lowest_point_below(model, ModelJointIndex(joint - model.joints.begin())) <
      lowest_point(model) + kStands_m)
    return "";
  return "the wheel of the joint '" + named.text + "' does not reach the ground";
}

// A plugin that sets the model's velocity needs no wheels, and may name some that do not carry it.
void leave_out_lifted_wheels(const Model& model, const std::string& where, Findings& findings,
                             Element& drive) {
  std::erase_if(drive.children, [&](const auto& child) {
    const std::string why = child->name.ends_with("_joint") ? lifts(*child, model) : "";
    if (why.empty()) return false;
    findings.repaired(child->source, where, why + ": the drive moves the model without it");
    return true;
  });
}

}  // namespace

std::unique_ptr<Element> drive_from_plugin(const Element& plugin, const Model& model,
                                           const std::string& where, Findings& findings) {
  const PluginKind kind = kind_of(plugin);
  const bool alike = kind.does == PluginKind::Does::unknown && names_wheels(plugin, model);
  if (kind.does != PluginKind::Does::drive && !alike) return nullptr;
  // A plugin that only sets something in motion, like an obstacle, takes no ground commands.
  if (kind.name == "VelocityControl" &&
      (plugin.has("initial_linear") || plugin.has("initial_angular")))
    return nullptr;
  auto drive = std::make_unique<Element>();
  drive->name = "ruedo:drive";
  drive->source = plugin.source;
  const auto steered = std::find_if(std::begin(kSteering), std::end(kSteering),
                                    [&](const Steered& each) { return each.plugin == kind.name; });
  if (kind.name == "slotcar") {
    add_slotcar(plugin, model, *drive);
    return drive;
  }
  if (steered != std::end(kSteering)) drive->attributes.emplace_back("steering", steered->steering);
  for (const Joints& each : kJoints) {
    for (const char* name : each.theirs) {
      for (const Element* joint : plugin.all(name))
        add(*drive, each.ours, joint->text, joint->source);
    }
  }
  if (steered != std::end(kSteering) && steered->steering == std::string_view("holonomic"))
    leave_out_lifted_wheels(model, where, findings, *drive);
  if (alike) {
    const bool mecanum = kind.name.find("mecanum") != std::string::npos;
    if (mecanum || drive->has("ruedo:steer_joint"))
      drive->attributes.emplace_back("steering", mecanum ? "mecanum" : "ackermann");
  }
  add_parameters(plugin, where, findings, *drive);
  return drive;
}

}  // namespace ruedo::world
