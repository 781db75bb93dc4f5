// Parameters of controllers that drive a robot. Names and defaults follow the controllers'
// documentation.
#include "world/compat/ros_control.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <string_view>

#include "base/text.h"
#include "ruedo/math.h"
#include "world/compat/ros_controllers.h"

namespace fs = std::filesystem;

namespace ruedo::world {
namespace {

bool contains(std::string_view text, std::string_view part) {
  return text.find(part) != std::string_view::npos;
}

struct Translation {
  const Controller& from;
  const Model& model;
  Element& drive;
  std::vector<const Element*> missing = {};  // of the drive: joints that the model does not have
  std::vector<const Element*> zeros = {};    // sizes and factors of 0

  void add(const char* name, const std::string& text, const Source& source) {
    drive.children.push_back(std::make_unique<Element>());
    Element& child = *drive.children.back();
    child.name = name;
    child.text = text;
    child.source = source;
  }

  // "$(arg prefix)wheel" is the joint of that name, or the only one with something before it.
  std::string named(const std::string& written) const {
    const std::string joint = without_arguments(written);
    if (joint.empty() || joint == written) return joint;
    std::string found;
    for (const Joint& each : model.joints) {
      if (each.name == joint) return joint;
      if (!each.name.ends_with(joint)) continue;
      if (!found.empty()) return joint;
      found = each.name;
    }
    return found.empty() ? joint : found;
  }

  void joints(const char* ours, std::initializer_list<const char*> theirs) {
    for (const char* name : theirs) {
      const Element* list = parameter(from, {name});
      for (const std::string& written : names_in(list)) {
        const std::string joint = named(written);
        const bool known =
            std::any_of(model.joints.begin(), model.joints.end(),
                        [&](const Joint& each) { return each.name == dotted(joint); });
        add(ours, joint, list->source);
        if (!known) missing.push_back(drive.children.back().get());
      }
    }
  }

  void number(const char* ours, std::initializer_list<const char*> theirs, double factor = 1.0) {
    for (const char* name : theirs) {
      const Element* written = parameter(from, {name});
      if (const auto value = size(written))
        return add(ours, shown(*value * factor), written->source);
    }
  }

  // Of a length or factor, which no wheel has at 0.
  std::optional<double> size(const Element* written) {
    const auto value = positive(written);
    if (written && !value && !is_nan(written->text)) zeros.push_back(written);
    return value;
  }

  void limit(const char* ours, const char* theirs) {
    const Element* written = parameter(from, {theirs});
    if (const auto value = limit_in(written)) add(ours, shown(*value), written->source);
  }

  // A limit in ROS: with a switch in early generations, without in later ones. Those that brake or
  // are for driving backwards are below 0.
  void limit(const char* ours, const std::string& axis, const char* kind,
             std::initializer_list<const char*> names) {
    const Element* has = parameter(from, {(axis + ".has_" + kind + "_limits").c_str()});
    if (has && !is_true(has)) return;
    for (const char* name : names) {
      const Element* written = parameter(from, {(axis + "." + name).c_str()});
      const bool below = contains(name, "min_") || contains(name, "deceleration");
      if (const auto value = limit_in(written, below))
        return add(ours, shown(*value), written->source);
    }
  }

  double multiplier(std::initializer_list<const char*> names) {
    return size(parameter(from, names)).value_or(1.0);
  }

  // The distance between the middles of the two sides' wheels, as the ROS 1 controllers measure it
  // if it is not given.
  double separation() const {
    const auto middle = [&](const char* side) {
      Vec3 sum = Vec3::Zero();
      const auto all = drive.all(side);
      for (const Element* each : all) {
        for (const Joint& joint : model.joints) {
          if (joint.name == dotted(each->text))
            sum += joint.X_MJ.translation / static_cast<double>(all.size());
        }
      }
      return sum;
    };
    const Vec3 across = middle("ruedo:left_joint") - middle("ruedo:right_joint");
    return math::hypot(across.x(), across.y());
  }

  void limits() {
    limit("ruedo:max_speed", "linear.x", "velocity", {"max_velocity"});
    limit("ruedo:acceleration", "linear.x", "acceleration", {"max_acceleration"});
    limit("ruedo:deceleration", "linear.x", "acceleration",
          {"max_deceleration", "min_acceleration"});
    limit("ruedo:max_side_speed", "linear.y", "velocity", {"max_velocity"});
    limit("ruedo:max_turn_rate", "angular.z", "velocity", {"max_velocity"});
    limit("ruedo:turn_acceleration", "angular.z", "acceleration", {"max_acceleration"});
    const Element* timeout =
        parameter(from, {"cmd_vel_timeout", "reference_timeout", "command_timeout"});
    if (timeout)
      add("ruedo:watchdog", shown(limit_in(timeout).value_or(0.0)), timeout->source);
    else
      add("ruedo:watchdog", "0.5", from.source);  // the controllers' own default
  }
};

using Read = void (*)(Translation&);

// Of steer_bot_hardware_gazebo, which moves a car's wheels with the two joints of its controller.
constexpr const char* kWheelsOfSteerBot = "virtual_rear_wheels";

void differential(Translation& t) {
  t.joints("ruedo:left_joint", {"left_wheel", "left_wheel_names"});
  t.joints("ruedo:right_joint", {"right_wheel", "right_wheel_names"});
  t.number("ruedo:wheel_radius", {"wheel_radius"},
           t.multiplier({"wheel_radius_multiplier", "left_wheel_radius_multiplier"}));
  const double wider = t.multiplier({"wheel_separation_multiplier"});
  t.number("ruedo:track", {"wheel_separation"}, wider);
  if (!t.drive.has("ruedo:track"))
    t.add("ruedo:track", shown(t.separation() * wider), t.from.source);
}

void mecanum(Translation& t) {
  t.drive.attributes.emplace_back("steering", "mecanum");
  t.joints("ruedo:left_joint",
           {"front_left_wheel_command_joint_name", "rear_left_wheel_command_joint_name",
            "front_left_wheel_joint", "back_left_wheel_joint"});
  t.joints("ruedo:right_joint",
           {"front_right_wheel_command_joint_name", "rear_right_wheel_command_joint_name",
            "front_right_wheel_joint", "back_right_wheel_joint"});
  t.number("ruedo:wheel_radius", {"kinematics.wheels_radius", "wheel_radius"},
           t.multiplier({"wheel_radius_multiplier"}));
  t.number("ruedo:track", {"wheel_separation_y"});
  t.number("ruedo:wheelbase", {"wheel_separation_x"});
  // Half the wheelbase plus half the track, as a single parameter.
  const Element* arm = parameter(t.from, {"kinematics.sum_of_robot_center_projection_on_X_Y_axis"});
  if (const auto sum = positive(arm)) {
    const double track = t.separation();
    t.add("ruedo:track", shown(track), arm->source);
    t.add("ruedo:wheelbase", shown(std::max(2 * *sum - track, 1e-6)), arm->source);
  }
}

void omni(Translation& t) {
  t.drive.attributes.emplace_back("steering", "omni");
  t.joints("ruedo:left_joint", {"wheel_names"});
  t.number("ruedo:wheel_radius", {"wheel_radius"});
}

void car(Translation& t) {
  if (parameter(t.from, {kWheelsOfSteerBot})) {  // the controller's own joints carry nothing
    t.joints("ruedo:left_joint", {kWheelsOfSteerBot, "virtual_front_wheels"});
    t.joints("ruedo:steer_joint", {"virtual_front_steers"});
  } else {
    t.joints("ruedo:left_joint",
             {"rear_wheel", "rear_wheels_names", "traction_joints_names", "traction_joint_name"});
    t.joints("ruedo:steer_joint",
             {"front_steer", "front_wheels_names", "steering_joints_names", "steering_joint_name"});
  }
  if (const Element* front = parameter(t.from, {"front_steering"}); front && !is_true(front)) {
    std::erase_if(t.drive.children, [](const auto& child) {
      return child->name == "ruedo:left_joint" || child->name == "ruedo:steer_joint";
    });
    t.joints("ruedo:left_joint", {"front_wheels_names"});
    t.joints("ruedo:steer_joint", {"rear_wheels_names"});
  }
  const bool two = t.drive.all("ruedo:steer_joint").size() > 1;
  t.drive.attributes.emplace_back("steering", two ? "ackermann" : "tricycle");
  t.number("ruedo:wheelbase", {"wheelbase", "wheel_separation_h"},
           t.multiplier({"wheel_separation_h_multiplier"}));
  t.number("ruedo:track",
           {"traction_track_width", "rear_wheel_track", "wheel_track", "wheel_separation"});
  t.number("ruedo:wheel_radius", {"traction_wheels_radius", "rear_wheels_radius", "wheel_radius"},
           t.multiplier({"wheel_radius_multiplier"}));
  t.limit("ruedo:max_steering_angle", "steering.max_position");
  t.limit("ruedo:max_steering_rate", "steering.max_velocity");
  t.limit("ruedo:max_speed", "traction.max_velocity");
}

struct KnownType {
  const char* in_type;
  Read read;  // null: it drives nothing; its joints take commands, or a part of Ruedo replaces it
};

// Order matters: "tricycle_steering_controller" contains "steering_controller".
constexpr KnownType kTypes[] = {
    {"diff_drive_controller", differential},
    {"DiffDriveController", differential},
    {"mecanum_drive_controller", mecanum},
    {"MecanumDriveController", mecanum},
    {"omni_wheel_drive", omni},
    {"OmniWheelDrive", omni},
    {"ackermann", car},
    {"bicycle_steering", car},
    {"tricycle", car},
    {"joint_state", nullptr},
    {"JointState", nullptr},
    {"JointTrajectory", nullptr},
    {"joint_trajectory", nullptr},
    {"position_controllers", nullptr},
    {"velocity_controllers", nullptr},
    {"effort_controllers", nullptr},
    {"forward_command_controller", nullptr},
    {"gripper", nullptr},
    {"Gripper", nullptr},
    {"imu_sensor", nullptr},
    {"pid_controller", nullptr},
};

const KnownType* known_type(const std::string& type) {
  const auto found = std::find_if(std::begin(kTypes), std::end(kTypes), [&](const KnownType& each) {
    return type.find(each.in_type) != std::string::npos;
  });
  return found == std::end(kTypes) ? nullptr : found;
}

std::string suggested(const std::string& type) {
  const std::string near = mistyped(type);
  return near.empty() ? "" : "; did you mean '" + near + "'?";
}

void name_type(const Controller& controller, const std::string& where, Findings& findings) {
  const KnownType* known = known_type(controller.type);
  if (known && mistyped(controller.type).empty()) return;
  std::string text =
      "controllers of type '" + controller.type + "' are not known; '" + controller.name + "' ";
  text += !known        ? "does nothing"
          : known->read ? "drives as its name says"
                        : "is taken as its name says";
  findings.unsupported(controller.source, where, text + suggested(controller.type));
}

// Where findings about files that plugins name go.
struct Report {
  const std::string& where;
  Findings& findings;
  bool is_named;

  void error(const Source& source, const std::string& text) const {
    if (is_named) findings.error(source, where, text);
  }
  void error(const InputError& caught, const std::string& text) const {
    if (is_named) findings.error(caught, where, text);
  }
};

void name_zeros(const Translation& translation, const Report& report) {
  for (const Element* zero : translation.zeros)
    report.findings.error(zero->source, report.where,
                          "controller '" + translation.from.name + "': " + zero->name + " '" +
                              zero->text +
                              "' is not allowed; allowed is a number above 0; it counts as if it "
                              "was not there");
}

// The drive that a controller describes; null: it describes none, or one of other joints.
std::unique_ptr<Element> drive_of(const Controller& controller, const Model& model,
                                  const Report& report) {
  const KnownType* type = known_type(controller.type);
  if (!type || !type->read) return nullptr;
  auto drive = std::make_unique<Element>();
  drive->name = "ruedo:drive";
  drive->source = controller.source;
  Translation translation{controller, model, *drive};
  type->read(translation);
  for (const Element* joint : translation.missing)
    report.error(joint->source, unknown_joint(controller, joint->text));
  if (!translation.missing.empty()) return nullptr;
  if (!drive->has("ruedo:left_joint")) {
    report.error(controller.source, "controller '" + controller.name + "' of type '" +
                                        controller.type + "' names no wheels: it drives nothing");
    return nullptr;
  }
  name_zeros(translation, report);
  translation.limits();
  return drive;
}

// The nearest rate of a SampleClock: an odd rate must not stop the robot.
std::optional<double> rate_of(const Element& written, const std::string& where,
                              Findings& findings) {
  constexpr double kFastest_hz = 1e6, kParts = 1e9;
  try {
    const auto hz = limit_in(&written);
    if (!hz) return std::nullopt;
    const double near = std::clamp(std::round(*hz * kParts) / kParts, 1 / kParts, kFastest_hz);
    if (near != *hz)
      findings.repaired(
          written.source, where,
          "<" + written.name + ">: '" + written.text +
              "' is not a rate: allowed are at most nine decimals and 1000000 Hz; it is " +
              shown(near));
    return near;
  } catch (const InputError& error) {
    findings.error(error, where, error.message() + "; odometry has its usual rate");
    return std::nullopt;
  }
}

std::unique_ptr<Element> odometry_of(const Controller& controller, const std::string& where,
                                     Findings& findings) {
  const Element* rate = parameter(controller, {"publish_rate", "odom_publish_rate"});
  const auto hz = rate ? rate_of(*rate, where, findings) : std::nullopt;
  if (!hz) return nullptr;
  auto odometry = std::make_unique<Element>();
  odometry->name = "ruedo:odometry";
  odometry->source = rate->source;
  odometry->children.push_back(std::make_unique<Element>());
  Element& child = *odometry->children.back();
  child.name = "ruedo:rate";
  child.text = shown(*hz);
  child.source = rate->source;
  return odometry;
}

// Drive parameters that are supported, or that do not concern motion or odometry.
constexpr std::string_view kDone =
    "type left_wheel right_wheel left_wheel_names right_wheel_names wheel_radius wheel_separation "
    "wheel_radius_multiplier left_wheel_radius_multiplier right_wheel_radius_multiplier "
    "wheel_separation_multiplier front_left_wheel_command_joint_name "
    "rear_left_wheel_command_joint_name front_right_wheel_command_joint_name "
    "rear_right_wheel_command_joint_name front_left_wheel_joint back_left_wheel_joint "
    "front_right_wheel_joint back_right_wheel_joint kinematics.wheels_radius "
    "kinematics.sum_of_robot_center_projection_on_X_Y_axis wheel_separation_x wheel_separation_y "
    "wheel_names rear_wheel front_steer rear_wheels_names front_wheels_names "
    "traction_joints_names steering_joints_names traction_joint_name steering_joint_name "
    "front_steering wheelbase wheel_separation_h wheel_separation_h_multiplier "
    "traction_track_width rear_wheel_track front_wheel_track steering_track_width wheel_track "
    "traction_wheels_radius rear_wheels_radius front_wheels_radius steering.max_position "
    "steering.max_velocity traction.max_velocity cmd_vel_timeout reference_timeout "
    "command_timeout publish_rate odom_publish_rate odom_frame_id base_frame_id base_link_frame_id "
    "use_stamped_vel enable_odom_tf publish_cmd publish_limited_velocity use_sim_time update_rate "
    "publish_wheel_joint_controller_state publish_wheel_data allow_multiple_cmd_vel_publishers "
    "wheels_per_side tf_frame_prefix tf_frame_prefix_enable in_chained_mode "
    "linear.x.has_velocity_limits linear.x.max_velocity linear.x.min_velocity "
    "linear.x.has_acceleration_limits linear.x.max_acceleration linear.x.min_acceleration "
    "linear.x.max_deceleration linear.x.has_jerk_limits linear.x.max_jerk linear.x.min_jerk "
    "linear.y.has_velocity_limits linear.y.max_velocity linear.y.min_velocity "
    "angular.z.has_velocity_limits angular.z.max_velocity angular.z.min_velocity "
    "angular.z.has_acceleration_limits angular.z.max_acceleration angular.z.min_acceleration "
    "angular.z.max_deceleration angular.z.has_jerk_limits angular.z.max_jerk angular.z.min_jerk";

// Entries below a map, by dotted names; what is off, 0 or NaN has no effect in ROS either.
void collect_others(const Element& map, const std::string& prefix, int depth,
                    std::vector<std::string>& others) {
  constexpr int kDeepest = 8;
  static const std::set<std::string> kNothing = {"", "false", "False", "0", "0.0"};
  if (depth > kDeepest) return;
  for (const auto& child : map.children) {
    const std::string name = prefix + child->name;
    const bool is_list = child->has("item");
    if (!is_list && !child->children.empty()) {
      collect_others(*child, name + ".", depth + 1, others);
    } else if (!has_word(kDone, name) &&
               (is_list || !(kNothing.contains(child->text) || is_nan(child->text))) &&
               std::find(others.begin(), others.end(), name) == others.end()) {
      others.push_back(name);
    }
  }
}

void name_others(const Controller& controller, const std::string& where, Findings& findings) {
  std::vector<std::string> others;
  for (size_t i = 0; i < controller.own; ++i)
    collect_others(*controller.parameters[i], "", 0, others);
  if (others.empty()) return;
  std::string list;
  for (const std::string& name : others) list += (list.empty() ? "" : ", ") + name;
  findings.unsupported(controller.source, where,
                       "controller '" + controller.name + "': without effect here: " + list);
}

// The drive parameters that change the motion in ROS, but have no effect here.
void name_what_has_no_effect(const Controller& controller, const std::string& where,
                             Findings& findings) {
  const auto name = [&](const Element* written, const std::string& text) {
    if (written)
      findings.unsupported(written->source, where, "controller '" + controller.name + "': " + text);
  };
  for (const char* axis : {"linear.x", "angular.z"}) {
    const std::string at = axis;
    if (const Element* has = parameter(controller, {(at + ".has_jerk_limits").c_str()});
        is_true(has))
      name(has, "the jerk is not limited");
    const auto fastest = limit_in(parameter(controller, {(at + ".max_velocity").c_str()}));
    const Element* slowest = parameter(controller, {(at + ".min_velocity").c_str()});
    const auto backwards = limit_in(slowest, true);
    if (fastest && backwards && std::abs(*fastest - *backwards) > 1e-9)
      name(slowest, "min_velocity is not kept: it is as fast both ways as max_velocity says");
  }
  const auto left = positive(parameter(controller, {"left_wheel_radius_multiplier"})),
             right = positive(parameter(controller, {"right_wheel_radius_multiplier"}));
  if (left.value_or(1.0) != right.value_or(1.0))
    name(parameter(controller, {"right_wheel_radius_multiplier"}),
         "the right wheels have the radius of the left ones");
}

// ROS runs one of them at a time.
void name_second(const Controller& controller, const std::string& first, const std::string& where,
                 Findings& findings) {
  const KnownType* type = known_type(controller.type);
  if (type && type->read)
    findings.unsupported(controller.source, where,
                         "controller '" + controller.name +
                             "' drives, too, and is left out: " + first + " drives the robot");
}

void name_untyped(const std::vector<Controller>& controllers, const std::string& where,
                  Findings& findings) {
  for (const Controller& each : controllers)
    findings.unsupported(each.source, where,
                         each.type.empty()
                             ? "'" + each.name +
                                   "' names wheels or joints as a controller does, but no type "
                                   "says which: it does nothing"
                             : "controllers of type '" + each.type + "' are not known; '" +
                                   each.name + "' does nothing" + suggested(each.type));
}

bool is_steer_bot(const std::vector<const Element*>& plugins) {
  return std::any_of(plugins.begin(), plugins.end(), [](const Element* each) {
    return contains(each->string("robotSimType", ""), "steer_bot");
  });
}

// Its parameters, which lie in a file of their own.
void add_steer_bot(const std::vector<std::string>& beside, const std::string& where,
                   ReadContext& context, std::vector<Controller>& controllers) {
  for (const auto& file : read_controllers(beside, false, where, context)) {
    for (const auto& map : file->children) {
      if (!map->has(kWheelsOfSteerBot)) continue;
      for (Controller& each : controllers) each.parameters.push_back(map.get());
      return;
    }
  }
}

}  // namespace

ControllersDrive drive_from_controllers(const Element& model_element,
                                        const std::vector<const Element*>& plugins,
                                        const Model& model, const std::string& where,
                                        ReadContext& context) {
  if (!is_controlled(model_element, plugins)) return {};
  const std::vector<std::string>& beside = context.controllers.beside(model_element.source.file);
  const std::vector<std::string> named = named_files(plugins, beside, where, context);
  const auto look_in = [&](const std::vector<std::string>& paths, bool is_named) {
    ControllersDrive result;
    const auto files = read_controllers(paths, is_named, where, context);
    const Report report{where, context.findings, is_named};
    std::vector<Controller> controllers = controllers_in(files);
    if (!controllers.empty() && is_steer_bot(plugins))
      add_steer_bot(beside, where, context, controllers);
    if (is_named) name_untyped(untyped_in(files, controllers), where, context.findings);
    for (const Controller& each : controllers) {
      if (is_named) name_type(each, where, context.findings);
      if (result.drive) {
        if (is_named) name_second(each, result.controller, where, context.findings);
        continue;
      }
      try {
        result.drive = drive_of(each, model, report);
        if (result.drive) name_what_has_no_effect(each, where, context.findings);
      } catch (const InputError& error) {
        report.error(error, "controller '" + each.name + "': " + error.message());
        result.drive.reset();
      }
      if (!result.drive) continue;
      result.odometry = odometry_of(each, where, context.findings);
      result.controller =
          "'" + each.name + "' of " + fs::path(each.source.file).filename().string();
      result.named = is_named;
      name_others(each, where, context.findings);
      for (const std::string& path : paths) context.documents.note(path);
    }
    return result;
  };
  if (ControllersDrive found = look_in(named, true); found.drive) return found;
  for (const std::string& path : beside) {  // each may belong to another robot
    if (ControllersDrive found = look_in({path}, false); found.drive) return found;
  }
  return {};
}

std::vector<std::string> controlled_joints(const Element& model_element) {
  std::vector<std::string> by_velocity, all;
  const auto note = [&](const Element& joint, const std::string& interface) {
    const std::string* name = joint.attribute("name");
    if (!name) return;
    all.push_back(*name);
    if (interface.find("elocity") != std::string::npos) by_velocity.push_back(*name);
  };
  for (const Element* transmission : model_element.all("transmission")) {
    for (const Element* joint : transmission->all("joint"))
      note(*joint, joint->string("hardwareInterface", ""));
  }
  for (const Element* system : model_element.all("ros2_control")) {
    for (const Element* joint : system->all("joint")) {
      std::string interfaces;
      for (const Element* each : joint->all("command_interface")) {
        if (const std::string* name = each->attribute("name")) interfaces += *name + " ";
      }
      if (!interfaces.empty()) note(*joint, interfaces);
    }
  }
  return by_velocity.empty() ? all : by_velocity;
}

}  // namespace ruedo::world
