// The drive plugins of Gazebo Classic and gz-sim, as the <ruedo:drive> that says the same.
//
// Names of parameters are those of the plugins' own documentation; each plugin has had several spellings.
#include <algorithm>
#include <cctype>
#include <cmath>

#include "model/drive.h"

namespace ruedo::model {
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
    {"max_linear_velocity", "ruedo:max_speed"},
    {"max_velocity", "ruedo:max_speed"},
    {"max_angular_velocity", "ruedo:max_turn_rate"},
    {"max_linear_acceleration", "ruedo:acceleration"},
    {"max_acceleration", "ruedo:acceleration"},
    {"max_wheel_acceleration", "ruedo:acceleration"},
    {"wheelAcceleration", "ruedo:acceleration"},
    {"min_linear_acceleration", "ruedo:deceleration", Unit::magnitude},
    {"min_acceleration", "ruedo:deceleration", Unit::magnitude},
    {"max_angular_acceleration", "ruedo:turn_acceleration"},
    {"max_wheel_torque", "ruedo:max_wheel_torque"},
    {"wheelTorque", "ruedo:max_wheel_torque"},
    {"torque", "ruedo:max_wheel_torque"},
    {"MaxForce", "ruedo:max_wheel_torque"},
};

constexpr const char* kLeft[] = {"left_joint", "leftJoint", "left_front", "leftFrontJoint", "left_rear", "leftRearJoint"};
constexpr const char* kRight[] = {"right_joint", "rightJoint", "right_front", "rightFrontJoint", "right_rear", "rightRearJoint"};

bool is_one_of(const Element& plugin, std::initializer_list<const char*> known) {
  std::string name;
  for (const char* key : {"filename", "name"}) {
    if (const std::string* value = plugin.attribute(key)) name += *value + " ";
  }
  for (char& c : name) c = c == '-' || c == '_' ? ' ' : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return std::any_of(known.begin(), known.end(), [&](const char* each) { return name.find(each) != std::string::npos; });
}

bool is_drive(const Element& plugin) {
  return is_one_of(plugin, {"gazebo ros diff drive", "diffdriveplugin", "diff drive system", "systems::diffdrive", "skidsteerdriveplugin",
                            "skid steer drive"});
}

void add(Element& drive, const char* name, const std::string& text, const Source& source) {
  auto child = std::make_unique<Element>();
  child->name = name;
  child->text = text;
  child->source = source;
  drive.children.push_back(std::move(child));
}

}  // namespace

bool commands_joints(const Element& plugin) {
  return is_one_of(plugin, {"joint controller", "joint position controller", "joint trajectory controller", "joint state publisher",
                            "joint pose trajectory", "ros control", "ros2 control"});
}

const char* unsupported_drive(const Element& plugin) {
  if (is_one_of(plugin, {"ackermann"})) return "an Ackermann drive is not supported, only differential ones are: the robot stands still";
  if (is_one_of(plugin, {"mecanum", "omni", "planar move", "tricycle"})) {
    return "an omnidirectional or tricycle drive is not supported, only differential ones are: the robot stands still";
  }
  return nullptr;
}

std::unique_ptr<Element> drive_from_plugin(const Element& plugin) {
  if (!is_drive(plugin)) return nullptr;
  auto drive = std::make_unique<Element>();
  drive->name = "ruedo:drive";
  drive->source = plugin.source;
  for (const char* name : kLeft) {
    for (const Element* joint : plugin.all(name)) add(*drive, "ruedo:left_joint", joint->text, joint->source);
  }
  for (const char* name : kRight) {
    for (const Element* joint : plugin.all(name)) add(*drive, "ruedo:right_joint", joint->text, joint->source);
  }
  for (const Parameter& each : kParameters) {
    const Element* given = plugin.child(each.theirs);
    if (!given || drive->has(each.ours)) continue;
    double value = given->as_number();
    if (each.unit == Unit::half) value /= 2;
    if (each.unit == Unit::magnitude) value = std::abs(value);
    if (value > 0) add(*drive, each.ours, shown(value), given->source);    // 0: the plugins' "no limit"
  }
  return drive;
}

}  // namespace ruedo::model
