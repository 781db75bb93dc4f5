// Models that come and go, and the reset of time.
#include <algorithm>
#include <thread>

#include "engine/edits/world_editor.h"
#include "engine/world.h"
#include "engine/world_state.h"

namespace ruedo::engine {
namespace {

RobotIndex robot_of(const world::BodyLayout& layout, InstanceIndex instance) {
  for (const RobotIndex robot : layout.robots.indices()) {
    if (layout.robots[robot].instance == instance) return robot;
  }
  return {};
}

constexpr unsigned kMostDrawers = 8;  // threads that draw

}  // namespace

InstanceIndex World::place(const std::string& name, const Pose& X_WM,
                           std::shared_ptr<const world::Model> model) {
  const WorldEditor::Placed placed = WorldEditor(model_).place(name, X_WM, std::move(model));
  placed.reused ? layout_.place_again(model_, placed.instance) : layout_.append(model_);
  return placed.instance;
}

InstanceIndex World::add_model(const std::string& name, const Pose& X_WM,
                               std::shared_ptr<const world::Model> model, int64_t step,
                               Channels& channels, Findings& findings) {
  const world::BodyLayout layout_before = layout_;
  const auto models_before = model_.models;
  const Channels channels_before = channels;
  if (model->path) robot::check_path(*model->path);
  const InstanceIndex instance = place(name, X_WM, std::move(model));
  const RobotIndex robot = robot_of(layout_, instance);
  Fleet fleet;
  try {
    if (robot.valid()) {
      FleetOptions options = options_;
      options.only_robot = robot;
      options.first_step = step;
      fleet = make_fleet(model_, layout_, options, channels, findings);
    }
  } catch (...) {
    layout_ = layout_before;
    model_.models = models_before;
    channels = channels_before;
    throw;
  }
  physics_->add(instance);
  robots_->add(instance);
  if (robot.valid()) inbox_.add(fleet.inputs, static_cast<int>(layout_.robots.size()));
  if (step > 0) show_beginning(fleet, step - 1);
  join(std::move(fleet));
  plan_->statics = std::make_shared<StaticScenes>();
  renew_world_state();
  return instance;
}

// The state that a model came into is its beginning: an odometry counts from there.
void World::show_beginning(Fleet& fleet, int64_t step) const {
  Snapshot beginning;
  robots_->read(beginning);
  beginning.step = step;
  beginning.time = step * model_.step_us;
  Outbox unheard;
  for (ModuleSetup& setup : fleet.modules) {
    for (Device& device : setup.devices) {
      if (device.sensor->observes()) device.sensor->observe(beginning, unheard);
    }
  }
}

void World::remove_model(InstanceIndex instance, Channels& channels) {
  const std::string name = model_.models[instance].name;
  if (const RobotIndex robot = robot_of(layout_, instance); robot.valid()) {
    for (auto& module : modules_) module->remove(robot);
    std::erase_if(devices_, [&](const device_info_t& device) { return device.robot == name; });
    inbox_.remove(robot);
    faults_.remove(robot);
    channels.remove(name);
  }
  WorldEditor(model_).remove(instance);
  physics_->remove(instance);
  robots_->remove(instance);
  plan_->statics = std::make_shared<StaticScenes>();
  renew_world_state();
}

void World::join(Fleet fleet) {
  for (ModuleSetup& setup : fleet.modules) join(std::move(setup));
  devices_.insert(devices_.end(), std::make_move_iterator(fleet.devices.begin()),
                  std::make_move_iterator(fleet.devices.end()));
}

// To the last module of its kind, so that devices stay in the order of robots; or as a new one, in
// its place.
void World::join(ModuleSetup setup) {
  auto after = std::find_if(modules_.begin(), modules_.end(),
                            [&](const auto& module) { return module->rank() > setup.rank; });
  const auto same = [&](const auto& module) { return module->rank() == setup.rank; };
  const auto known = static_cast<unsigned>(std::count_if(modules_.begin(), modules_.end(), same));
  const bool last_place = setup.devices.empty() || known == 0 ||
                          !(*(after - 1))->robots_after(setup.devices.front().robot);
  const unsigned most =
      setup.wants_renderer
          ? std::min(kMostDrawers, std::max(1u, std::thread::hardware_concurrency()))
          : 1;
  if (known > 0 && (known >= most || !last_place)) {
    // A robot in the place of a removed one may belong before the last module's first.
    auto into = std::find_if(modules_.begin(), after, [&](const auto& module) {
      return same(module) && module->robots_after(setup.devices.front().robot);
    });
    (into == after ? **(after - 1) : **into).add(std::move(setup));
    return;
  }
  modules_.insert(after, std::make_unique<Module>(std::move(setup)));
}

void World::renew_world_state() {
  for (auto& module : modules_) {
    if (module->name() == "world")
      module->replace_sensor(world_state_sensor(model_, layout_, options_.epoch, world_channel_));
  }
}

void World::set_epoch(int epoch) {
  options_.epoch = epoch;
  renew_world_state();
}

SimTime World::reset_time(int epoch) {
  const SimTime was = robots_->set_time_to_zero();
  inbox_.reset_time();
  faults_.reset_time();
  for (auto& module : modules_) module->reset_time(was);
  set_epoch(epoch);
  return was;
}

}  // namespace ruedo::engine
