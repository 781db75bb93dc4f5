// Which files hold a robot's controllers, and how they are laid out.
//
// A ROS 1 controller is a map with a `type`; in ROS 2 the controller manager names the types, and
// NAME/ros__parameters holds the rest, with dots or nested.
#include "world/compat/ros_controllers.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <set>

#include "world/compat/plugins.h"

namespace fs = std::filesystem;

namespace ruedo::world {
namespace {

// Of a robot, of a controller's name, and of a list; the others have no effect.
constexpr size_t kMostControllers = 100, kMostParameterMaps = 100, kMostNames = 1000;

// Those of ros_controllers and ros2_controllers.
const std::vector<std::string>& known_types() {
  static const std::vector<std::string> types = {
      "ackermann_steering_controller/AckermannSteeringController",
      "bicycle_steering_controller/BicycleSteeringController",
      "diff_drive_controller/DiffDriveController",
      "effort_controllers/GripperActionController",
      "effort_controllers/JointEffortController",
      "effort_controllers/JointGroupEffortController",
      "effort_controllers/JointGroupPositionController",
      "effort_controllers/JointPositionController",
      "effort_controllers/JointTrajectoryController",
      "effort_controllers/JointVelocityController",
      "forward_command_controller/ForwardCommandController",
      "forward_command_controller/MultiInterfaceForwardCommandController",
      "gripper_controllers/GripperActionController",
      "imu_sensor_broadcaster/IMUSensorBroadcaster",
      "imu_sensor_controller/ImuSensorController",
      "joint_state_broadcaster/JointStateBroadcaster",
      "joint_state_controller/JointStateController",
      "joint_trajectory_controller/JointTrajectoryController",
      "mecanum_drive_controller/MecanumDriveController",
      "omni_wheel_drive_controller/OmniWheelDriveController",
      "pid_controller/PidController",
      "position_controllers/GripperActionController",
      "position_controllers/JointGroupPositionController",
      "position_controllers/JointPositionController",
      "position_controllers/JointTrajectoryController",
      "tricycle_controller/TricycleController",
      "tricycle_steering_controller/TricycleSteeringController",
      "velocity_controllers/JointGroupVelocityController",
      "velocity_controllers/JointPositionController",
      "velocity_controllers/JointTrajectoryController",
      "velocity_controllers/JointVelocityController"};
  return types;
}

// One letter more, less or another, or two that changed places; or they do not differ.
bool differ_by_a_letter(std::string_view a, std::string_view b) {
  constexpr size_t kMost = 2;
  while (!a.empty() && !b.empty() && a.front() == b.front()) a.remove_prefix(1), b.remove_prefix(1);
  while (!a.empty() && !b.empty() && a.back() == b.back()) a.remove_suffix(1), b.remove_suffix(1);
  return a.size() <= kMost && b.size() <= kMost;
}

// Looks up "a.b.c" in a tree whose keys may contain dots themselves.
const Element* below(const Element& map, const std::string& path) {
  for (const auto& child : map.children) {
    if (child->name == path) return child.get();
    if (path.size() > child->name.size() && path.compare(0, child->name.size(), child->name) == 0 &&
        path[child->name.size()] == '.') {
      if (const Element* found = below(*child, path.substr(child->name.size() + 1))) return found;
    }
  }
  return nullptr;
}

bool is_controllers_type(const std::string& type) {
  return type.find("ontroller") != std::string::npos || !mistyped(type).empty();
}

// A file whose root is the controller: a launch file says under which name.
void collect_root(const Element& file, std::vector<Controller>& into) {
  const Element* type = file.child("type");
  if (type && is_controllers_type(type->text))
    into.push_back(
        {fs::path(file.source.file).stem().string(), type->text, {&file}, 1, file.source});
}

void collect_types(const Element& map, std::vector<Controller>& into) {
  for (const auto& child : map.children) {
    if (into.size() >= kMostControllers) return;
    if (const Element* type = child->child("type"); type && is_controllers_type(type->text)) {
      const bool own = child->name == "ros__parameters";  // the type is one of the parameters
      into.push_back({own ? map.name : child->name, type->text, {child.get()}, 1, child->source});
    }
    collect_types(*child, into);
  }
}

// NAME: ros__parameters: ..., with or without a namespace before the name.
void collect_parameters(const Element& map, const std::string& name, Controller& controller) {
  for (const auto& child : map.children) {
    if (controller.parameters.size() >= kMostParameterMaps) return;
    const std::string own = child->name.substr(child->name.rfind('/') + 1);
    const Element* parameters = child->child("ros__parameters");
    if (parameters && own == name) {
      controller.parameters.push_back(parameters);
      if (name == controller.name) controller.source = child->source;
    } else {
      collect_parameters(*child, name, controller);
    }
  }
}

// Whether anything below is a controller, or gains of gazebo_ros_control.
bool holds_controllers(const Element& map) {
  const Element* root = map.child("type");
  if (root && is_controllers_type(root->text)) return true;
  return std::any_of(map.children.begin(), map.children.end(), [](const auto& child) {
    const Element* type = child->child("type");
    return child->name.ends_with("pid_gains") ||
           (type && (is_controllers_type(type->text) ||
                     type->text.find("roadcaster") != std::string::npos)) ||
           holds_controllers(*child);
  });
}

// Maps that name what a controller moves, and that no controller of a known type has: they have
// none, or a mistyped one.
void collect_untyped(const Element& map, const std::set<const Element*>& typed,
                     std::vector<Controller>& into) {
  constexpr std::array kMoved{"left_wheel",        "right_wheel", "left_wheel_names",
                              "right_wheel_names", "joints",      "joint"};
  for (const auto& child : map.children) {
    if (into.size() >= kMostControllers) return;
    if (typed.contains(child.get())) continue;
    const bool own = child->name == "ros__parameters";
    const std::string type = child->string("type", "");
    const bool of_moveit = type == "FollowJointTrajectory" || type == "GripperCommand";
    if (!of_moveit &&
        std::any_of(kMoved.begin(), kMoved.end(), [&](auto* key) { return child->has(key); }))
      into.push_back({own ? map.name : child->name, type, {child.get()}, 1, child->source});
    else
      collect_untyped(*child, typed, into);
  }
}

bool holds_parameters(const Element& map) {
  return std::any_of(map.children.begin(), map.children.end(), [](const auto& child) {
    return child->has("ros__parameters") || holds_parameters(*child);
  });
}

std::string trimmed_package_path(const std::string& path) {
  const size_t share = path.rfind("/share/");
  return share == std::string::npos ? "" : "package://" + path.substr(share + 7);
}

}  // namespace

std::string mistyped(const std::string& type) {
  const auto& known = known_types();
  const auto is_near = [&](const std::string& each) {
    const size_t own = type.find('/'), theirs = each.find('/');
    return own != std::string::npos &&
           differ_by_a_letter(std::string_view(type).substr(0, own),
                              std::string_view(each).substr(0, theirs)) &&
           differ_by_a_letter(std::string_view(type).substr(own),
                              std::string_view(each).substr(theirs));
  };
  if (std::find(known.begin(), known.end(), type) != known.end()) return "";
  const auto found = std::find_if(known.begin(), known.end(), is_near);
  return found == known.end() ? "" : *found;
}

const Element* parameter(const Controller& controller, std::initializer_list<const char*> names) {
  for (const char* name : names) {
    for (const Element* map : controller.parameters) {
      if (const Element* found = below(*map, name)) return found;
    }
  }
  return nullptr;
}

std::string without_arguments(std::string text) {
  for (size_t at; (at = text.find("$(arg ")) != std::string::npos;) {
    const size_t end = text.find(')', at);
    if (end == std::string::npos) break;
    text.erase(at, end + 1 - at);
  }
  return text;
}

std::vector<std::string> names_in(const Element* list) {
  std::vector<std::string> names;
  if (!list) return names;
  if (!list->text.empty()) names.push_back(list->text);
  for (const Element* item : list->all("item")) {
    if (names.size() < kMostNames) names.push_back(item->text);
  }
  return names;
}

bool is_true(const Element* flag) {
  return flag && (flag->text == "true" || flag->text == "True" || flag->text == "1");
}

bool has_word(std::string_view words, std::string_view word) {
  while (!words.empty()) {
    const size_t blank = words.find(' ');
    if (words.substr(0, blank) == word) return true;
    if (blank == std::string_view::npos) return false;
    words.remove_prefix(blank + 1);
  }
  return false;
}

bool is_nan(const std::string& text) { return has_word(".nan .NaN .NAN NaN", text); }

bool is_infinite(const std::string& text) {
  const bool is_signed = text.starts_with('-') || text.starts_with('+');
  return has_word(".inf .Inf .INF", text.substr(is_signed ? 1 : 0));
}

std::optional<double> positive(const Element* written) {
  if (!written || is_nan(written->text)) return std::nullopt;
  const double value = written->as_number(Allowed::between(0.0, 1e9));
  return value > 0 ? std::optional(value) : std::nullopt;
}

std::optional<double> limit_in(const Element* written, bool signed_) {
  if (!written || is_infinite(written->text)) return std::nullopt;
  if (!signed_ || is_nan(written->text)) return positive(written);
  const double value = std::abs(written->as_number(Allowed::between(-1e9, 1e9)));
  return value > 0 ? std::optional(value) : std::nullopt;
}

std::string unknown_joint(const Controller& controller, const std::string& joint) {
  return "controller '" + controller.name + "' names the joint '" + joint +
         "', which the model does not have";
}

std::vector<Controller> controllers_in(const std::vector<std::shared_ptr<const Element>>& files) {
  std::vector<Controller> all;
  for (const auto& file : files) {
    collect_root(*file, all);
    collect_types(*file, all);
  }
  for (Controller& each : all) {
    for (const auto& file : files) collect_parameters(*file, each.name, each);
    each.own = each.parameters.size();
    // ROS 2's wildcards hold what no node of the name has: the first one counts.
    for (const auto& file : files) collect_parameters(*file, "**", each);
  }
  return all;
}

std::vector<Controller> untyped_in(const std::vector<std::shared_ptr<const Element>>& files,
                                   const std::vector<Controller>& controllers) {
  std::set<const Element*> typed;
  for (const Controller& each : controllers)
    typed.insert(each.parameters.begin(), each.parameters.end());
  std::vector<Controller> all;
  for (const auto& file : files) collect_untyped(*file, typed, all);
  return all;
}

bool is_controlled(const Element& model_element, const std::vector<const Element*>& plugins) {
  return model_element.has("transmission") || model_element.has("ros2_control") ||
         std::any_of(plugins.begin(), plugins.end(), [](const Element* each) {
           return kind_of(*each).does == PluginKind::Does::control;
         });
}

std::vector<std::string> named_files(const std::vector<const Element*>& plugins,
                                     const std::vector<std::string>& beside,
                                     const std::string& where, ReadContext& context) {
  std::vector<std::string> files;
  for (const Element* plugin : plugins) {
    if (kind_of(*plugin).does != PluginKind::Does::control) continue;
    for (const Element* written : plugin->all("parameters")) {
      auto path = context.resources.find(written->text, written->source.file);
      if (!path)
        path = context.resources.find(trimmed_package_path(written->text), written->source.file);
      const auto same_name = [&](const std::string& file) {
        return fs::path(file).filename() == fs::path(written->text).filename();
      };
      const auto match = std::find_if(beside.begin(), beside.end(), same_name);
      if (!path && match != beside.end()) path = *match;
      if (path && std::find(files.begin(), files.end(), *path) != files.end()) continue;
      if (path)
        files.push_back(*path);
      else
        context.findings.error(written->source, where,
                               "the controllers' file '" + written->text + "' " +
                                   context.resources.why_not(written->text, written->source.file));
    }
  }
  return files;
}

std::vector<std::shared_ptr<const Element>> read_controllers(const std::vector<std::string>& paths,
                                                             bool named, const std::string& where,
                                                             ReadContext& context) {
  std::vector<std::shared_ptr<const Element>> files;
  for (const std::string& path : paths) {
    try {
      if (auto file = context.controllers.read(path, named)) files.push_back(std::move(file));
    } catch (const InputError& error) {  // a neighbouring file may be anything
      if (named) context.findings.error(error, where, error.message());
    }
  }
  if (!named) return files;
  const bool any = std::any_of(files.begin(), files.end(),
                               [](const auto& file) { return holds_controllers(*file); });
  for (const auto& file : files) {
    if (!holds_controllers(*file) && !(any && holds_parameters(*file)))
      context.findings.error({file->source.file, 0}, where,
                             "the controllers' file holds no controller with a type");
  }
  return files;
}

}  // namespace ruedo::world
