// <world>: physics, scene, lights, and the models with their poses.
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "base/text.h"
#include "base/whole.h"
#include "world/compat/plugin_parameters.h"
#include "world/compat/plugins.h"
#include "world/document/reserved_names.h"
#include "world/drives/placement.h"
#include "world/model/own_plugins.h"
#include "world/read/material.h"
#include "world/sdf/crowd.h"
#include "world/sdf/environment.h"
#include "world/sdf/saved_state.h"
#include "world/sdf/sdf_link.h"
#include "world/sdf/sdf_reader.h"

namespace ruedo::world {
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

// The plugin that declares performers and levels to gz-sim's server; it has no library.
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
                           "levels are not supported: the whole world is always loaded");
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

// Of Gazebo Classic's window, or of the plugin that is the later Gazebo's.
std::optional<Pose> read_viewpoint(const Element& world, const std::string& where,
                                   Findings& findings) {
  const Element* gui = world.child("gui");
  if (!gui) return std::nullopt;
  try {
    if (gui->child("camera/pose")) return gui->pose("camera/pose");
    for (const Element* plugin : gui->all("plugin")) {
      if (plugin->child("camera_pose")) return plugin->pose("camera_pose");
    }
  } catch (const InputError& error) {
    findings.unsupported(error.source(), where, "the window's camera: " + error.message());
  }
  return std::nullopt;
}

// Performers that are not models of the world are reported and ignored.
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

// In Gazebo it needs a plugin as well, which a server's configuration may load for every world.
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

// World parameters that change Gazebo's results, but have no effect here, where they differ from
// the format's default.
void name_what_has_no_effect(const Element& world, const std::string& where, Findings& findings) {
  const auto name = [&](const char* path, const std::string& text) {
    if (const Element* element = world.child(path))
      findings.unsupported(element->source, where,
                           "<" + element->name + "> is not supported: " + text);
  };
  name("audio", "nothing sounds");
  for (const Element* population : world.all("population"))
    findings.error(population->source, where,
                   "<population> is not supported: what it would place is missing");
}

void read_scene(const Element& scene, Sky& sky, Findings& findings) {
  const std::string where = "world/scene";
  report_other_children(scene, {"ambient", "background", "sky", "shadows"},
                        {"grid", "origin_visual", "fog"}, where, findings);
  if (const Element* colour = scene.child("ambient"))
    sky.ambient = read_colour(*colour, where, findings);
  if (const Element* colour = scene.child("background"))
    sky.background = read_colour(*colour, where, findings);
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
  if (!fault.robot.empty() && find_fault_kind(fault.kind)->of == FaultKind::Of::world)
    e.fail(fault.kind + " is of the world, and <ruedo:robot> not allowed");
  return fault;
}

}  // namespace

namespace {

// Joins the trajectories in an actor's <script>, each with its own clock, to one list of waypoints
// "time x y z 0 0 yaw". Skins lie on their back in their own frame; a person walks upright.
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
      if (last < 0 && time > 0) walk(begin, at);  // stands there from the start
      walk(begin + time, at);
      last = time;
    }
  }

  void walk(double time, const std::vector<double>& at) {
    // time in which the actor jumps to the start of the next trajectory
    constexpr double kJump_s = 1e-6;
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

namespace {

bool has_own_shape(const Element& actor) {
  const auto links = actor.all("link");
  return !actor.has("skin") && std::any_of(links.begin(), links.end(), [](const Element* link) {
    return link->has("collision") || link->has("visual");
  });
}

// The shapes of an actor's links, as one link.
Link own_shape(const Element& actor, const std::string& where, ReadContext& context) {
  Link all;
  all.name = required_name(*actor.child("link"));
  all.source = actor.source;
  all.kinematic = true;
  all.inertial.mass = 75;
  for (const Element* written : actor.all("link")) {
    const Pose X = written->pose("pose");
    std::vector<SensorDescription> sensors;
    Link link = read_link(
        *written, [](const Element& owner) { return owner.pose("pose"); }, where, context,
        /*moves*/ true, ModelLinkIndex(0), sensors);
    for (Collision& each : link.collisions) {
      each.X_LC = X * each.X_LC;
      all.collisions.push_back(std::move(each));
    }
    for (Visual& each : link.visuals) {
      each.X_LV = X * each.X_LV;
      all.visuals.push_back(std::move(each));
    }
  }
  return all;
}

// `others`: how many more actors there are of which the same is true.
void name_cylinder(const Element& actor, size_t others, Findings& findings) {
  findings.unsupported(
      actor.source, "actor " + required_name(actor),
      "the actor moves as a cylinder of 1.7 m" +
          (others ? " (and " + std::to_string(others) + " more do)" : std::string()) +
          "; skins and animations are not shown");
}

std::shared_ptr<const Model> person(const Element& actor, Pose& X_WM, ReadContext& context) {
  constexpr double kHeight = 1.7, kRadius = 0.25;  // m
  auto model = std::make_shared<Model>();
  model->name = required_name(actor);
  model->source = actor.source;
  const std::string where = "actor " + model->name;
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
  model->links.push_back(has_own_shape(actor) ? own_shape(actor, where, context)
                                              : person_link(kRadius, kHeight, actor.source));
  model->is_static = !model->path;
  return model;
}

}  // namespace

// An actor becomes a person: a cylinder on the floor that moves along its trajectories, without a
// skin. One that has no skin, but shapes, is moved as these.
std::shared_ptr<const Model> SdfReader::actor_model(const Element& actor, Pose& X_WM,
                                                    ReadContext& context) {
  if (!has_own_shape(actor)) name_cylinder(actor, 0, context.findings);
  return person(actor, X_WM, context);
}

namespace {

// Puts an actor's feet on the floor at each waypoint: the floor is only known once the world is.
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

// Reads one <world>: its settings first, then the names and frames of its contents, then their
// positions.
class SdfReader::WorldReader {
 public:
  WorldReader(SdfReader& reader, const Element& element, SdfVersion version, WorldModel& world)
      : reader_(reader),
        context_(reader.context_),
        findings_(context_.findings),
        element_(element),
        version_(version),
        world_(world) {}

  void read() {
    read_settings();
    name_plugins();
    read_children();
    const SavedState saved(element_, findings_);
    for (const Placed& each : placed_) add_model(each, saved);
    name_lost_frames();
    name_wind_without_plugin(element_, world_, findings_);
    check_performers(world_, reader_.performers_, findings_);
    if (first_actor_) name_cylinder(*first_actor_, actors_.size() - 1, findings_);
    stand_actors(actors_, world_);
    const size_t placed = world_.models.size();
    for (const Element* fleet : element_.all("ruedo:fleet"))
      reader_.read_fleet(*fleet, world_, kMaxModels);
    for (const Element* crowd : element_.all("ruedo:crowd")) add_crowd(*crowd, world_, kMaxModels);
    restore_added(saved, placed);
    for (const Element* fault : element_.all("ruedo:fault"))
      world_.faults.push_back(read_fault(*fault));
    for (const Element* light : element_.all("light")) {
      read_or_leave_out(in_world_, "the light is left out", findings_, [&] {
        const Pose pose = frames_.pose(relative_to(*light), *light) * light->pose("pose");
        world_.lights.push_back(read_light(*light, pose, "world/light", context_));
        saved.apply(world_.lights.back());
      });
    }
    name_strangers_of(saved);
  }

 private:
  struct Placed {
    std::string name;
    const Element* element;
    std::shared_ptr<const ScopedModel> scope;
  };

  // Frames by which something is placed were reported there.
  void name_lost_frames() {
    for (const Element* frame : element_.all("frame")) {
      const std::string* name = frame->attribute("name");
      if (name && frames_.has(*name))
        read_or_leave_out(in_world_, "the frame is left out", findings_,
                          [&] { frames_.pose(*name, *frame); });
    }
  }

  // Those of fleets and crowds stand where they were, too.
  void restore_added(const SavedState& saved, size_t first) {
    for (size_t i = first; i < world_.models.size(); ++i) {
      ModelInstance& added = world_.models[InstanceIndex(i)];
      added_.insert(added.name);
      saved.apply(added.name, added, findings_);
    }
  }

  void name_strangers_of(const SavedState& saved) {
    std::set<std::string> models = added_, lights;
    for (const Placed& each : placed_) models.insert(each.name);
    for (const Light& each : world_.lights) lights.insert(each.name);
    saved.name_strangers(models, lights, findings_);
  }

  void read_settings() {
    const std::string* name = element_.attribute("name");  // any name is allowed for a world
    world_.name = name ? *name : "";
    if (world_.name.empty()) {
      world_.name = "world";
      findings_.repaired(element_.source, "world", "the world has no name; it is called 'world'");
    }
    in_world_ = "world " + world_.name;
    report_other_children(element_,
                          {"model", "include", "light", "frame", "physics", "gravity", "scene",
                           "actor", "joint", "atmosphere", "magnetic_field",
                           "spherical_coordinates", "ruedo:fleet", "ruedo:crowd", "ruedo:fault"},
                          {"gui", "wind", "audio", "plugin", "state", "population"}, in_world_,
                          findings_);
    read_or_leave_out(in_world_, "the defaults are used", findings_,
                      [&] { read_physics(element_, world_, findings_); });
    read_environment(element_, world_.environment, findings_);
    if (const Element* scene = element_.child("scene"))
      read_or_leave_out(in_world_, "the defaults are used", findings_,
                        [&] { read_scene(*scene, world_.sky, findings_); });
    world_.viewpoint = read_viewpoint(element_, in_world_, findings_);
    name_what_has_no_effect(element_, in_world_, findings_);
  }

  void name_plugins() {
    load_own_plugins(element_.all("plugin"));
    reader_.performers_ = read_performers(element_, in_world_, findings_);
    std::set<std::string> named;
    for (const Element* plugin : element_.all("plugin")) {
      if (has_levels(*plugin)) continue;
      const PluginKind kind = kind_of(*plugin);
      const bool dead = kind.does == PluginKind::Does::dead;
      if (kind.is_in_model) {
        if (named.insert(kind.name).second)
          findings_.unsupported(
              plugin->source, in_world_,
              "the plugin " + kind.name + " does nothing in <world>: it belongs into a model");
        continue;
      }
      name_parameters(*plugin, in_world_, findings_);
      if (!dead && kind.does != PluginKind::Does::unknown) continue;
      if (!named.insert(kind.name).second) continue;
      findings_.unsupported(plugin->source, in_world_,
                            dead ? "the plugin " + kind.name + " does nothing here: " + kind.would
                                 : "plugins of Gazebo's server are not loaded: " + kind.name);
    }
  }

  // Frames last: of two things with one name, the frame is dropped.
  void read_children() {
    for (const bool frames : {false, true}) {
      for (const auto& child : element_.children) {
        if ((child->name == "frame") != frames) continue;
        const size_t open_files = reader_.files_.size();
        if (!read_or_leave_out(
                in_world_,
                "the " + (child->name == "include" ? "model" : child->name) + " is left out",
                findings_, [&] { read_child(*child); }))
          reader_.files_.resize(open_files);
      }
    }
  }

  void read_child(const Element& child) {
    if (child.name == "model") {
      auto model = reader_.read_model(child, version_);
      place(std::move(model), name_of_model(child), child);
    } else if (child.name == "include") {
      read_include(child);
    } else if (child.name == "frame") {
      read_frame(child);
    } else if (child.name == "actor") {
      place_actor(child, required_name(child), child);
    }
  }

  void read_include(const Element& child) {
    const auto included = reader_.include(child, "world/include");
    if (!included) return;
    if (included->light) {
      world_.lights.push_back(read_light(*included->light,
                                         child.pose("pose", included->light->pose("pose")),
                                         "world/light", context_));
      world_.lights.back().name = included->name;
    } else if (included->actor) {
      place_actor(*included->actor, included->name, child);
    } else {
      place(included->model, included->name, child);
    }
  }

  void read_frame(const Element& child) {
    FrameGraph::Node node;
    node.element = &child;
    node.name = required_name(child);
    if (frames_.has(node.name)) child.fail("the name '" + node.name + "' is taken in the world");
    node.pose = child.pose("pose");
    node.relative_to = relative_to(child);
    if (const std::string* frame = child.attribute("attached_to")) node.attached_to = *frame;
    if (node.relative_to.empty()) node.relative_to = node.attached_to;
    frames_.add(std::move(node));
  }

  // Ignores a model without a link.
  void place(std::shared_ptr<const ScopedModel> scope, std::string name, const Element& by) {
    if (!scope) return;
    if (frames_.has(name)) {
      const std::string taken = name;
      int& number = numbers_.try_emplace(taken, 2).first->second;
      while (frames_.has(name = taken + "_" + std::to_string(number))) ++number;
      findings_.error(
          by.source, "model " + taken,
          "a second thing of the name '" + taken + "'; this one is called '" + name + "'");
    }
    if (placed_.size() >= kMaxModels)
      throw TooLarge(by.source, "<" + by.name + ">: the world has more than " +
                                    std::to_string(kMaxModels) + " models");
    FrameGraph::Node node;
    node.name = name;
    node.element = &by;
    node.pose = scope->pose;
    node.relative_to = scope->relative_to;
    node.placement_frame = scope->placement_frame;
    node.scope = scope;
    placed_.push_back({std::move(name), &by, std::move(scope)});
    frames_.add(std::move(node));
  }

  void place_actor(const Element& actor, const std::string& name, const Element& by) {
    auto scope = std::make_shared<ScopedModel>();
    scope->model = person(actor, scope->pose, context_);
    FrameGraph::Node node;
    node.name = name;
    node.element = &by;
    node.pose = scope->pose;
    node.scope = scope;
    frames_.add(node);
    placed_.push_back({name, &by, scope});
    if (has_own_shape(actor)) return;
    if (actors_.empty()) first_actor_ = &actor;
    actors_.insert(dotted(name));
  }

  void add_model(const Placed& each, const SavedState& saved) {
    ModelInstance instance;
    instance.name = dotted(each.name);
    if (!read_or_leave_out(in_world_, "the model is left out", findings_,
                           [&] { instance.X_WM = frames_.pose(each.name, *each.element); }))
      return;
    instance.model = each.scope->model;
    saved.apply(each.name, instance, findings_);
    if (instance.is_robot()) name_robot(instance, each.element->source);
    check_channel_names(instance, each.element->source);
    world_.models.push_back(std::move(instance));
  }

  // Channel names contain the robot's name.
  void name_robot(ModelInstance& instance, const Source& source) {
    const std::string fit = made_fit_for_channel(instance.name);
    std::string name = fit;
    const auto taken = [&] {
      return frames_.has(name) ||
             std::any_of(world_.models.begin(), world_.models.end(),
                         [&](const auto& other) { return other.name == name; });
    };
    for (int number = 2; name != instance.name && taken(); ++number)
      name = fit + "_" + std::to_string(number);
    if (name == instance.name) return;
    findings_.repaired(source, "model " + instance.name,
                       "the name is not fit for a channel; the robot is called '" + name + "'");
    instance.name = name;
  }

  SdfReader& reader_;
  ReadContext& context_;
  Findings& findings_;
  const Element& element_;
  SdfVersion version_;
  WorldModel& world_;
  std::string in_world_;  // for findings
  FrameGraph frames_{"the world"};
  std::vector<Placed> placed_;
  std::set<std::string> actors_;  // those that move as cylinders
  const Element* first_actor_ = nullptr;
  std::set<std::string> added_;         // names of those of fleets and crowds
  std::map<std::string, int> numbers_;  // the next number for each name
};

void SdfReader::read_world(const Element& element, SdfVersion version, WorldModel& world) {
  if (element.has("joint")) {
    read_world(*with_joined_models(element, version), version, world);
    return;
  }
  WorldReader(*this, element, version, world).read();
}

}  // namespace ruedo::world
