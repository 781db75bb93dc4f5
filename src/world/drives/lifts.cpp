// Parameter names and defaults follow the plugins' documentation.
#include "world/drives/lifts.h"

#include <algorithm>
#include <cmath>

#include "base/whole.h"
#include "world/compat/plugins.h"

namespace ruedo::world {
namespace {

constexpr double kMostWait_s = 1e6;
constexpr int kMostFloors = 100;

ModelJointIndex find_joint(const Model& model, const std::string& name) {
  const std::string text = dotted(name);
  for (const ModelJointIndex i : model.joints.indices()) {
    const std::string& known = model.joints[i].name;
    if (known == text || model.name + "." + known == text) return i;
  }
  return {};
}

bool has_door(const Model& model, const std::string& name) {
  return std::any_of(model.doors.begin(), model.doors.end(),
                     [&](const Door& door) { return door.name == name; });
}

struct Reader {
  const Element& plugin;
  std::string where;
  Findings& findings;
  Model& model;

  ModelJointIndex joint(const std::string& name) const {
    const ModelJointIndex found = find_joint(model, name);
    if (!found.valid()) plugin.fail("the joint '" + name + "' is not one of the model's joints");
    return found;
  }

  static double wait(const Element& element, const char* name) {
    return element.number(name, 5.0, Allowed::between(0.0, kMostWait_s));
  }

  // gz-sim's lift: a link and a door for each floor, and a controller for each joint.
  void elevator() const {
    Lift lift = lift_of(plugin.string("cabin_joint", "lift"));
    const std::string floor = plugin.string("floor_link_prefix", "floor_"),
                      door = plugin.string("door_joint_prefix", "door_");
    for (int i = 0; i < kMostFloors; ++i) {
      const auto link = std::find_if(model.links.begin(), model.links.end(), [&](const Link& each) {
        return each.name == floor + std::to_string(i);
      });
      if (link == model.links.end()) break;
      const std::string name = door + std::to_string(i);
      const ModelJointIndex leaf = joint(name);
      model.doors.push_back(
          {name, {{name, leaf, 0.0, model.joints[leaf].axis.upper}}, {}, plugin.source});
      lift.floors.push_back({link->X_ML.translation.z(), {name}});
    }
    if (lift.floors.empty()) plugin.fail("there is no link '" + floor + "0'");
    lift.wait_us = microseconds(wait(plugin, "open_door_wait_duration"));
    model.lifts.push_back(std::move(lift));
  }

  // Gazebo Classic's lift: one door, in the cabin, with PIDs of its own.
  void elevator_of_classic() const {
    Lift lift = lift_of(plugin.string("lift_joint", ""));
    const std::string door = plugin.string("door_joint", "");
    const ModelJointIndex leaf = joint(door);
    const double height = plugin.number("floor_height", 3.0, Allowed::positive(quantity::kLength));
    const double top = model.joints[lift.cabin].axis.upper;
    const int floors = top < kMostFloors * height
                           ? rounded_down<int>(std::max(top, 0.0) / height + 1e-6) + 1
                           : kMostFloors;
    const std::string& name = model.joints[leaf].name;
    for (int i = 0; i < floors; ++i) lift.floors.push_back({i * height, {name}});
    lift.wait_us = microseconds(wait(plugin, "door_wait_time"));
    const double open = std::min(1.0, model.joints[leaf].axis.upper);
    hold(lift.cabin, {.p = 100000.0, .d = 100000.0});
    hold(leaf, {.p = 2.0, .d = 1.0});
    model.doors.push_back({name, {{name, leaf, 0.0, open}}, {}, plugin.source});
    model.lifts.push_back(std::move(lift));
  }

  void hold(ModelJointIndex index, const Pid& pid) const {
    model.joints[index].axis.position_pid = pid;
    model.joints[index].axis.start = {JointStart::Mode::position, 0.0};
  }

  Lift lift_of(const std::string& cabin) const {
    Lift lift;
    lift.cabin = joint(cabin);
    lift.name = model.joints[lift.cabin].name;
    lift.source = plugin.source;
    return lift;
  }

  // RMF's door; `written` is the plugin, or a <component> in it.
  void door_of_rmf(const Element& written) const {
    const Element* element = written.child("door");
    if (!element) written.fail("has no <door>");
    const std::string* name = element->attribute("name");
    Door door;
    door.name = name && !name->empty() ? *name : model.name;
    door.motion = motion_of(written, "door");
    door.source = element->source;
    for (const char* side : {"left_joint_name", "right_joint_name"}) {
      const std::string* leaf = element->attribute(side);
      if (!leaf || leaf->empty() || *leaf == "empty_joint") continue;
      door.leaves.push_back({*leaf, {}, 0.0, 0.0, side[0] == 'l'});
    }
    if (door.leaves.empty()) element->fail("has no left_joint_name and no right_joint_name");
    model.doors.push_back(std::move(door));
  }

  void lift_of_rmf(const Element& written) const {
    Lift lift = lift_of(written.string("cabin_joint_name", ""));
    lift.motion = motion_of(written, "cabin");
    const std::string initial = written.string("initial_floor", "");
    for (const Element* floor : written.all("floor")) {
      const std::string* name = floor->attribute("name");
      if (name && *name == initial) lift.initial_floor = static_cast<int>(lift.floors.size());
      lift.floors.push_back({elevation(*floor), {}});
      for (const Element* pair : floor->all("door_pair")) {
        for (const char* which : {"cabin_door", "shaft_door"}) {
          const std::string* door = pair->attribute(which);
          if (door && !door->empty()) lift.floors.back().doors.push_back(*door);
        }
      }
    }
    if (lift.floors.empty()) written.fail("has no <floor>");
    model.lifts.push_back(std::move(lift));
  }

  static double elevation(const Element& floor) {
    const std::string* text = floor.attribute("elevation");
    if (!text) floor.fail("has no elevation");
    Element number;
    number.name = "floor elevation";
    number.text = *text;
    number.source = floor.source;
    return number.as_number(Allowed::any(quantity::kLength));
  }

  static Trapezoid motion_of(const Element& written, const std::string& of) {
    Trapezoid motion;
    motion.rate = written.number("v_max_" + of, motion.rate, Allowed::positive(quantity::kSpeed));
    motion.acceleration = written.number("a_nom_" + of, motion.acceleration,
                                         Allowed::positive(quantity::kAcceleration));
    motion.effort =
        written.number("f_max_" + of, motion.effort, Allowed::positive(quantity::kEffort));
    return motion;
  }

  void door() const {
    if (!plugin.children.empty()) door_of_rmf(plugin);
  }
  void lift() const {
    if (!plugin.children.empty()) lift_of_rmf(plugin);
  }
  void components() const {
    for (const Element* component : plugin.all("component")) {
      const std::string* name = component->attribute("name");
      if (name && *name == "Door")
        door_of_rmf(*component);
      else if (name && *name == "Lift")
        lift_of_rmf(*component);
      else
        findings.unsupported(
            component->source, where,
            "the component " + (name ? *name : std::string()) + " of RMF does nothing here");
    }
  }
};

struct Kind {
  const char* plugin;
  void (Reader::*read)() const;
};

constexpr Kind kKinds[] = {
    {"Elevator", &Reader::elevator},
    {"ElevatorPlugin", &Reader::elevator_of_classic},
    {"gazebo_ros_elevator", &Reader::elevator_of_classic},
    {"door", &Reader::door},
    {"lift", &Reader::lift},
    {"register_component", &Reader::components},
};

// The door in the cabin of RMF's lift is a model of its own, but its joints belong to the lift.
void find_leaves(Model& model) {
  for (Door& door : model.doors) {
    for (Door::Leaf& leaf : door.leaves) {
      if (leaf.joint.valid()) continue;
      leaf.joint = find_joint(model, leaf.joint_name);
      if (!leaf.joint.valid()) continue;
      const JointAxis& axis = model.joints[leaf.joint].axis;
      leaf.closed = leaf.left ? axis.upper : axis.lower;
      leaf.open = leaf.left ? axis.lower : axis.upper;
      if (!std::isfinite(leaf.closed)) leaf.closed = 0.0;
      if (!std::isfinite(leaf.open)) leaf.open = leaf.closed;
    }
  }
}

}  // namespace

void read_lifts(const std::vector<const Element*>& plugins, const std::string& where,
                Findings& findings, Model& model) {
  for (const Element* plugin : plugins) {
    const std::string name = kind_of(*plugin).name;
    for (const Kind& kind : kKinds) {
      if (name != kind.plugin) continue;
      read_or_leave_out(where, "it ignores calls", findings,
                        [&] { (Reader{*plugin, where, findings, model}.*kind.read)(); });
    }
  }
  find_leaves(model);
  model.commanded |= !model.doors.empty() || !model.lifts.empty();
}

void check_lifts(const WorldModel& world, Findings& findings) {
  const auto of_others = [&](const std::string& name) {
    return std::any_of(world.models.begin(), world.models.end(),
                       [&](const ModelInstance& each) { return has_door(*each.model, name); });
  };
  for (const ModelInstance& instance : world.models) {
    const std::string where = "model " + instance.name;
    for (const Door& door : instance.model->doors) {
      for (const Door::Leaf& leaf : door.leaves) {
        if (!leaf.joint.valid())
          findings.error(door.source, where,
                         "the door '" + door.name + "' names the joint '" + leaf.joint_name +
                             "', which the model does not have");
      }
    }
    for (const Lift& lift : instance.model->lifts) {
      std::vector<std::string> missing;
      for (const Lift::Floor& floor : lift.floors) {
        for (const std::string& door : floor.doors) {
          if (!has_door(*instance.model, door) && !of_others(door) &&
              std::find(missing.begin(), missing.end(), door) == missing.end())
            missing.push_back(door);
        }
      }
      for (const std::string& door : missing)
        findings.error(lift.source, where,
                       "the lift '" + lift.name + "' names the door '" + door +
                           "', which the world does not have; it does not wait for it");
    }
  }
}

}  // namespace ruedo::world
