// Everything is checked first; an exception afterwards leaves the world unchanged.
#include "engine/edits/edits.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <span>

#include <fmt/format.h>

#include "base/sha256.h"
#include "base/text.h"
#include "base/utf8.h"
#include "engine/edits/world_editor.h"
#include "world/document/reserved_names.h"
#include "world/drives/placement.h"
#include "world/read/read_context.h"
#include "world/read/triangle_count.h"

namespace ruedo::engine {
namespace {

constexpr size_t kLongestName = 255;  // bytes

Outcome bad(const std::string& text) { return Outcome::refuse(reply_t::BAD_REQUEST, text); }
Outcome refused(const std::string& text) { return Outcome::refuse(reply_t::REFUSED, text); }

std::string list_of(std::span<const double> values) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "" : ", ") + shown(value);
  return "(" + text + ")";
}

// "": all are numbers, and none is beyond `most`.
std::string fault_of(const char* what, std::span<const double> values, double most,
                     const char* unit) {
  for (const double value : values) {
    if (!std::isfinite(value))
      return std::string(what) + " is " + list_of(values) + ": only finite numbers are allowed";
    if (std::abs(value) > most) {
      return std::string(what) + " is " + list_of(values) + ": allowed is up to " + shown(most) +
             " " + unit;
    }
  }
  return "";
}

Pose pose_of(const double (&position)[3], const double (&orientation)[4]) {
  return Pose{Quat(orientation[0], orientation[1], orientation[2], orientation[3]).normalized(),
              Vec3(position[0], position[1], position[2])};
}

Outcome unknown(const std::string& name) {
  return Outcome::refuse(reply_t::UNKNOWN_NAME, "there is no model called '" + name + "'");
}

// Why a model cannot be pushed; "": it can.
std::string why_immovable(const Simulation& simulation, InstanceIndex instance) {
  const world::Model& model = *simulation.world().models[instance].model;
  if (model.path) return "moves along its path";
  const world::BodyLayout& layout = simulation.layout();
  const size_t first = static_cast<size_t>(layout.first_link[instance]);
  bool moves = false, stands = false;
  for (size_t link = first; link < first + model.links.size(); ++link)
    (layout.links[link].body.valid() ? moves : stands) = true;
  for (const world::Joint& joint : model.joints) stands |= !joint.parent.valid();
  if (!moves) return "is static";
  return stands ? "is fixed to the world by a joint" : "";
}

Pose link_now(const Simulation& simulation, InstanceIndex instance, ModelLinkIndex link) {
  const world::BodyLayout& layout = simulation.layout();
  const world::LinkPlacement& placement = layout.links[layout.link_of(instance, link)];
  return placement.body.valid() ? simulation.physics().pose(placement.body) * placement.X_BL
                                : placement.X_BL;
}

// A text has no folder; that of its includes is the world's, which is not the client's to know.
std::string told(const InputError& error) {
  const Source& source = error.source();
  const std::string file = std::filesystem::path(source.file).filename().string();
  return file == "the text" ? InputError({file, source.line}, error.message()).what()
                            : error.what();
}

}  // namespace

std::string fault_of_pose(const double (&position)[3], const double (&orientation)[4]) {
  if (std::string fault = fault_of("position", position, kFarthest_m, "m"); !fault.empty())
    return fault;
  double squared = 0.0;
  for (const double part : orientation) squared += part * part;
  if (!(std::abs(squared - 1.0) <= 2e-3)) {  // also false for NaN
    return "orientation is " + list_of(orientation) + ": expected a unit quaternion w, x, y, z";
  }
  return "";
}

std::string fault_of_name(const std::string& name) {
  if (name.empty() || name.size() > kLongestName)
    return fmt::format("has {} bytes; allowed are 1 to {}", name.size(), kLongestName);
  if (!is_one_line(name)) return "is not UTF-8 text without control characters";
  if (name == "ruedo" || world::is_reserved_name(name))
    return "is reserved for Ruedo; choose another";
  if (name.starts_with(' ') || name.ends_with(' ')) return "begins or ends with a blank";
  if (name.find("::") != std::string::npos)
    return "contains '::', which separates the parts of a name";
  return "";
}

world::LoadedModel ModelStore::load(const spawn_request_t& request, world::LoadBudget* budget) {
  std::string key;
  if (request.model.empty()) {
    key = "text " +
          sha256(reinterpret_cast<const uint8_t*>(request.text.data()), request.text.size());
  } else {
    const std::string path = world::model_file(request.model, world_file_);
    std::error_code error;
    const auto written = std::filesystem::last_write_time(path, error).time_since_epoch().count();
    key = "file " + std::to_string(written) + " " + path;
  }
  {
    const std::lock_guard lock(mutex_);
    std::erase_if(known_, [](const auto& entry) { return entry.second.model.expired(); });
    if (const auto known = known_.find(key); known != known_.end()) {
      world::LoadedModel loaded = known->second.rest;
      loaded.model = known->second.model.lock();
      if (loaded.model) return loaded;
    }
  }
  world::LoadedModel loaded = request.model.empty()
                                  ? world::load_model_text(request.text, world_file_, budget)
                                  : world::load_model(request.model, world_file_, budget);
  const std::lock_guard lock(mutex_);
  Known& known = known_[key];
  known.model = loaded.model;
  known.rest = loaded;
  known.rest.model.reset();
  known.rest.files_read.clear();  // the log records them only once
  return loaded;
}

Outcome check_spawn(const spawn_request_t& request) {
  if (request.model.empty() == request.text.empty())
    return bad("a SPAWN has either a model's name or file, or a text");
  if (std::string fault = fault_of_pose(request.position, request.orientation); !fault.empty())
    return bad(fault);
  if (request.name.empty()) return {};
  const std::string fault = fault_of_name(request.name);
  return fault.empty() ? Outcome{} : bad("the name '" + shortened(request.name, 80) + "' " + fault);
}

Outcome spawn(const spawn_request_t& request, const world::LoadedModel& loaded, int64_t step,
              Simulation& simulation, Channels& channels, std::string& name, Findings& findings) {
  const world::WorldModel& world = simulation.world();
  if (world.models.size() >= kMostModels) {
    return refused("the world has " + std::to_string(kMostModels) +
                   " models, those that were removed included; a reset makes room");
  }
  if (!request.name.empty() && find_model(world, request.name).valid())
    return refused("the name '" + request.name + "' is taken");
  if (const std::string fault = world::placed_triangles_fault(world, loaded.model.get());
      !fault.empty())
    return refused("with this model, " + fault);
  name = request.name.empty() ? unused_name(world, loaded.name) : request.name;
  if (const std::string fault = fault_of_name(name); !fault.empty())
    return bad("the model's name '" + name + "' " + fault);
  const world::ModelInstance asked{name, {}, loaded.model};
  for (const world::ModelInstance& other : world.models) {
    const std::string path = other.removed ? "" : shared_path(other, asked);
    if (!path.empty())
      return refused("the name '" + name + "' is taken: with it, '" + path +
                     "' is a link of one model and a part or the name of another");
  }
  const Pose X_WM = spawn_pose(world, *loaded.model, request);
  const auto now = [&](InstanceIndex instance, ModelLinkIndex link) {
    return link_now(simulation, instance, link);
  };
  if (const std::string other = world::overlapped(world, *loaded.model, X_WM, now);
      !other.empty()) {
    return refused("there is no room for '" + name + "' at " +
                   list_of({{X_WM.translation.x(), X_WM.translation.y(), X_WM.translation.z()}}) +
                   ": it would stand in '" + other + "'");
  }
  try {
    world::check_channel_names({name, X_WM, loaded.model}, loaded.model->source);
    simulation.add_model(name, X_WM, loaded.model, step, channels, findings);
  } catch (const InputError& error) {
    return bad(told(error));
  } catch (const EnvironmentError& error) {
    return refused(error.what());
  }
  return {};
}

Outcome remove(const std::string& name, Simulation& simulation, Channels& channels) {
  const InstanceIndex instance = find_model(simulation.world(), name);
  if (!instance.valid()) return unknown(name);
  simulation.remove_model(instance, channels);
  return {};
}

Pose pose_of(const set_pose_request_t& request) {
  return pose_of(request.position, request.orientation);
}

bool is_fixed(const world::WorldModel& world, const std::string& name) {
  const InstanceIndex instance = find_model(world, name);
  if (!instance.valid()) return false;
  const world::Model& model = *world.models[instance].model;
  return !model.path && (model.is_static || std::any_of(model.joints.begin(), model.joints.end(),
                                                        [](const world::Joint& joint) {
                                                          return !joint.parent.valid();
                                                        }));
}

Outcome set_pose(const set_pose_request_t& request, int64_t step, Simulation& simulation,
                 Channels& channels) {
  if (const std::string fault = fault_of_pose(request.position, request.orientation);
      !fault.empty())
    return bad(fault);
  const InstanceIndex instance = find_model(simulation.world(), request.name);
  if (!instance.valid()) return unknown(request.name);
  const Pose X_WM = pose_of(request);
  if (is_fixed(simulation.world(), request.name)) {
    const auto model = simulation.world().models[instance].model;
    Findings findings;
    simulation.remove_model(instance, channels);
    simulation.add_model(request.name, X_WM, model, step, channels, findings);
    return {};
  }
  if (const std::string why = why_immovable(simulation, instance); !why.empty())
    return refused("'" + request.name + "' " + why);
  simulation.robots().set_pose(instance, X_WM);
  return {};
}

Outcome set_twist(const set_twist_request_t& request, Simulation& simulation) {
  if (const std::string fault = fault_of("linear", request.linear, kFastest_m_s, "m/s");
      !fault.empty())
    return bad(fault);
  if (const std::string fault = fault_of("angular", request.angular, kFastest_rad_s, "rad/s");
      !fault.empty())
    return bad(fault);
  const InstanceIndex instance = find_model(simulation.world(), request.name);
  if (!instance.valid()) return unknown(request.name);
  std::string why = why_immovable(simulation, instance);
  const world::Model& model = *simulation.world().models[instance].model;
  const bool kinematic = std::any_of(model.links.begin(), model.links.end(),
                                     [](const world::Link& link) { return link.kinematic; });
  if (why.empty() && model.drive) why = "has a drive: send it a velocity command";
  if (why.empty() && kinematic) why = "is kinematic: it stays where it is put";
  if (!why.empty()) return refused("'" + request.name + "' " + why);
  const auto vec = [](const double(&v)[3]) { return Vec3(v[0], v[1], v[2]); };
  simulation.robots().set_twist(instance, {vec(request.linear), vec(request.angular)});
  return {};
}

void reset_poses(Simulation& simulation) {
  const auto& models = simulation.world().models;
  for (const InstanceIndex i : models.indices()) {
    if (!models[i].removed && !models[i].model->is_static) simulation.robots().reset(i);
  }
}

}  // namespace ruedo::engine
