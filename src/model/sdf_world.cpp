// <world>: physics, scene, lights, and the models with their poses.
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "core/whole.h"
#include "model/crowd.h"
#include "model/environment.h"
#include "model/material.h"
#include "model/own_plugins.h"
#include "model/placement.h"
#include "model/plugins.h"
#include "model/saved_state.h"
#include "model/sdf_link.h"
#include "model/sdf_reader.h"

namespace ruedo::model {
namespace {

constexpr size_t kMaxModels = 100'000;

void read_step(const Element& physics, WorldModel& world, Findings& findings) {
  const Element* step = physics.child("max_step_size");
  if (!step) return;
  const double seconds = step->as_number(Allowed{1e-6, 1.0, false});
  world.step_us = microseconds(seconds);
  if (std::abs(static_cast<double>(world.step_us) - seconds * 1e6) > 1e-6) {
    findings.repaired(step->source, "world/physics",
                      "the step " + step->text +
                          " s is not a whole number of microseconds; it is " +
                          std::to_string(world.step_us) + " us instead");
  }
}

void read_solver(const Element& bullet, SolverDescription& solver, Findings& findings) {
  bullet.refuse_unknown({"ruedo:substeps", "ruedo:tolerance"});
  constexpr const char* kType = "solver/type";
  if (const std::string type = bullet.string(kType, "sequential_impulse");
      type != "sequential_impulse") {
    findings.unsupported(
        bullet.child(kType)->source, "world/physics/bullet",
        "the solver '" + type + "' is not supported; sequential_impulse is used instead");
  }
  const auto whole = [&](const char* path, int fallback, int lowest, int highest) {
    return static_cast<int>(bullet.integer(path, fallback, Allowed::between(lowest, highest)));
  };
  solver.iterations = whole("solver/iters", solver.iterations, 1, 100'000);
  solver.error_reduction =
      bullet.number("constraints/erp", solver.error_reduction, Allowed::between(0, 1));
  solver.tolerance = bullet.number("ruedo:tolerance", solver.tolerance, Allowed::between(0, 1));
  solver.substeps = whole("ruedo:substeps", solver.substeps, 0, 1000);
}

void read_physics(const Element& world_element, WorldModel& world, Findings& findings) {
  const Allowed gravity = Allowed::any(quantity::kGravity);
  const auto all = world_element.all("physics");
  const Element* chosen = all.empty() ? nullptr : all[0];
  for (const Element* each : all) {
    const std::string* is_default = each->attribute("default");
    if (is_default && (*is_default == "1" || *is_default == "true")) {
      chosen = each;
      break;
    }
  }
  if (chosen) {
    report_other_children(
        *chosen, {"max_step_size", "real_time_factor", "real_time_update_rate", "gravity"},
        {"ode", "bullet", "simbody", "dart", "max_contacts", "magnetic_field", "update_rate"},
        "world/physics", findings);
    if (const Element* bullet = chosen->child("bullet"))
      read_solver(*bullet, world.solver, findings);
    read_step(*chosen, world, findings);
    world.gravity = chosen->vector3("gravity", world.gravity, gravity);  // SDF before 1.6
  }
  world.gravity = world_element.vector3("gravity", world.gravity, gravity);
}

// The plugin by which gz-sim's server knows performers and levels; it has no library.
bool has_levels(const Element& plugin) {
  const std::string* name = plugin.attribute("name");
  return name && (*name == "gz::sim" || *name == "ignition::gazebo");
}

std::vector<const Element*> read_performers(const Element& world, const std::string& where,
                                            Findings& findings) {
  std::vector<const Element*> performers;
  for (const Element* plugin : world.all("plugin")) {
    if (!has_levels(*plugin)) continue;
    if (const Element* level = plugin->child("level"))
      findings.unsupported(level->source, where,
                           "levels are not supported: all of the world is there always");
    for (const Element* each : plugin->all("performer")) {
      read_or_leave_out(where, "the performer is left out", findings, [&] {
        const Element* size = each->child("geometry/box/size");
        if (!size) each->fail("has no <geometry><box><size>");
        size->as_vector3(Allowed::not_negative(quantity::kLength));
        if (each->string("ref", "").empty()) each->fail("has no <ref>");
        performers.push_back(each);
      });
    }
  }
  return performers;
}

// Who is no model of the world is nowhere.
void check_performers(const WorldModel& world, const std::vector<const Element*>& performers,
                      Findings& findings) {
  for (const Element* each : performers) {
    const std::string ref = each->string("ref", "");
    if (std::none_of(world.models.begin(), world.models.end(),
                     [&](const ModelInstance& model) { return model.name == dotted(ref); }))
      findings.error(each->source, "world " + world.name,
                     "<performer>: the world has no model '" + ref + "'");
  }
}

// In Gazebo, too, it takes a plugin; servers have been told to load it for every world.
void name_wind_without_plugin(const Element& element, const WorldModel& world, Findings& findings) {
  const Wind& wind = world.environment.wind;
  if (wind.pushes || wind.velocity == Vec3::Zero()) return;
  for (const ModelInstance& instance : world.models) {
    for (const Link& link : instance.model->links) {
      if (link.wind)
        return findings.unsupported(element.child("wind")->source, "world " + world.name,
                                    "<enable_wind> has no effect: the wind pushes only with the "
                                    "plugin WindEffects in <world>");
    }
  }
}

// Of a world, what changes things in Gazebo and does not here, where it says more than the format's
// own default.
void name_what_has_no_effect(const Element& world, const std::string& where, Findings& findings) {
  const auto name = [&](const char* path, const std::string& text) {
    if (const Element* element = world.child(path))
      findings.unsupported(element->source, where,
                           "<" + element->name + "> is not supported: " + text);
  };
  name("population", "what it would place is left out");
  name("audio", "nothing sounds");
}

void read_scene(const Element& scene, Sky& sky, Findings& findings) {
  report_other_children(scene, {"ambient", "background", "sky", "shadows"},
                        {"grid", "origin_visual", "fog"}, "world/scene", findings);
  if (const Element* colour = scene.child("ambient")) sky.ambient = read_colour(*colour);
  if (const Element* colour = scene.child("background")) sky.background = read_colour(*colour);
  sky.sky = scene.has("sky");
  sky.shadows = scene.boolean("shadows", true);
  if (const Element* fog = scene.child("fog"); fog && fog->string("type", "none") != "none") {
    findings.unsupported(fog->source, "world/scene", "<fog> is not supported: the air is clear");
  }
}

void add_child(Element& parent, const char* name, const std::string& text) {
  auto child = std::make_unique<Element>();
  child->name = name;
  child->text = text;
  child->source = parent.source;
  parent.children.push_back(std::move(child));
}

Fault read_fault(const Element& e) {
  e.refuse_unknown({"ruedo:robot", "ruedo:target", "ruedo:kind", "ruedo:at", "ruedo:for",
                    "ruedo:value", "ruedo:from", "ruedo:to", "ruedo:x", "ruedo:y", "ruedo:heading"},
                   false);
  if (!e.has("ruedo:kind")) e.fail("has no <ruedo:kind>");
  Fault fault;
  fault.robot = e.string("ruedo:robot", "");
  fault.target = e.string("ruedo:target", "");
  fault.kind = e.string("ruedo:kind", "");
  fault.at_s = e.number("ruedo:at", 0.0, Allowed::between(0, 1e6));
  fault.duration_s = e.number("ruedo:for", 0.0, Allowed::between(0, 1e6));
  fault.value = e.number("ruedo:value", 0.0, Allowed::between(-1e6, 1e6));
  fault.from = e.number("ruedo:from", 0.0, Allowed::between(0, 1));
  fault.to = e.number("ruedo:to", 1.0, Allowed::between(0, 1));
  fault.x = e.number("ruedo:x", 0.0, Allowed::between(-1e6, 1e6));
  fault.y = e.number("ruedo:y", 0.0, Allowed::between(-1e6, 1e6));
  fault.heading = e.number("ruedo:heading", 0.0, Allowed::between(-1e6, 1e6));
  fault.source = e.source;
  if (const std::string why = check_fault(fault); !why.empty()) e.fail(why);
  return fault;
}

}  // namespace

namespace {

// The trajectories of an actor's <script>, one after another, each with a clock of its own, as one
// list of waypoints "time x y z 0 0 yaw". Skins lie on their back in their own frame; a person
// walks upright.
class Script {
 public:
  Script(const Element& script, const std::string& where, Findings& findings)
      : where_(where),
        findings_(findings),
        end_(script.number("delay_start", 0, Allowed::not_negative(quantity::kTime))) {
    for (const Element* trajectory : script.all("trajectory")) add(*trajectory);
  }

  const std::vector<std::string>& waypoints() const { return waypoints_; }

 private:
  void add(const Element& trajectory) {
    const double begin = end_;
    double last = -1;
    for (const Element* waypoint : trajectory.all("waypoint")) {
      const double time = waypoint->number("time", 0, Allowed::not_negative(quantity::kTime));
      if (time <= last) {
        findings_.error(waypoint->source, where_,
                        "the time " + shown(time) +
                            " s is not after that of the waypoint before; this one is left out");
        continue;
      }
      std::vector<double> at =
          waypoint->has("pose")
              ? waypoint->child("pose")->as_numbers(Allowed::any(quantity::kLength))
              : std::vector<double>(6, 0.0);
      if (at.size() != 6)
        waypoint->child("pose")->fail("'" + waypoint->child("pose")->text +
                                      "' is not allowed; allowed are x y z roll pitch yaw");
      if (last < 0 && time > 0) walk(begin, at);  // there from the start
      walk(begin + time, at);
      last = time;
    }
  }

  void walk(double time, const std::vector<double>& at) {
    constexpr double kJump_s = 1e-6;  // to where the next trajectory begins
    if (!waypoints_.empty() && time <= end_) time = end_ + kJump_s;
    end_ = time;
    std::string text;
    for (const double value : {time, at[0], at[1], at[2], 0.0, 0.0, at[5]})
      text += (text.empty() ? "" : " ") + shown(value);
    waypoints_.push_back(text);
  }

  const std::string& where_;
  Findings& findings_;
  double end_;
  std::vector<std::string> waypoints_;
};

void name_plugins_of_actor(const Element& actor, const std::string& where, Findings& findings) {
  for (const Element* plugin : actor.all("plugin")) {
    const PluginKind kind = kind_of(*plugin);
    if (kind.does == PluginKind::Does::dead)
      findings.unsupported(plugin->source, where,
                           "the plugin " + kind.name + " does nothing here: " + kind.would);
    else if (kind.does == PluginKind::Does::unknown)
      findings.unsupported(plugin->source, where, "plugins are not loaded: " + kind.name);
  }
}

}  // namespace

// An actor is a person: a cylinder that stands on the floor and moves along his trajectories,
// without a skin.
std::shared_ptr<const Model> SdfReader::actor_model(const Element& actor, Pose& X_WM,
                                                    ReadContext& context) {
  constexpr double kHeight = 1.7, kRadius = 0.25;  // m
  auto model = std::make_shared<Model>();
  model->name = required_name(actor);
  model->source = actor.source;
  const std::string where = "actor " + model->name;
  context.findings.unsupported(
      actor.source, where, "actors move as cylinders of 1.7 m; skins and animations are not shown");
  name_plugins_of_actor(actor, where, context.findings);
  X_WM = actor.pose("pose");
  auto path = std::make_shared<Element>();
  path->name = "ruedo:path";
  path->source = actor.source;
  if (const Element* script = actor.child("script")) {
    const Script walk(*script, where, context.findings);
    for (const std::string& waypoint : walk.waypoints())
      add_child(*path, "ruedo:waypoint", waypoint);
    if (!walk.waypoints().empty()) {
      const std::vector<double> at =
          path->children.front()->as_numbers(Allowed::any(quantity::kTime));
      X_WM = Pose::from_xyz_rpy({at[1], at[2], at[3]}, {0, 0, at[6]});
      add_child(*path, "ruedo:loop", script->boolean("loop", true) ? "true" : "false");
    }
  }
  X_WM.rotation = Quat(Eigen::AngleAxisd(heading(X_WM.rotation), Vec3::UnitZ()));
  if (path->children.size() > 1) model->path = path;
  model->links.push_back(person_link(kRadius, kHeight, actor.source));
  model->is_static = !model->path;
  return model;
}

namespace {

// Puts an actor's feet on the floor of each of his waypoints: only the world knows where that is.
void stand_actor(const Room& room, ModelInstance& instance) {
  Vec3& at = instance.X_WM.translation;
  at.z() = room.floor_height(at.x(), at.y(), at.z());
  if (!instance.model->path) return;
  auto model = std::make_shared<Model>(*instance.model);
  std::shared_ptr<Element> path = instance.model->path->clone();
  for (const auto& waypoint : path->children) {
    if (waypoint->name != "ruedo:waypoint") continue;
    std::vector<double> values = waypoint->as_numbers(Allowed::any(quantity::kTime));
    values[3] = room.floor_height(values[1], values[2], values[3]);
    waypoint->text.clear();
    for (const double value : values)
      waypoint->text += (waypoint->text.empty() ? "" : " ") + shown(value);
  }
  model->path = std::move(path);
  instance.model = std::move(model);
}

void stand_actors(const std::set<std::string>& actors, WorldModel& world) {
  if (actors.empty()) return;
  Room room;
  for (const ModelInstance& instance : world.models) {
    if (!actors.contains(instance.name)) room.add(instance);
  }
  for (ModelInstance& instance : world.models) {
    if (actors.contains(instance.name)) stand_actor(room, instance);
  }
}

}  // namespace

void SdfReader::read_world(const Element& element, SdfVersion version, WorldModel& world) {
  if (element.has("joint")) {
    read_world(*with_joined_models(element, version), version, world);
    return;
  }
  Findings& findings = context_.findings;
  const std::string* name = element.attribute("name");  // no name is reserved for it
  world.name = name ? *name : "";
  if (world.name.empty()) {
    world.name = "world";
    findings.repaired(element.source, "world", "the world has no name; it is called 'world'");
  }
  report_other_children(element,
                        {"model", "include", "light", "frame", "physics", "gravity", "scene",
                         "actor", "joint", "atmosphere", "magnetic_field", "spherical_coordinates",
                         "ruedo:fleet", "ruedo:crowd", "ruedo:fault"},
                        {"gui", "wind", "audio", "plugin", "state", "population"},
                        "world " + world.name, findings);
  const std::string in_world = "world " + world.name;
  read_or_leave_out(in_world, "what is usual is taken", findings,
                    [&] { read_physics(element, world, findings); });
  read_environment(element, world.environment, findings);
  if (const Element* scene = element.child("scene"))
    read_or_leave_out(in_world, "what is usual is taken", findings,
                      [&] { read_scene(*scene, world.sky, findings); });
  name_what_has_no_effect(element, in_world, findings);

  std::set<std::string> named;
  load_own_plugins(element.all("plugin"));
  performers_ = read_performers(element, in_world, findings);
  for (const Element* plugin : element.all("plugin")) {
    if (has_levels(*plugin)) continue;
    const PluginKind kind = kind_of(*plugin);
    const bool dead = kind.does == PluginKind::Does::dead;
    if (!dead && kind.does != PluginKind::Does::unknown) continue;
    if (!named.insert(kind.name).second) continue;
    findings.unsupported(plugin->source, in_world,
                         dead ? "the plugin " + kind.name + " does nothing here: " + kind.would
                              : "plugins of Gazebo's server are not loaded: " + kind.name);
  }
  FrameGraph frames("the world");
  struct Placed {
    std::string name;
    const Element* element;
    std::shared_ptr<const ScopedModel> scope;
  };
  std::vector<Placed> placed;
  std::set<std::string> actors;
  const auto place_actor = [&](const Element& actor, const std::string& name, const Element& by) {
    auto scope = std::make_shared<ScopedModel>();
    scope->model = actor_model(actor, scope->pose, context_);
    FrameGraph::Node node;
    node.name = name;
    node.element = &by;
    node.pose = scope->pose;
    node.scope = scope;
    frames.add(node);
    placed.push_back({name, &by, scope});
    actors.insert(dotted(name));
  };
  std::map<std::string, int> numbers;  // of the next thing of a name
  const auto read_child = [&](const std::unique_ptr<Element>& child) {
    FrameGraph::Node node;
    node.element = child.get();
    if (child->name == "model" || child->name == "include") {
      if (child->name == "model") {
        node.scope = read_model(*child, version);
        node.name = required_name(*child);
      } else {
        const auto included = include(*child, "world/include");
        if (!included) return;
        if (included->light) {
          world.lights.push_back(read_light(*included->light,
                                            child->pose("pose", included->light->pose("pose")),
                                            "world/light", context_));
          world.lights.back().name = included->name;
          return;
        }
        if (included->actor) {
          place_actor(*included->actor, included->name, *child);
          return;
        }
        node.scope = included->model;
        node.name = included->name;
      }
      if (!node.scope) return;
      if (frames.has(node.name)) {
        std::string name;
        int& number = numbers.try_emplace(node.name, 2).first->second;
        while (frames.has(name = node.name + "_" + std::to_string(number))) ++number;
        findings.error(
            child->source, "model " + node.name,
            "a second thing of the name '" + node.name + "'; this one is called '" + name + "'");
        node.name = name;
      }
      if (placed.size() >= kMaxModels)
        throw TooLarge(child->source, "<" + child->name + ">: the world has more than " +
                                          std::to_string(kMaxModels) + " models");
      node.pose = node.scope->pose;
      node.relative_to = node.scope->relative_to;
      node.placement_frame = node.scope->placement_frame;
      placed.push_back({node.name, child.get(), node.scope});
    } else if (child->name == "frame") {
      node.name = required_name(*child);
      if (frames.has(node.name)) child->fail("the name '" + node.name + "' is taken in the world");
      node.pose = child->pose("pose");
      node.relative_to = relative_to(*child);
      if (const std::string* frame = child->attribute("attached_to")) node.attached_to = *frame;
      if (node.relative_to.empty()) node.relative_to = node.attached_to;
    } else if (child->name == "actor") {
      place_actor(*child, required_name(*child), *child);
      return;
    } else {
      return;
    }
    frames.add(std::move(node));
  };
  std::vector<const std::unique_ptr<Element>*>
      in_order;  // frames last: of two of one name the frame goes
  for (const bool is_frame : {false, true}) {
    for (const auto& child : element.children) {
      if ((child->name == "frame") == is_frame) in_order.push_back(&child);
    }
  }
  for (const auto* each : in_order) {
    const std::unique_ptr<Element>& child = *each;
    const size_t open_files = files_.size();
    if (!read_or_leave_out(
            in_world, "the " + (child->name == "include" ? "model" : child->name) + " is left out",
            findings, [&] { read_child(child); }))
      files_.resize(open_files);
  }
  const SavedState saved(element, findings);
  for (const Placed& each : placed) {
    ModelInstance instance;
    instance.name = dotted(each.name);
    if (!read_or_leave_out(in_world, "the model is left out", findings,
                           [&] { instance.X_WM = frames.pose(each.name, *each.element); }))
      continue;
    instance.model = each.scope->model;
    saved.put_back(each.name, instance, findings);
    if (instance.is_robot()) {
      const std::string fit = made_fit_for_channel(instance.name);
      std::string name = fit;
      const auto taken = [&] {
        return frames.has(name) ||
               std::any_of(world.models.begin(), world.models.end(),
                           [&](const auto& other) { return other.name == name; });
      };
      for (int number = 2; name != instance.name && taken(); ++number)
        name = fit + "_" + std::to_string(number);
      if (name != instance.name) {
        findings.repaired(each.element->source, "model " + instance.name,
                          "the name is not fit for a channel; the robot is called '" + name + "'");
        instance.name = name;
      }
    }
    check_channel_names(instance, each.element->source);
    world.models.push_back(std::move(instance));
  }
  name_wind_without_plugin(element, world, findings);
  check_performers(world, performers_, findings);
  stand_actors(actors, world);
  for (const Element* fleet : element.all("ruedo:fleet")) read_fleet(*fleet, world, kMaxModels);
  for (const Element* crowd : element.all("ruedo:crowd")) add_crowd(*crowd, world, kMaxModels);
  for (const Element* fault : element.all("ruedo:fault"))
    world.faults.push_back(read_fault(*fault));
  for (const Element* light : element.all("light")) {
    read_or_leave_out(in_world, "the light is left out", findings, [&] {
      const Pose pose = frames.pose(relative_to(*light), *light) * light->pose("pose");
      world.lights.push_back(read_light(*light, pose, "world/light", context_));
      saved.put_back(world.lights.back());
    });
  }
}

}  // namespace ruedo::model
