// Creates a world, and steps it.
#include "engine/world.h"

#include "base/channel_names.h"
#include "physics/state_check.h"
#include "ruedo/errors.h"

namespace ruedo::engine {

std::shared_ptr<const scene::StaticRayScene> StaticScenes::get(const world::WorldModel& world,
                                                               const world::BodyLayout& layout,
                                                               bool visuals) {
  const std::lock_guard lock(mutex_);
  auto& scene = visuals ? visuals_ : collisions_;
  if (!scene) scene = scene::make_static_ray_scene(world, layout, visuals);
  return scene;
}

const physics::PhysicsWorld& Plan::beginning() {
  const std::lock_guard lock(mutex_);
  if (!beginning_) beginning_ = std::make_unique<physics::PhysicsWorld>(model, layout);
  return *beginning_;
}

World::World(std::shared_ptr<Plan> plan, const FleetOptions& options, Channels& channels,
             Findings& findings, World* ended)
    : plan_(std::move(plan)),
      model_(plan_->model),
      layout_(plan_->layout),
      options_(options),
      fleet_(make_fleet(model_, layout_, options, channels, findings)),
      devices_(std::move(fleet_.devices)),
      inbox_(std::move(fleet_.inputs), static_cast<int>(layout_.robots.size())),
      faults_(model_, layout_, devices_, options.seed),
      physics_(physics_of(ended)),
      robots_(std::make_unique<robot::Robots>(model_, layout_, *physics_, options.seed)) {
  for (const Finding& finding : physics_->findings()) {
    switch (finding.kind) {
      case Finding::Kind::unsupported:
        findings.unsupported(finding.source, finding.element, finding.text);
        break;
      case Finding::Kind::repaired:
        findings.repaired(finding.source, finding.element, finding.text);
        break;
      case Finding::Kind::error:
        findings.error(finding.source, finding.element, finding.text);
        break;
    }
  }
  for (ModuleSetup& setup : fleet_.modules)
    modules_.push_back(std::make_unique<Module>(std::move(setup)));
  for (size_t i = 0; i < channels.list().size(); ++i) {
    if (channels.list()[i].name == kWorldChannel) world_channel_ = ChannelIndex(i);
  }
}

std::shared_ptr<physics::PhysicsWorld> World::physics_of(World* ended) const {
  if (!ended || ended->plan_ != plan_ || !ended->sound_)
    return std::make_shared<physics::PhysicsWorld>(model_, layout_);
  ended->physics_->copy_from(plan_->beginning());
  return ended->physics_;
}

void World::advance(int64_t step, Snapshot& snapshot, Batch& batch) {
  sound_ = false;
  if (step > 0) {
    faults_.before_commands(step - 1, *robots_);
    inbox_.apply(*robots_, faults_, step - 1, batch);  // on the previous state
  }
  reseed(step);
  if (step > 0) robots_->step();
  read(step, snapshot);
  batch.sensor_faults = faults_.of_sensors();
  batch.reseedings = faults_.reseedings();
  physics::check_finite(snapshot, model_, layout_);
  sound_ = true;
}

void World::copy_from(const World& other) {
  options_.seed = other.options_.seed;
  inbox_.copy_from(other.inbox_);
  faults_ = other.faults_;
  physics_->copy_from(*other.physics_);
  robots_->copy_from(*other.robots_);
  for (size_t m = 0; m < modules_.size(); ++m) {
    const Device* uncopied = modules_[m]->copy_from(*other.modules_[m]);
    if (!uncopied) continue;
    const std::string robot =
        uncopied->robot.valid() ? model_.models[layout_.robots[uncopied->robot].instance].name : "";
    throw InputError({}, "the device '" + robot + "/" + uncopied->name +
                             "' is a plugin's that cannot be copied: it lacks Sensor::copy_from()");
  }
}

void World::exchange(StateArchive& archive) {
  if (!faults_.none()) StateArchive::refuse("something is or was faulty");
  archive(inbox_, *physics_, *robots_);
  for (const auto& module : modules_) {
    const Device* without = module->exchange(archive);
    if (without) StateArchive::refuse("the device '" + without->name + "' cannot save its state");
  }
}

// Modules switch on their own: with the batch that contains the step.
void World::reseed(int64_t step) {
  const std::optional<uint64_t> seed = faults_.new_seed(step);
  if (!seed) return;
  options_.seed = *seed;  // for robots that join
  robots_->reseed(*seed);
}

void World::read(int64_t step, Snapshot& snapshot) {
  robots_->read(snapshot);
  snapshot.step = step;
  snapshot.time = step * model_.step_us;
  faults_.show_wheels(snapshot);
}

SceneMakers World::scene_makers() const {
  SceneMakers makers;
  makers.rays = [this] {
    return scene::make_ray_scene(plan_->statics->get(model_, layout_, false));
  };
  makers.visual_rays = [this] {
    return scene::make_ray_scene(plan_->statics->get(model_, layout_, true));
  };
  makers.renderer = [this] { return scene::make_renderer(model_, layout_); };
  return makers;
}

}  // namespace ruedo::engine
