// All robots of a world: which drive each has, and the order of a step.
#include <algorithm>
#include <cmath>

#include <ruedo/motion_status_t.hpp>

#include "robot/ground.h"
#include "robot/joint_control.h"
#include "robot/kinematic_drive.h"
#include "robot/mover.h"
#include "robot/robots.h"
#include "robot/wheels_drive.h"

namespace ruedo::robot {

class Robots::Impl {
 public:
  Impl(const model::WorldModel& world, const model::BodyLayout& layout, physics::PhysicsWorld& physics);

  void apply(const Command& command);
  void step();
  void read(Snapshot& snapshot) const;

  int64_t step_ = 0;

 private:
  void read_driveless(size_t robot, RobotState& state) const;
  SimTime now() const { return step_ * world_.step_us; }

  const model::WorldModel& world_;
  const model::BodyLayout& layout_;
  physics::PhysicsWorld& physics_;
  std::vector<double> planes_;
  std::vector<std::unique_ptr<Drive>> drives_;    // of each robot; null: it has none, or cannot move
  std::vector<MotionLog> driveless_;              // refusals of those
  std::vector<Mover> movers_;
  JointControl joints_;
};

Robots::Impl::Impl(const model::WorldModel& world, const model::BodyLayout& layout, physics::PhysicsWorld& physics)
    : world_(world),
      layout_(layout),
      physics_(physics),
      planes_(level_planes(world, layout)),
      driveless_(layout.robots.size()),
      joints_(world, layout, physics) {
  for (size_t i = 0; i < layout.robots.size(); ++i) {
    const auto& drive = world.models[static_cast<size_t>(layout.robots[i].instance)].model->drive;
    const int index = static_cast<int>(i);
    if (!drive || layout.robots[i].body < 0) {
      drives_.push_back(nullptr);
    } else if (drive->kind == model::DriveDescription::Kind::wheels) {
      drives_.push_back(std::make_unique<WheelsDrive>(world, layout, physics, index));
    } else {
      drives_.push_back(std::make_unique<KinematicDrive>(world, layout, physics, index, planes_));
    }
  }
  for (size_t i = 0; i < world.models.size(); ++i) {
    if (world.models[i].model->path) movers_.emplace_back(world, layout, physics, static_cast<int>(i));
  }
}

void Robots::Impl::apply(const Command& command) {
  if (command.robot < 0 || static_cast<size_t>(command.robot) >= drives_.size()) return;
  Drive* drive = drives_[static_cast<size_t>(command.robot)].get();
  const auto refuse = [&](int64_t id, int8_t kind, int8_t reason) {
    if (drive) return drive->motion().refuse(id, kind, reason);
    MotionState refused;
    refused.id = id;
    refused.kind = kind;
    refused.state = motion_status_t::STATE_REFUSED;
    refused.reason = reason;
    driveless_[static_cast<size_t>(command.robot)].mention(refused);
  };
  if (const auto* joint = std::get_if<JointCommand>(&command.what)) {
    if (const int8_t reason = joints_.apply(command.robot, *joint)) refuse(0, motion_status_t::KIND_NONE, reason);
    if (drive) drive->wake();
    return;
  }
  if (!drive) {
    if (const auto* move = std::get_if<MoveCommand>(&command.what)) {
      refuse(move->id, move->kind, motion_status_t::REASON_NO_DRIVE);
    } else if (!std::holds_alternative<ResetOdometry>(command.what)) {
      const bool wheels = std::holds_alternative<WheelCommand>(command.what);
      refuse(0, wheels ? motion_status_t::KIND_WHEELS : motion_status_t::KIND_VELOCITY, motion_status_t::REASON_NO_DRIVE);
    }
    return;
  }
  if (std::holds_alternative<ResetOdometry>(command.what)) return drive->reset_odometry();
  drive->wake();
  if (const auto* velocity = std::get_if<VelocityCommand>(&command.what)) drive->motion().command(*velocity, now());
  if (const auto* wheels = std::get_if<WheelCommand>(&command.what)) drive->motion().command(*wheels, now());
  if (const auto* move = std::get_if<MoveCommand>(&command.what)) {
    drive->motion().command(*move, now(), drive->heading_in_odom());
  }
}

void Robots::Impl::step() {
  for (Mover& mover : movers_) mover.before_step(now());
  for (auto& drive : drives_) if (drive) drive->before_step(now());
  joints_.before_step();
  physics_.step();
  ++step_;
  for (auto& drive : drives_) if (drive) drive->after_step(now());
  for (MotionLog& log : driveless_) log.advance();
}

void Robots::Impl::read(Snapshot& snapshot) const {
  physics_.read(snapshot);
  snapshot.step = step_;
  snapshot.time = now();
  snapshot.robots.resize(drives_.size());
  snapshot.wheel_angles.resize(layout_.wheels.size());
  snapshot.wheel_rates.resize(layout_.wheels.size());
  for (size_t i = 0; i < drives_.size(); ++i) {
    if (drives_[i]) {
      drives_[i]->read(snapshot.robots[i]);
      drives_[i]->read_wheels(snapshot);
    } else {
      read_driveless(i, snapshot.robots[i]);
    }
  }
}

// A robot that only senses: base_link is where its body is.
void Robots::Impl::read_driveless(size_t robot, RobotState& state) const {
  const auto& placement = layout_.robots[robot];
  state = {};
  state.motion = driveless_[robot].shown();
  state.X_WBase = placement.X_BBase;
  if (placement.body < 0) return;
  state.X_WBase = physics_.pose(placement.body) * placement.X_BBase;
  const Twist& twist = physics_.twist(placement.body);
  const Quat to_base = state.X_WBase.rotation.conjugate();
  const Vec3 arm = physics_.pose(placement.body).rotation * placement.X_BBase.translation;
  state.twist = {to_base * (twist.linear + twist.angular.cross(arm)), to_base * twist.angular};
}

Robots::Robots(const model::WorldModel& world, const model::BodyLayout& layout, physics::PhysicsWorld& physics)
    : impl_(std::make_unique<Impl>(world, layout, physics)) {}
Robots::~Robots() = default;
void Robots::apply(const Command& command) { impl_->apply(command); }
void Robots::step() { impl_->step(); }
void Robots::read(Snapshot& snapshot) const { impl_->read(snapshot); }
int64_t Robots::current_step() const { return impl_->step_; }

}  // namespace ruedo::robot
