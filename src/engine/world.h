// One world that can be stepped: its model, physics, robots and devices.
//
// Independent of threads, clocks and networks, which belong to its host: Simulation runs one world
// on threads, Engine many in the caller's process. Not thread-safe, except that its modules may be
// processed in parallel to each other and to advance(), each by one thread.
#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "engine/batch.h"
#include "engine/channels.h"
#include "engine/command_inbox.h"
#include "engine/faults/faults.h"
#include "engine/fleet.h"
#include "engine/module.h"
#include "physics/physics_world.h"
#include "robot/robots.h"
#include "scene/rays/ray_scene.h"
#include "world/model/body_layout.h"

namespace ruedo::engine {

// The static geometry, built on first use: shared by all modules, and by copies of a world.
class StaticScenes {
 public:
  std::shared_ptr<const scene::StaticRayScene> get(const world::WorldModel& world,
                                                   const world::BodyLayout& layout, bool visuals);

 private:
  std::mutex mutex_;
  std::shared_ptr<const scene::StaticRayScene> collisions_, visuals_;
};

// The parts made once from a world's model, which copies of a world share and must not
// change.
struct Plan {
  explicit Plan(const world::WorldModel& world) : model(world), layout(model) {}
  world::WorldModel model;
  world::BodyLayout layout;
  std::shared_ptr<StaticScenes> statics = std::make_shared<StaticScenes>();

  // A world's physics as it begins; made on first use, and never stepped.
  const physics::PhysicsWorld& beginning();

 private:
  std::mutex mutex_;
  std::unique_ptr<physics::PhysicsWorld> beginning_;
};

class World {
 public:
  // Announces its channels. ended: a world of the same plan that will not be used any more, whose
  // physics it takes over, since the tables of Bullet's worlds take long to make; null: none.
  // Throws InputError.
  World(std::shared_ptr<Plan> plan, const FleetOptions& options, Channels& channels,
        Findings& findings, World* ended = nullptr);

  // Computes the next state into the snapshot: applies what acts on the previous state (and records
  // it in the batch), then steps the physics. States are consecutive from 0, the initial one.
  // Throws physics::StateError for a state that is not finite.
  void advance(int64_t step, Snapshot& snapshot, Batch& batch);
  // The current state, whose number is `step`.
  void read(int64_t step, Snapshot& snapshot);

  // Becomes what another copy of the same plan (or one of the same model), seed and options is:
  // what follows equals what follows there, byte for byte. Both stand between two steps, and no
  // model came or went. Throws InputError for a plugin's device or drive that cannot be copied; it
  // may be half done then.
  void copy_from(const World& other);
  // Writes that state, or reads it into another copy; commands that wait are not in it. Throws
  // ArchiveError where it cannot be written: a device or drive is a plugin's, or something is or
  // was faulty.
  void exchange(StateArchive& archive);
  // From now on ruedo/world carries that epoch.
  void set_epoch(int epoch);

  const world::WorldModel& model() const { return model_; }
  const world::BodyLayout& layout() const { return layout_; }
  const std::vector<device_info_t>& devices() const { return devices_; }
  bool refused() const { return fleet_.refused; }  // Fleet::refused
  CommandInbox& inbox() { return inbox_; }
  const Faults& faults() const { return faults_; }
  const physics::PhysicsWorld& physics() const { return *physics_; }
  robot::Robots& robots() { return *robots_; }
  // In schedule order.
  std::vector<std::unique_ptr<Module>>& modules() { return modules_; }
  const std::vector<std::unique_ptr<Module>>& modules() const { return modules_; }
  SceneMakers scene_makers() const;  // valid until a model joins or leaves

  // ---- Changes between two steps, while no module is working, for a world with its own plan; in
  // edits/world_edits.cpp. When models have joined or left, modules may have changed, and those
  // with scenes need new ones.

  // Inserts a model, visible from the next state on; `step` is that state's number. Returns its
  // index in model().models. Throws InputError; the world is then unchanged.
  InstanceIndex add_model(const std::string& name, const Pose& X_WM,
                          std::shared_ptr<const world::Model> model, int64_t step,
                          Channels& channels, Findings& findings);
  // Removes one. Its numbers stay free until the same model is inserted again.
  void remove_model(InstanceIndex instance, Channels& channels);
  // The current state becomes state 0. Returns the time before.
  SimTime reset_time(int epoch);

 private:
  std::shared_ptr<physics::PhysicsWorld> physics_of(World* ended) const;
  InstanceIndex place(const std::string& name, const Pose& X_WM,
                      std::shared_ptr<const world::Model> model);
  void reseed(int64_t step);
  void show_beginning(Fleet& fleet, int64_t step) const;
  void join(Fleet fleet);
  void join(ModuleSetup setup);
  void renew_world_state();

  std::shared_ptr<Plan> plan_;
  world::WorldModel& model_;
  world::BodyLayout& layout_;
  FleetOptions options_;
  Fleet fleet_;  // its parts are moved into the following members
  std::vector<device_info_t> devices_;
  CommandInbox inbox_;
  Faults faults_;
  bool sound_ = true;                               // no step failed
  std::shared_ptr<physics::PhysicsWorld> physics_;  // shared with one that has ended
  std::unique_ptr<robot::Robots> robots_;
  ChannelIndex world_channel_;  // for ruedo/world
  std::vector<std::unique_ptr<Module>> modules_;
};

}  // namespace ruedo::engine
