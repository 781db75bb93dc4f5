// Names and defaults follow the documentation of control_toolbox and of the controllers.
#include "world/compat/ros_gains.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <string_view>

#include "world/compat/ros_controllers.h"

namespace ruedo::world {
namespace {

const Allowed kGain = Allowed::not_negative(quantity::kDamping);
const Allowed kClamp = Allowed::any(quantity::kDamping);

double number(const Element& map, const char* name, const Allowed& allowed, double fallback = 0.0) {
  const Element* written = map.child(name);
  return written ? written->as_number(allowed) : fallback;
}

// Infinite: no limit.
double clamp(const Element& map, const char* name, double fallback) {
  const Element* written = map.child(name);
  if (!written || !is_infinite(written->text)) return number(map, name, kClamp, fallback);
  return written->text.starts_with('-') ? -Pid::kNone : Pid::kNone;
}

// As in control_toolbox: without a clamp, the integral part has no effect.
Pid pid_of(const Element& gains) {
  Pid pid;
  pid.p = number(gains, "p", kGain);
  pid.i = number(gains, "i", kGain);
  pid.d = number(gains, "d", kGain);
  const double both = std::abs(clamp(gains, "i_clamp", 0.0));
  pid.i_max = std::max(0.0, clamp(gains, "i_clamp_max", both));
  pid.i_min = std::min(0.0, clamp(gains, "i_clamp_min", -both));
  return pid;
}

// Gains that say what cannot be, or what is not done.
void name_odd_gains(const Element& gains, const std::string& joint, const std::string& where,
                    Findings& findings) {
  // Those that are done, off, or of no concern for the motion.
  constexpr std::string_view kDone =
      "p i d i_clamp i_clamp_min i_clamp_max antiwindup publish_state antiwindup_strategy "
      "activate_state_publisher save_i_terms use_external_measurement";
  static const std::set<std::string> kNothing = {"", "false", "False", "0", "0.0"};
  const std::string of = "gains of the joint '" + joint + "': ";
  std::string others;
  for (const auto& child : gains.children) {
    if (!has_word(kDone, child->name) && !kNothing.contains(child->text) && !is_nan(child->text) &&
        !is_infinite(child->text))
      others += (others.empty() ? "" : ", ") + child->name;
  }
  if (!others.empty())
    findings.unsupported(gains.source, where, of + "without effect here: " + others);
  const auto name = [&](const char* key, double sign, const char* side) {
    if (const Element* written = gains.child(key); written && sign * clamp(gains, key, 0.0) < 0.0)
      findings.error(written->source, where,
                     of + key + " '" + written->text + "' is " + side + " 0; it counts as 0");
  };
  name("i_clamp_max", 1.0, "below");
  name("i_clamp_min", -1.0, "above");
}

bool is_set(const Pid& pid) { return pid.p > 0.0 || pid.d > 0.0; }

enum class Gives { nothing, effort_for_position, effort_for_rate, rate_for_position };

struct Interfaces {
  const Element& model_element;

  // From the <transmission> of gazebo_ros_control.
  bool has(const std::string& joint, const char* what) const {
    for (const Element* transmission : model_element.all("transmission")) {
      for (const Element* each : transmission->all("joint")) {
        const std::string* name = each->attribute("name");
        if (name && *name == joint &&
            each->string("hardwareInterface", "").find(what) != std::string::npos)
          return true;
      }
    }
    return false;
  }
};

struct Reader {
  Model& model;
  const std::string& where;
  Findings& findings;
  bool is_named = false;               // whether a plugin names the file that is read
  std::vector<std::string> held = {};  // names of joints

  bool has(const std::string& joint) const {
    return std::any_of(model.joints.begin(), model.joints.end(),
                       [&](const Joint& each) { return each.name == dotted(joint); });
  }

  void error(const Source& source, const std::string& text) const {
    if (is_named) findings.error(source, where, text);
  }

  void give(const std::string& name, Gives gives, const Element& gains) {
    const Pid pid = pid_of(gains);
    if (has(name) && (is_named || is_set(pid))) name_odd_gains(gains, name, where, findings);
    give(name, gives, pid, &gains);
  }

  // `written`: where they stand in a controllers' file.
  void give(const std::string& name, Gives gives, const Pid& pid,
            const Element* written = nullptr) {
    if (!is_set(pid) || gives == Gives::nothing) return;
    for (Joint& joint : model.joints) {
      if (joint.name != dotted(name)) continue;
      JointAxis& axis = joint.axis;
      if (gives == Gives::rate_for_position) {
        if (pid.p > 0.0) axis.position_gain = pid.p;
      } else {
        std::optional<Pid>& of =
            gives == Gives::effort_for_rate ? axis.rate_pid : axis.position_pid;
        if (of) {  // set by a plugin, or by an earlier controller or file
          if (written && (of->p != pid.p || of->i != pid.i || of->d != pid.d))
            error(written->source,
                  "gains of the joint '" + name +
                      "' are left out: it has those of another controller already");
          return;
        }
        of = pid;
      }
      if (axis.start.mode == JointStart::Mode::free) axis.start.mode = JointStart::Mode::stay;
      held.push_back(name);
    }
  }
};

bool contains(const std::string& text, const char* part) {
  return text.find(part) != std::string::npos;
}

Gives gives_of(const Controller& controller) {
  const std::string& type = controller.type;
  const bool rate =
      contains(type, "JointVelocityController") || contains(type, "JointGroupVelocityController");
  if (contains(type, "effort_controllers/"))
    return rate ? Gives::effort_for_rate : Gives::effort_for_position;
  if (contains(type, "velocity_controllers/"))
    return rate ? Gives::nothing : Gives::rate_for_position;
  if (contains(type, "pid_controller/")) {
    const auto states = names_in(parameter(controller, {"reference_and_state_interfaces"}));
    const Element* command = parameter(controller, {"command_interface"});
    const bool effort = command && command->text == "effort",
               by_rate = !states.empty() && states[0] == "velocity";
    if (!effort && (by_rate || !command || command->text != "velocity")) return Gives::nothing;
    return !effort   ? Gives::rate_for_position
           : by_rate ? Gives::effort_for_rate
                     : Gives::effort_for_position;
  }
  if (!contains(type, "JointTrajectoryController")) return Gives::nothing;
  for (const std::string& interface : names_in(parameter(controller, {"command_interfaces"}))) {
    if (interface == "effort") return Gives::effort_for_position;
    if (interface == "velocity") return Gives::rate_for_position;
  }
  return Gives::nothing;
}

void name_unknown_joints(const Controller& controller, const Reader& reader) {
  for (const char* key : {"joint", "joints", "dof_names"}) {
    const Element* list = parameter(controller, {key});
    for (const std::string& joint : names_in(list)) {
      if (!reader.has(joint)) reader.error(list->source, unknown_joint(controller, joint));
    }
  }
}

// For one joint in `pid`, for several in `gains`, or each in a map of its own.
void read_controller(const Controller& controller, Reader& reader) {
  const Gives gives = gives_of(controller);
  if (gives == Gives::nothing) return;
  const Element* pid = parameter(controller, {"pid"});
  if (const Element* joint = parameter(controller, {"joint"}); joint && pid)
    return reader.give(joint->text, gives, *pid);
  const std::vector<std::string> joints = names_in(parameter(controller, {"joints", "dof_names"}));
  if (const Element* all = parameter(controller, {"gains"})) {
    for (const auto& each : all->children) {
      const auto is_of = [&](const std::string& joint) {
        return joint == each->name || joint.starts_with(each->name + ".");  // dots become levels
      };
      if (std::none_of(joints.begin(), joints.end(), is_of))
        reader.error(each->source, "controller '" + controller.name + "': gains of the joint '" +
                                       each->name + "', which is not one of its joints");
    }
  }
  for (const std::string& joint : joints) {
    const Element* gains = parameter(
        controller, {("gains." + joint).c_str(), (joint + ".pid").c_str(), joint.c_str()});
    if (gains) reader.give(joint, gives, *gains);
  }
}

// Tolerances and goal times of a controller for these joints.
void name_constraints(const Controller& controller, const Reader& reader, const std::string& where,
                      Findings& findings) {
  const Element* constraints = parameter(controller, {"constraints"});
  const std::vector<std::string> joints = names_in(parameter(controller, {"joints"}));
  if (!constraints || !contains(controller.type, "JointTrajectoryController") ||
      !std::all_of(joints.begin(), joints.end(),
                   [&](const std::string& joint) { return reader.has(joint); }))
    return;
  findings.unsupported(constraints->source, where,
                       "controller '" + controller.name +
                           "': constraints are not supported: joints go where "
                           "ROBOT/joint_command says, and no tolerance or goal time is watched");
}

// gazebo_ros_control/pid_gains, in any namespace.
void read_pid_gains(const Element& map, const Interfaces& interfaces, Reader& reader, int depth) {
  constexpr int kDeepest = 5;
  if (depth > kDeepest) return;
  for (const auto& child : map.children) {
    if (!child->name.ends_with("pid_gains")) {
      read_pid_gains(*child, interfaces, reader, depth + 1);
      continue;
    }
    for (const auto& joint : child->children) {
      const Gives gives = interfaces.has(joint->name, "osition")   ? Gives::effort_for_position
                          : interfaces.has(joint->name, "elocity") ? Gives::effort_for_rate
                                                                   : Gives::nothing;
      if (reader.has(joint->name))
        reader.give(joint->name, gives, *joint);
      else
        reader.error(joint->source,
                     "gains of the joint '" + joint->name + "', which the model does not have");
    }
  }
}

// <param name="pos_kp"> of gazebo_ros2_control.
void read_parameters(const Element& model_element, Reader& reader) {
  for (const Element* system : model_element.all("ros2_control")) {
    for (const Element* joint : system->all("joint")) {
      const std::string* name = joint->attribute("name");
      const auto value = [&](const std::string& wanted) {
        for (const Element* param : joint->all("param")) {
          const std::string* key = param->attribute("name");
          if (key && *key == wanted) return param->as_number(kGain);
        }
        return 0.0;
      };
      for (const char* of : {"pos_", "vel_"}) {
        const std::string prefix = of;
        Pid pid;
        pid.p = value(prefix + "kp");
        pid.i = value(prefix + "ki");
        pid.d = value(prefix + "kd");
        pid.i_max = value(prefix + "max_integral_error");
        pid.i_min = -pid.i_max;
        if (name)
          reader.give(*name, prefix == "pos_" ? Gives::effort_for_position : Gives::effort_for_rate,
                      pid);
      }
    }
  }
}

}  // namespace

void read_ros_gains(const Element& model_element, const std::vector<const Element*>& plugins,
                    const std::string& where, ReadContext& context, Model& model) {
  if (!is_controlled(model_element, plugins)) return;
  Reader reader{model, where, context.findings};
  const Interfaces interfaces{model_element};
  const std::vector<std::string>& beside = context.controllers.beside(model_element.source.file);
  const std::vector<std::string> named = named_files(plugins, beside, where, context);
  const auto look_in = [&](const std::vector<std::string>& paths, bool is_named) {
    const auto files = read_controllers(paths, is_named, where, context);
    reader.is_named = is_named;
    for (const Controller& each : controllers_in(files)) {
      name_unknown_joints(each, reader);
      read_controller(each, reader);
      name_constraints(each, reader, where, context.findings);
    }
    for (const auto& file : files) read_pid_gains(*file, interfaces, reader, 0);
  };
  const auto guarded = [&](auto read) {
    read_or_leave_out(where, "the gains are left out", context.findings, read);
  };
  guarded([&] { read_parameters(model_element, reader); });
  guarded([&] { look_in(named, true); });
  if (!reader.held.empty()) return;
  for (const std::string& path : beside) {  // each may belong to another robot
    guarded([&] { look_in({path}, false); });
    if (reader.held.empty()) continue;
    std::string joints;
    for (const std::string& name : reader.held) joints += (joints.empty() ? "" : ", ") + name;
    context.documents.note(path);
    return context.findings.repaired({path, 0}, where,
                                     "no plugin names " +
                                         std::filesystem::path(path).filename().string() +
                                         "; its gains hold these joints: " + joints);
  }
}

}  // namespace ruedo::world
