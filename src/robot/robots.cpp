// All robots of a world: their drives, and the order of a step.
#include <algorithm>
#include <cmath>

#include <ruedo/motion_status_t.hpp>

#include "robot/crowd.h"
#include "robot/joint_control.h"
#include "robot/kinematic_drive.h"
#include "robot/mover.h"
#include "robot/robots.h"
#include "robot/surroundings.h"
#include "robot/wheels_drive.h"
#include "robot/wind.h"
#include "world/model/ground.h"

namespace ruedo::robot {

class Robots::Impl {
 public:
  Impl(const world::WorldModel& world, const world::BodyLayout& layout,
       physics::PhysicsWorld& physics, uint64_t seed);

  void apply(const Command& command);
  void step();
  void read(Snapshot& snapshot) const;
  void add(InstanceIndex instance);
  void remove(InstanceIndex instance);
  Pose model_pose(InstanceIndex instance) const;
  void set_pose(InstanceIndex instance, const Pose& X_WM);
  void set_twist(InstanceIndex instance, const Twist& twist);
  void reset(InstanceIndex instance);
  SimTime set_time_to_zero();
  void copy_from(const Impl& other);
  void exchange(StateArchive& archive);
  void reseed(uint64_t seed) {
    crowd_.reseed(seed);
    wind_.reseed(seed);
  }

  int64_t step_ = 0;

 private:
  std::unique_ptr<Drive> make_drive(RobotIndex robot);
  void change_ground();
  template <class Visit>
  void for_each_body(InstanceIndex instance, Visit visit) const {
    for (const BodyIndex i : layout_.bodies.indices()) {
      if (layout_.bodies[i].instance == instance) visit(i);
    }
  }
  RobotIndex robot_of(InstanceIndex instance) const;  // invalid: not a robot
  void put(BodyIndex body, const Pose& X_WB);
  void end_put(InstanceIndex instance);
  void read_driveless(RobotIndex robot, RobotState& state) const;
  void add_collisions(const std::vector<Contact>& contacts, size_t first, const Snapshot& snapshot,
                      std::vector<Collision>& collisions) const;
  void read_collisions(Snapshot& snapshot) const;
  void number_robots();
  SimTime now() const { return step_ * world_.step_us; }

  const world::WorldModel& world_;
  const world::BodyLayout& layout_;
  physics::PhysicsWorld& physics_;
  std::vector<world::LevelPlane> planes_;
  // null: the robot has none, or cannot move
  IndexedVector<RobotIndex, std::unique_ptr<Drive>> drives_;
  IndexedVector<RobotIndex, MotionLog> driveless_;  // refusals of robots without a drive
  IndexedVector<LinkIndex, RobotIndex> robot_of_link_;
  std::vector<std::unique_ptr<Mover>> movers_;
  Crowd crowd_;
  Surroundings surroundings_;
  JointControl joints_;
  Wind wind_;
  mutable ContactList::Shared resting_;  // contacts of the last read(), and their collisions
  mutable std::vector<Collision> resting_collisions_;
};

Robots::Impl::Impl(const world::WorldModel& world, const world::BodyLayout& layout,
                   physics::PhysicsWorld& physics, uint64_t seed)
    : world_(world),
      layout_(layout),
      physics_(physics),
      planes_(level_planes(world, layout)),
      driveless_(layout.robots.size()),
      crowd_(world, layout, physics, seed),
      surroundings_(world, layout, physics),
      joints_(world, layout, physics),
      wind_(world.environment.wind, seed) {
  number_robots();
  for (const RobotIndex robot : layout.robots.indices()) drives_.push_back(make_drive(robot));
  for (const InstanceIndex i : world.models.indices()) {
    if (Mover::moves(*world.models[i].model))
      movers_.push_back(std::make_unique<Mover>(world, layout, physics, i));
  }
}

std::unique_ptr<Drive> Robots::Impl::make_drive(RobotIndex robot) {
  const world::RobotPlacement& placement = layout_.robots[robot];
  const auto& drive = world_.models[placement.instance].model->drive;
  if (!drive || !placement.body.valid()) return nullptr;
  if (drive->kind == world::DriveDescription::Kind::wheels)
    return std::make_unique<WheelsDrive>(world_, layout_, physics_, robot, planes_);
  return std::make_unique<KinematicDrive>(world_, layout_, physics_, robot, planes_);
}

void Robots::Impl::apply(const Command& command) {
  if (!drives_.has(command.robot)) return;
  Drive* drive = drives_[command.robot].get();
  const auto refuse = [&](int64_t id, int8_t kind, int8_t reason) {
    if (drive) return drive->planner().refuse(id, kind, reason);
    MotionState refused;
    refused.id = id;
    refused.kind = kind;
    refused.state = motion_status_t::STATE_REFUSED;
    refused.reason = reason;
    driveless_[command.robot].mention(refused);
  };
  if (const auto* joint = std::get_if<JointCommand>(&command.what)) {
    if (const int8_t reason = joints_.apply(command.robot, *joint))
      refuse(0, motion_status_t::KIND_NONE, reason);
    if (drive) drive->wake();
    return;
  }
  if (!drive) {
    if (const auto* move = std::get_if<MoveCommand>(&command.what)) {
      refuse(move->id, move->kind, motion_status_t::REASON_NO_DRIVE);
    } else if (!std::holds_alternative<ResetOdometry>(command.what)) {
      const bool wheels = std::holds_alternative<WheelCommand>(command.what);
      refuse(0, wheels ? motion_status_t::KIND_WHEELS : motion_status_t::KIND_VELOCITY,
             motion_status_t::REASON_NO_DRIVE);
    }
    return;
  }
  if (std::holds_alternative<ResetOdometry>(command.what)) return drive->reset_odometry();
  drive->wake();
  if (const auto* velocity = std::get_if<VelocityCommand>(&command.what))
    drive->planner().command(*velocity, now());
  if (const auto* wheels = std::get_if<WheelCommand>(&command.what))
    drive->planner().command(*wheels, now());
  if (const auto* move = std::get_if<MoveCommand>(&command.what)) {
    drive->planner().command(*move, now(), drive->heading_in_odom());
  }
}

void Robots::Impl::step() {
  for (auto& mover : movers_) mover->before_step(now());
  crowd_.before_step(now());
  surroundings_.before_step(now());
  for (auto& drive : drives_)
    if (drive) drive->before_step(now());
  joints_.before_step();
  physics_.set_wind(wind_.at(step_ + 1, world_.step_us));
  physics_.step();
  ++step_;
  for (auto& drive : drives_)
    if (drive) drive->after_step(now());
  for (MotionLog& log : driveless_) log.advance();
}

void Robots::Impl::copy_from(const Impl& other) {
  step_ = other.step_;
  for (const RobotIndex i : drives_.indices())
    if (drives_[i]) drives_[i]->copy_from(*other.drives_[i]);
  driveless_ = other.driveless_;
  for (size_t i = 0; i < movers_.size(); ++i) *movers_[i] = *other.movers_[i];
  crowd_.copy_from(other.crowd_);
  surroundings_ = other.surroundings_;
  joints_ = other.joints_;
  wind_ = other.wind_;
  resting_ = nullptr;
}

void Robots::Impl::exchange(StateArchive& archive) {
  archive(step_);
  for (auto& drive : drives_)
    if (drive) archive(*drive);
  archive.each(driveless_);
  for (auto& mover : movers_) archive(*mover);
  archive(crowd_, surroundings_, joints_);
  resting_ = nullptr;
}

void Robots::Impl::read(Snapshot& snapshot) const {
  physics_.read(snapshot);
  snapshot.step = step_;
  snapshot.time = now();
  snapshot.wind = wind_.at(step_, world_.step_us);
  snapshot.robots.resize(drives_.size());
  snapshot.motion_ends.clear();
  snapshot.wheel_angles.assign(layout_.wheels.size(),
                               0.0);  // also for removed robots: snapshots are reused
  snapshot.wheel_rates.assign(layout_.wheels.size(), 0.0);
  for (const RobotIndex i : drives_.indices()) {
    if (drives_[i]) {
      drives_[i]->read(snapshot);
      drives_[i]->read_wheels(snapshot);
    } else {
      read_driveless(i, snapshot.robots[i]);
      read_motion(driveless_[i], i, snapshot);
    }
  }
  read_collisions(snapshot);
}

void Robots::Impl::number_robots() {
  IndexedVector<InstanceIndex, RobotIndex> of_instance(world_.models.size());
  for (const RobotIndex i : layout_.robots.indices()) of_instance[layout_.robots[i].instance] = i;
  robot_of_link_.clear();
  for (const world::LinkPlacement& link : layout_.links)
    robot_of_link_.push_back(of_instance[link.instance]);
  resting_ = nullptr;
}

void Robots::Impl::add_collisions(const std::vector<Contact>& contacts, size_t first,
                                  const Snapshot& snapshot,
                                  std::vector<Collision>& collisions) const {
  const auto robot_of_link = [this](LinkIndex link) {
    return link.valid() ? robot_of_link_[link] : RobotIndex();
  };
  for (size_t i = 0; i < contacts.size(); ++i) {
    const Contact& contact = contacts[i];
    const RobotIndex a = robot_of_link(contact.link_a), b = robot_of_link(contact.link_b);
    if (a == b) continue;  // no robot involved, or links of the same robot
    const auto add = [&](RobotIndex robot, bool as_a) {
      if (!robot.valid()) return;
      const Vec3 up = snapshot.robots[robot].X_WBase.rotation * Vec3::UnitZ();
      if (std::abs(contact.normal.dot(up)) < kSupportNormal)
        collisions.push_back({robot, ContactIndex(first + i), as_a});
    };
    add(a, true);
    add(b, false);
  }
}

// A resting robot keeps its collisions.
void Robots::Impl::read_collisions(Snapshot& snapshot) const {
  const ContactList& contacts = snapshot.contacts;
  snapshot.collisions.clear();
  // avoids allocations in the run
  snapshot.collisions.reserve(2 * contacts.moving().capacity());
  add_collisions(contacts.moving(), 0, snapshot, snapshot.collisions);
  if (resting_ != contacts.resting()) {
    resting_ = contacts.resting();
    resting_collisions_.clear();
    add_collisions(*resting_, 0, snapshot, resting_collisions_);
  }
  for (const Collision& each : resting_collisions_) {
    const int contact = static_cast<int>(contacts.moving().size()) + each.contact;
    snapshot.collisions.push_back({each.robot, ContactIndex(contact), each.as_a});
  }
  std::sort(snapshot.collisions.begin(), snapshot.collisions.end(),
            [](const Collision& one, const Collision& other) {
              return std::pair(one.robot, one.contact) < std::pair(other.robot, other.contact);
            });
}

// A robot with sensors only: base_link is where its body is.
void Robots::Impl::read_driveless(RobotIndex robot, RobotState& state) const {
  const auto& placement = layout_.robots[robot];
  state = {};
  state.X_WBase = placement.X_BBase;
  if (!placement.body.valid()) return;
  state.X_WBase = physics_.pose(placement.body) * placement.X_BBase;
  const Twist& twist = physics_.twist(placement.body);
  const Quat to_base = state.X_WBase.rotation.conjugate();
  const Vec3 arm = physics_.pose(placement.body).rotation * placement.X_BBase.translation;
  state.twist = {to_base * (twist.linear + twist.angular.cross(arm)), to_base * twist.angular};
}

// ---- Changes between two steps.

RobotIndex Robots::Impl::robot_of(InstanceIndex instance) const {
  for (const RobotIndex robot : layout_.robots.indices()) {
    if (layout_.robots[robot].instance == instance) return robot;
  }
  return {};
}

void Robots::Impl::change_ground() {
  planes_ = level_planes(world_, layout_);
  for (auto& drive : drives_)
    if (drive) drive->ground_changed();
}

void Robots::Impl::add(InstanceIndex instance) {
  change_ground();
  number_robots();
  drives_.resize(layout_.robots.size());
  driveless_.resize(layout_.robots.size());
  if (const RobotIndex robot = robot_of(instance); robot.valid()) {
    drives_[robot] = make_drive(robot);
    driveless_[robot] = {};
  }
  joints_.start(instance);
  crowd_.add(instance, layout_);
  surroundings_.add(instance);
  if (!Mover::moves(*world_.models[instance].model)) return;
  movers_.push_back(std::make_unique<Mover>(world_, layout_, physics_, instance));
  movers_.back()->reset(now());
}

void Robots::Impl::remove(InstanceIndex instance) {
  if (const RobotIndex robot = robot_of(instance); robot.valid()) drives_[robot].reset();
  std::erase_if(movers_, [instance](const auto& mover) { return mover->instance() == instance; });
  crowd_.remove(instance);
  surroundings_.remove(instance);
  joints_.forget(instance);
  change_ground();
}

Pose Robots::Impl::model_pose(InstanceIndex instance) const {
  const auto& link = layout_.links[layout_.first_link[instance]];
  const Pose X_WL = link.body.valid() ? physics_.pose(link.body) * link.X_BL : link.X_BL;
  return X_WL * world_.models[instance].model->links[link.link].X_ML.inverse();
}

void Robots::Impl::put(BodyIndex body, const Pose& X_WB) {
  physics_.disturb(body);  // wakes what leaned on it
  physics_.set_twist(body, {});
  physics_.set_pose(body, X_WB.normalized());
}

void Robots::Impl::end_put(InstanceIndex instance) {
  if (const RobotIndex robot = robot_of(instance); robot.valid()) {
    if (Drive* drive = drives_[robot].get()) drive->placed(now());
  }
  for_each_body(instance, [&](BodyIndex body) { physics_.disturb(body); });
}

void Robots::Impl::set_pose(InstanceIndex instance, const Pose& X_WM) {
  const Pose X_MW = model_pose(instance).inverse();
  std::vector<InstanceIndex> all = joints_.holds().carried_by(instance);
  all.insert(all.begin(), instance);
  for (const InstanceIndex each : all)
    for_each_body(each, [&](BodyIndex body) { put(body, X_WM * X_MW * physics_.pose(body)); });
  joints_.holds().moved(instance);
  for (const InstanceIndex each : all) end_put(each);
}

void Robots::Impl::set_twist(InstanceIndex instance, const Twist& twist) {
  const Vec3 p_M = model_pose(instance).translation;
  for_each_body(instance, [&](BodyIndex body) {
    physics_.set_twist(
        body,
        {twist.linear + twist.angular.cross(physics_.pose(body).translation - p_M), twist.angular});
    physics_.disturb(body);
  });
}

// A drive's wheels keep their angle: encoders do not jump.
void Robots::Impl::reset(InstanceIndex instance) {
  for (const InstanceIndex other : joints_.holds().carried_by(instance))
    for_each_body(other, [&](BodyIndex body) { put(body, layout_.bodies[body].X_WB); });
  joints_.holds().moved(instance);
  const RobotIndex robot = robot_of(instance);
  const BodyIndex base = robot.valid() && drives_[robot] ? layout_.robots[robot].body : BodyIndex();
  const auto is_wheel = [&](BodyIndex body) {
    const auto& wheels = layout_.robots[robot].wheels;
    return body != base && std::any_of(wheels.begin(), wheels.end(), [&](WheelIndex wheel) {
             return layout_.links[layout_.wheels[wheel].link].body == body;
           });
  };
  const Pose X_BaseW = base.valid() ? physics_.pose(base).inverse() : Pose{};
  for_each_body(instance, [&](BodyIndex body) {
    const bool wheel = base.valid() && is_wheel(body);
    put(body, wheel ? layout_.bodies[base].X_WB * X_BaseW * physics_.pose(body)
                    : layout_.bodies[body].X_WB);
  });
  for (const JointIndex i : layout_.joints.indices()) {
    if (layout_.joints[i].instance == instance) physics_.reset(i);
  }
  joints_.forget(instance);
  joints_.start(instance);
  for (auto& mover : movers_)
    if (mover->instance() == instance) mover->reset(now());
  crowd_.reset(instance, now());
  surroundings_.reset(instance);
  end_put(instance);
}

SimTime Robots::Impl::set_time_to_zero() {
  const SimTime was = now();
  for (auto& drive : drives_)
    if (drive) drive->planner().shift_time(was);
  for (auto& mover : movers_) mover->shift_time(was);
  crowd_.shift_time(was);
  surroundings_.shift_time(was);
  step_ = 0;
  return was;
}

Robots::Robots(const world::WorldModel& world, const world::BodyLayout& layout,
               physics::PhysicsWorld& physics, uint64_t seed)
    : impl_(std::make_unique<Impl>(world, layout, physics, seed)) {}
Robots::~Robots() = default;
void Robots::apply(const Command& command) { impl_->apply(command); }
void Robots::step() { impl_->step(); }
void Robots::read(Snapshot& snapshot) const { impl_->read(snapshot); }
void Robots::copy_from(const Robots& other) { impl_->copy_from(*other.impl_); }
void Robots::exchange(StateArchive& archive) { impl_->exchange(archive); }
int64_t Robots::current_step() const { return impl_->step_; }
void Robots::add(InstanceIndex instance) { impl_->add(instance); }
void Robots::remove(InstanceIndex instance) { impl_->remove(instance); }
Pose Robots::model_pose(InstanceIndex instance) const { return impl_->model_pose(instance); }
void Robots::set_pose(InstanceIndex instance, const Pose& X_WM) { impl_->set_pose(instance, X_WM); }
void Robots::set_twist(InstanceIndex instance, const Twist& twist) {
  impl_->set_twist(instance, twist);
}
void Robots::reseed(uint64_t seed) { impl_->reseed(seed); }
void Robots::reset(InstanceIndex instance) { impl_->reset(instance); }
SimTime Robots::set_time_to_zero() { return impl_->set_time_to_zero(); }

}  // namespace ruedo::robot
