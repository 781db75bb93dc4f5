// A P3-AT on an empty plane, driven step by step.
#include "bench/experiment_rig.h"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include <fmt/format.h>

#include "ruedo/motion_status_t.hpp"
#include "world/load.h"

namespace ruedo::bench {
namespace {

constexpr SimTime kMostTime = 300'000'000;  // us, of one primitive

// The P3-AT's world with the drive and odometry that the options ask for.
std::shared_ptr<const world::WorldModel> make_world(const RigOptions& options) {
  const std::string text =
      "<sdf version='1.9'><world name='plane'><include><uri>model://ground_plane</uri></include>"
      "<include><uri>model://p3at</uri><name>p3at</name></include></world></sdf>";
  auto world = std::make_shared<world::WorldModel>(*world::load_world_text(text, "experiments"));
  world->step_us = options.step_us;
  for (world::ModelInstance& instance : world->models) {
    if (instance.name != "p3at") continue;
    auto robot = std::make_shared<world::Model>(*instance.model);
    robot->sensors.clear();  // odometry alone is looked at
    world::DriveDescription& drive = *robot->drive;
    drive.kind = options.drive;
    drive.watchdog_us = 0;
    drive.odometry_rate = {0, 1};
    if (!options.limits) {
      constexpr double kNone = std::numeric_limits<double>::infinity();
      drive.max_speed = drive.max_turn_rate = drive.acceleration = drive.deceleration =
          drive.turn_acceleration = kNone;
    }
    auto odometry = std::make_shared<Element>();
    odometry->name = "ruedo:odometry";
    for (const auto& [name, value] : options.odometry) {
      auto child = std::make_unique<Element>();
      child->name = name;
      child->text = value;
      odometry->children.push_back(std::move(child));
    }
    drive.odometry = odometry;
    instance.model = robot;
  }
  return world;
}

}  // namespace

ExperimentRig::ExperimentRig(const RigOptions& options) : world_(make_world(options)) {
  layout_ = std::make_unique<world::BodyLayout>(*world_);
  physics_ = std::make_unique<physics::PhysicsWorld>(*world_, *layout_);
  robots_ = std::make_unique<robot::Robots>(*world_, *layout_, *physics_);
  engine::Fleet fleet = engine::make_fleet(*world_, *layout_, {}, channels_, findings_);
  for (engine::ModuleSetup& module : fleet.modules) {
    if (module.name == "odometry") module_ = std::move(module);
  }
  for (size_t i = 0; i < channels_.list().size(); ++i) {
    if (channels_.list()[i].name == "p3at/odometry") channel_ = static_cast<int>(i);
  }
  robots_->read(now_);
  look();
}

void ExperimentRig::step() {
  robots_->step();
  robots_->read(now_);
  look();
}

void ExperimentRig::look() {
  out_.clear();
  out_.begin_step(now_.step);
  for (engine::Device& device : module_.devices) {
    if (device.sensor->observes()) device.sensor->observe(now_, out_);
    device.sensor->sample({now_, samples_, nullptr, nullptr}, out_);
  }
  ++samples_;
  for (const Outbox::Entry& entry : out_.entries()) {
    if (entry.channel == channel_)
      odometry_.decode(out_.data(entry), 0, static_cast<int>(entry.size));
  }
}

void ExperimentRig::start(const robot::MoveCommand& command) {
  robots_->apply({RobotIndex(0), command});
  give_up_ = now_.time + kMostTime;
  step();
}

bool ExperimentRig::moved(int64_t id) const {
  const MotionState& motion = now_.robots[0].motion;
  if (motion.id == id && motion.state == motion_status_t::STATE_DONE) return true;
  const bool ended = motion.id == id && motion.state > motion_status_t::STATE_DONE;
  for (const MotionEnd& end : now_.motion_ends) {
    if (end.state.id == id)
      throw std::runtime_error(
          fmt::format("the primitive {} was refused, reason {}", id, end.state.reason));
  }
  if (ended || now_.time > give_up_) {
    throw std::runtime_error(fmt::format("the primitive {} ended with state {}, reason {}", id,
                                         motion.state, motion.reason));
  }
  return false;
}

}  // namespace ruedo::bench
