// Parameter names and defaults follow the plugins' documentation.
#include "world/compat/joint_plugins.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/text.h"
#include "world/compat/plugins.h"

namespace ruedo::world {
namespace {

const Allowed kGain = Allowed::any(quantity::kDamping);
// Limits that are not there: nothing is below inf or above -inf.
const Allowed kLower = {.max = quantity::kDamping.most,
                        .infinite = true,
                        .quantity = &quantity::kDamping},
              kUpper = {.min = -quantity::kDamping.most,
                        .infinite = true,
                        .quantity = &quantity::kDamping};

// The plugin's n-th element of that name; if there are fewer and `repeats` is set, the last one.
const Element* nth(const Element& plugin, const std::string& name, size_t n) {
  const std::vector<const Element*> all = plugin.all(name);
  return n < all.size() ? all[n] : nullptr;
}

struct Defaults {
  double p, i, d, i_min, i_max, least, most;
};

// In gz-sim's Pid, limits in reverse order mean no limits.
Pid read_pid(const Element& plugin, const std::string& prefix, size_t n, const Defaults& usual) {
  const auto number = [&](const char* name, double fallback, const Allowed& allowed = kGain) {
    const Element* written = nth(plugin, prefix + name, n);
    return written ? written->as_number(allowed) : fallback;
  };
  Pid pid;
  pid.p = number("p_gain", usual.p);
  pid.i = number("i_gain", usual.i);
  pid.d = number("d_gain", usual.d);
  for (const double gain : {pid.p, pid.i, pid.d}) {
    if (gain < 0.0)
      plugin.fail("a gain of " + shown(gain) + " is not allowed; allowed are 0 and more");
  }
  const double i_min = number("i_min", usual.i_min, kLower),
               i_max = number("i_max", usual.i_max, kUpper);
  if (i_min <= i_max) pid.i_min = i_min, pid.i_max = i_max;
  const double least = number("cmd_min", usual.least, kLower),
               most = number("cmd_max", usual.most, kUpper);
  if (least <= most) pid.least = least, pid.most = most;
  pid.offset = number("cmd_offset", 0.0);
  return pid;
}

bool is_set(const Pid& pid) { return pid.p > 0.0 || pid.i > 0.0 || pid.d > 0.0; }

struct Reader {
  const Element& plugin;
  std::string name, where;
  Findings& findings;
  Model& model;

  Joint* joint(const Element& written) const {
    const std::string text = dotted(written.text);
    const auto found =
        std::find_if(model.joints.begin(), model.joints.end(), [&](const Joint& each) {
          return each.name == text || model.name + "." + each.name == text;
        });
    if (found != model.joints.end()) return &*found;
    findings.error(written.source, where,
                   "the plugin " + name + " names the joint '" + written.text +
                       "', which the model does not have");
    return nullptr;
  }

  void without_effect(const char* element, const std::string& text) const {
    if (const Element* written = plugin.child(element))
      findings.unsupported(
          written->source, where,
          "<" + std::string(element) + "> of the plugin " + name + " is not supported: " + text);
  }

  // Joints that something else than the controller moves.
  void name_moved(const Element& at, const Joint& held) const {
    const auto& drive = model.drive;
    const ModelJointIndex index(&held - model.joints.data());
    const auto is_among = [&](const std::vector<ModelJointIndex>& joints) {
      return std::find(joints.begin(), joints.end(), index) != joints.end();
    };
    std::string why;
    if (held.type == JointType::fixed)
      why = "is fixed";
    else if (held.type == JointType::gearbox)
      why = "is a gearbox, which takes no commands";
    else if (held.leader.valid())
      why = "follows '" + model.joints[held.leader].name + "', and takes no commands";
    else if (drive && (is_among(drive->left_joints) || is_among(drive->right_joints) ||
                       is_among(drive->steer_joints)))
      why = "is turned by the drive";
    else if (held.axis.start.mode != JointStart::Mode::free &&
             held.axis.start.mode != JointStart::Mode::stay)
      why = "has another controller already; this one counts where they differ";
    if (!why.empty())
      findings.unsupported(at.source, where,
                           "the joint '" + held.name + "' of the plugin " + name + " " + why);
  }

  // Only the first axis turns here.
  void name_axis() const {
    if (plugin.integer("joint_index", 0, Allowed::between(0, 1)) == 1)
      without_effect("joint_index", "commands turn the first axis of a joint");
  }

  double start(const char* element, size_t n) const {
    const Element* written = nth(plugin, element, n);
    return written ? written->as_number(Allowed::any(quantity::kLength)) : 0.0;
  }

  // Of controllers of one joint, whose parameters stand once.
  void name_seconds() const {
    for (const auto& child : plugin.children) {
      if (child->name != "joint_name" && plugin.child(child->name)->text != child->text)
        findings.unsupported(child->source, where,
                             "a second <" + child->name + "> of the plugin " + name +
                                 " is left out; the first one counts");
    }
    if (!plugin.has("joint_name"))
      findings.error(plugin.source, where,
                     "the plugin " + name + " has no <joint_name>; it holds nothing");
  }

  // They move nothing here that needs a finding.
  void names() const {
    for (const Element* written : plugin.all("joint_name")) joint(*written);
  }

  void position() const {
    name_seconds();
    const Pid pid = read_pid(plugin, "", 0, {1.0, 0.1, 0.01, -1.0, 1.0, -1000.0, 1000.0});
    const bool exact = plugin.boolean("use_velocity_commands", false);
    name_axis();
    for (const Element* written : plugin.all("joint_name")) {
      Joint* held = joint(*written);
      if (!held) continue;
      name_moved(*written, *held);
      if (exact && pid.most < 0.0)
        findings.error(plugin.source, where,
                       "<cmd_max> of the plugin " + name + ": '" + shown(pid.most) +
                           "' is not allowed; allowed is a number of at least 0; it stands still");
      if (exact)
        held->axis.velocity = std::min(held->axis.velocity, std::max(pid.most, 0.0));
      else
        held->axis.position_pid = pid;
      held->axis.start = {JointStart::Mode::position, start("initial_position", 0)};
    }
  }

  void velocity() const {
    name_seconds();
    const Pid pid = read_pid(plugin, "", 0, {1.0, 0.0, 0.0, -1.0, 1.0, -1000.0, 1000.0});
    const bool by_force = plugin.boolean("use_force_commands", false);
    if (by_force && pid.d > 0.0)
      without_effect("d_gain", "the error of a rate is not differentiated");
    name_axis();
    for (const Element* written : plugin.all("joint_name")) {
      Joint* held = joint(*written);
      if (!held) continue;
      name_moved(*written, *held);
      if (by_force) held->axis.rate_pid = pid;
      held->axis.start = {JointStart::Mode::velocity, start("initial_velocity", 0)};
    }
  }

  // A joint that follows a rate has to brake at rate 0: both PIDs are the same.
  void trajectory() const {
    constexpr Defaults kNothing = {0.0, 0.0, 0.0, 0.0, -1.0, 0.0, -1.0};
    std::vector<Joint*> joints;
    for (const Element* written : plugin.all("joint_name")) {
      joints.push_back(joint(*written));
      if (joints.back()) name_moved(*written, *joints.back());
    }
    if (!plugin.has("joint_name")) {
      for (Joint& each : model.joints) {
        if (each.type != JointType::fixed) joints.push_back(&each);
      }
    }
    bool integrates_rate = false;
    for (size_t i = 0; i < joints.size(); ++i) {
      if (!joints[i]) continue;
      Pid position = read_pid(plugin, "position_", i, kNothing);
      const Pid rate = read_pid(plugin, "velocity_", i, kNothing);
      integrates_rate |= rate.i > 0.0 || rate.d > 0.0;
      position.d += rate.p;
      if (is_set(position)) joints[i]->axis.position_pid = position;
      if (is_set(rate)) joints[i]->axis.rate_pid = rate;
      if (is_set(position) || plugin.has("initial_position"))
        joints[i]->axis.start = {JointStart::Mode::position, start("initial_position", i)};
    }
    if (!integrates_rate) return;
    without_effect(plugin.has("velocity_i_gain") ? "velocity_i_gain" : "velocity_d_gain",
                   "of a trajectory's rate only the proportional part acts");
  }
};

struct Kind {
  const char* plugin;
  void (Reader::*read)() const;
};

constexpr Kind kKinds[] = {
    {"JointPositionController", &Reader::position},
    {"JointController", &Reader::velocity},
    {"JointTrajectoryController", &Reader::trajectory},
    {"JointStatePublisher", &Reader::names},
    {"ApplyJointForce", &Reader::names},
};

}  // namespace

void read_joint_plugins(const std::vector<const Element*>& plugins, const std::string& where,
                        Findings& findings, Model& model) {
  for (const Element* plugin : plugins) {
    const std::string name = kind_of(*plugin).name;
    for (const Kind& kind : kKinds) {
      if (name != kind.plugin) continue;
      read_or_leave_out(where, "the controller is left out", findings,
                        [&] { (Reader{*plugin, name, where, findings, model}.*kind.read)(); });
    }
  }
}

void read_joint_interfaces(const Element& model_element, const std::string& where,
                           Findings& findings, Model& model) {
  const auto read = [&](const Element& named, bool stays) {
    const std::string* name = named.attribute("name");
    const auto joint =
        std::find_if(model.joints.begin(), model.joints.end(),
                     [&](const auto& each) { return name && each.name == dotted(*name); });
    if (joint == model.joints.end())
      findings.error(named.source, where,
                     "<" + named.name + "> names the joint '" + (name ? *name : "") +
                         "', which the model does not have");
    else if (stays && joint->axis.start.mode == JointStart::Mode::free)
      joint->axis.start.mode = JointStart::Mode::stay;
  };
  for (const Element* transmission : model_element.all("transmission")) {
    for (const Element* joint : transmission->all("joint")) read(*joint, true);
  }
  for (const Element* system : model_element.all("ros2_control")) {
    for (const Element* joint : system->all("joint")) read(*joint, joint->has("command_interface"));
  }
}

}  // namespace ruedo::world
