// One step of the kinematic drive, before and after Bullet's.
#include "robot/kinematic_drive.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/math/sincos.h"
#include "physics/state_check.h"
#include "robot/base_motion.h"
#include "ruedo/math.h"

namespace ruedo::robot {

namespace {

constexpr double kStanding_m = 2e-3;  // a wheel this close to the ground stands on it
// a bump this close takes the robot off the plane's analytic support
constexpr double kSeesBump_m = 1e-2;
// Tolerances for returning to the plane's support; at the start the height may be further off.
constexpr double kLevel_rad = 5e-3, kNear_m = 2e-3, kCalm_m_s = 0.05, kNearAtStart_m = 5e-3;
// lever arm of the turning force for a robot without wheels
constexpr double kLeverWithoutWheels_m = 0.25;
constexpr SimTime kFallAsleep_us = 500'000;
constexpr double kStill_m_s = 2e-3, kStill_rad_s = 1e-2;  // thresholds of rest when moved by Bullet

// A load below this fraction of its weight is a first touch, not a support.
constexpr double kFirstTouch = 0.05;

bool have_shapes(const world::WorldModel& world, const world::BodyLayout& layout,
                 const std::vector<WheelIndex>& wheels) {
  return std::any_of(wheels.begin(), wheels.end(), [&](WheelIndex wheel) {
    const auto& link = layout.links[layout.wheels[wheel].link];
    return !world.models[link.instance].model->links[link.link].collisions.empty();
  });
}

bool have_shapes(const world::Model& model) {
  return std::any_of(model.drive->belts.begin(), model.drive->belts.end(),
                     [&](auto belt) { return !model.links[belt].collisions.empty(); });
}

// The belts that are carried by joints.
std::vector<BodyIndex> flippers_of(const world::WorldModel& world, const world::BodyLayout& layout,
                                   InstanceIndex instance, BodyIndex base) {
  std::vector<BodyIndex> flippers;
  for (const auto belt : world.models[instance].model->drive->belts) {
    const BodyIndex body = layout.links[layout.link_of(instance, belt)].body;
    if (body.valid() && body != base &&
        std::find(flippers.begin(), flippers.end(), body) == flippers.end())
      flippers.push_back(body);
  }
  return flippers;
}

}  // namespace

KinematicDrive::KinematicDrive(const world::WorldModel& world, const world::BodyLayout& layout,
                               physics::PhysicsWorld& physics, RobotIndex robot,
                               const std::vector<world::LevelPlane>& planes)
    : Drive(world, layout, physics, robot),
      wheel_angles_(layout, robot, description_),
      planes_(planes),
      world_(world),
      layout_(layout),
      lowest_(lowest_of_wheels(world, layout, robot)),
      wheel_friction_(friction_of_wheels(world, layout, robot)),
      wheels_touch_(have_shapes(world, layout, wheels_)),
      belts_touch_(have_shapes(*world.models[layout.robots[robot].instance].model)),
      flippers_(flippers_of(world, layout, layout.robots[robot].instance, body_)),
      mass_(physics.mass(body_)),
      yaw_inertia_((X_WBase_.rotation * Vec3::UnitZ())
                       .dot(physics.inertia(body_) * (X_WBase_.rotation * Vec3::UnitZ()))),
      lever_(description_->track > 0.0 ? 0.5 * description_->track : kLeverWithoutWheels_m),
      max_force_(std::min(description_->max_force, mass_ * world.gravity.norm())),
      gravity_(world.gravity) {
  make_model();
  stand_on_near_plane();
}

void KinematicDrive::copy_from(const Drive& other) {
  const auto& from = static_cast<const KinematicDrive&>(other);
  if (model_ && !model_->copy_from(*from.model_)) {
    throw InputError({},
                     "the drive of robot '" + robot_name() +
                         "' is a plugin's that cannot be copied: it lacks DriveModel::copy_from()");
  }
  *this = from;
}

void KinematicDrive::exchange(StateArchive& archive) {
  if (model_) StateArchive::refuse("the drive of robot '" + robot_name() + "' is a plugin's");
  Drive::exchange(archive);
  archive(on_plane_, asleep_, touched_, held_, behind_, sent_, supported_, grip_, carrier_,
          carriers_, plane_friction_, way_, planned_, made_, lag_, heading_, wheel_angles_,
          still_us_, next_);
}

const std::string& KinematicDrive::robot_name() const {
  return world_->models[layout_->robots[robot_].instance].name;
}

void KinematicDrive::make_model() {
  const Element* element = description_->element.get();
  const std::string* type = element ? element->attribute("type") : nullptr;
  if (!type) return;
  for (const DriveKind& kind : drive_kinds()) {
    if (kind.type == *type) model_ = kind.make({*element, robot_name(), step_s_});
  }
  made_ = {};
  lag_ = {};
}

// The wheels of many models reach into the ground, those of TurtleBot3 by 10 mm, and of others up
// to the axles. Contacts would throw the robot out, to land however it may.
void KinematicDrive::stand_on_near_plane() {
  const auto plane = nearest_plane(planes_, X_WBase_.translation.z() + lowest_);
  const Vec3 up = X_WBase_.rotation * Vec3::UnitZ();
  if (!plane || up.z() <= math::cos(kLevel_rad)) return;
  const double gap = plane_gap(plane->height);
  if (gap < kNearAtStart_m && -gap < std::max(kNearAtStart_m, description_->wheel_radius))
    stand_on_plane(*plane);
}

void KinematicDrive::stand_on_plane(const world::LevelPlane& plane) {
  on_plane_ = true;
  plane_friction_ = plane.friction;
  carrier_ = Twist{Vec3::Zero(), Vec3::Zero()};
  heading_ = heading(X_WBase_.rotation);
  X_WBase_.rotation = about_z(heading_);
  X_WBase_.translation.z() = plane.height - lowest_;
  physics_->set_support(body_, physics::Support::plane);
  physics_->set_gravity(body_, Vec3::Zero());
  physics_->set_pose(body_, X_WBase_ * X_BaseB_);
}

void KinematicDrive::begin_at_rest() {
  touched_ = held_ = behind_ = false;
  sent_.setZero();
  way_ = {};
  make_model();
  if (on_plane_) leave_plane();
  supported_ = false;
  stand_on_near_plane();
}

// The plane below may have been removed.
void KinematicDrive::ground_changed() {
  if (!on_plane_) return;
  const auto plane = nearest_plane(planes_, X_WBase_.translation.z() + lowest_);
  if (plane && std::abs(plane_gap(plane->height)) < kNear_m) return;
  leave_plane();
  supported_ = false;
  wake();
}

void KinematicDrive::leave_plane() {
  grip_ = grip_on_plane();
  on_plane_ = false;
  supported_ = true;
  physics_->set_support(body_, physics::Support::contacts);
}

bool KinematicDrive::is_support(const Contact& contact, const Vec3& up) const {
  return contact.normal.dot(up) > kSupportNormal;
}

bool KinematicDrive::is_belt(LinkIndex link) const {
  const auto& belts = description_->belts;
  return link.valid() &&
         std::find(belts.begin(), belts.end(), layout_->links[link].link) != belts.end();
}

bool KinematicDrive::on_wheel(const Contact& contact) const {
  if (belts_touch_) return is_belt(contact.link_a);
  return !wheels_touch_ || (contact.link_a.valid() && layout_->links[contact.link_a].wheel.valid());
}

bool KinematicDrive::is_own(const Contact& contact) const {
  return contact.body_b.valid() &&
         layout_->bodies[contact.body_b].instance == layout_->robots[robot_].instance;
}

// A flipper in contact may lift the robot.
bool KinematicDrive::flipper_stands(const Vec3& up) const {
  return std::any_of(flippers_.begin(), flippers_.end(), [&](BodyIndex flipper) {
    const auto contacts = physics_->nearby(flipper);
    return std::any_of(contacts.begin(), contacts.end(), [&](const Contact& contact) {
      return is_support(contact, up) && !is_own(contact) && contact.depth > -kStanding_m;
    });
  });
}

bool KinematicDrive::is_alone() const {
  return physics_->alone(body_) &&
         std::all_of(flippers_.begin(), flippers_.end(),
                     [&](BodyIndex each) { return physics_->alone(each); });
}

// Contact forces on the robot's base and flippers in the last step.
template <class Visit>
void KinematicDrive::for_each_contact(Visit visit) const {
  for (const Contact& contact : physics_->contacts(body_)) visit(contact);
  for (const BodyIndex flipper : flippers_)
    for (const Contact& contact : physics_->contacts(flipper))
      if (!is_own(contact)) visit(contact);
}

double KinematicDrive::friction(const Contact& contact) const {
  const auto of = [this](LinkIndex link, ShapeIndex shape) {
    if (!link.valid() || !shape.valid()) return 1.0;
    const auto& placed = layout_->links[link];
    const auto& collisions = world_->models[placed.instance].model->links[placed.link].collisions;
    return static_cast<size_t>(shape) < collisions.size() ? collisions[shape].surface.friction
                                                          : 1.0;
  };
  return std::min(of(contact.link_a, contact.shape_a), of(contact.link_b, contact.shape_b));
}

// Includes what it carries; what it leans on reduces the load.
double KinematicDrive::grip_on_plane() const {
  double load = mass_ * gravity_.norm();
  for (const Contact& contact : physics_->contacts(body_))
    load -= contact.normal.z() * contact.force;
  return std::min(wheel_friction_, plane_friction_) * std::max(load, 0.0);
}

void KinematicDrive::choose_support() {
  const Vec3 up = X_WBase_.rotation * Vec3::UnitZ();
  if (on_plane_) {
    for (const Contact& contact : physics_->nearby(body_)) {
      if (is_support(contact, up) && contact.depth > -kSeesBump_m) return leave_plane();
    }
    if (flipper_stands(up)) leave_plane();
    return;
  }
  bool bump = supported_ = flipper_stands(up);
  const auto plane = nearest_plane(planes_, X_WBase_.translation.z() + lowest_);
  for (const Contact& contact : physics_->nearby(body_)) {
    if (!is_support(contact, up)) continue;
    supported_ |= contact.depth > -kStanding_m && on_wheel(contact);
    bump |= contact.body_b.valid() || contact.normal.z() < 1.0 - 1e-9 || !plane ||
            std::abs(contact.position.z() - plane->height) > kNear_m;
  }
  if (plane && supported_ && !bump && up.z() > math::cos(kLevel_rad) &&
      std::abs(plane_gap(plane->height)) < kNear_m && std::abs(twist_.linear.z()) < kCalm_m_s) {
    return stand_on_plane(*plane);
  }
  look_at_support();
}

// How firmly the wheels stand, on what, and how that moves.
void KinematicDrive::look_at_support() {
  const Vec3 up = X_WBase_.rotation * Vec3::UnitZ();
  double load = 0.0, least = std::numeric_limits<double>::infinity();
  grip_ = 0.0;
  carriers_.clear();
  const auto look_at = [&](const Contact& contact) {
    if (!is_support(contact, up) || !on_wheel(contact) || is_own(contact) ||
        contact.depth < -kStanding_m)
      return;
    const double mu = friction(contact);
    load += contact.force;
    grip_ += mu * contact.force;
    least = std::min(least, mu);
    if (contact.body_b.valid()) carriers_.push_back(contact);
  };
  for (const Contact& contact : physics_->nearby(body_)) look_at(contact);
  for (const BodyIndex flipper : flippers_)
    for (const Contact& contact : physics_->nearby(flipper)) look_at(contact);
  const double weight = mass_ * std::max(0.0, -up.dot(gravity_));
  if (load < kFirstTouch * weight && std::isfinite(least)) grip_ = least * weight;
  carrier_ = Twist{Vec3::Zero(), Vec3::Zero()};
  const Quat to_base = X_WBase_.rotation.conjugate();
  for (const Contact& contact : carriers_) {
    const Twist& twist = physics_->twist(contact.body_b);
    const Vec3 arm = X_WBase_.translation - physics_->pose(contact.body_b).translation;
    const double part = 1.0 / static_cast<double>(carriers_.size());
    carrier_.linear += part * (to_base * (twist.linear + twist.angular.cross(arm)));
    carrier_.angular += part * (to_base * twist.angular);
  }
}

// The wheels push the body that carries the robot with the opposite force.
void KinematicDrive::push_back(const Vec3& impulse) {
  const double part = 1.0 / static_cast<double>(carriers_.size());
  for (const Contact& contact : carriers_) {
    if (physics_->mass(contact.body_b) <= 0.0) continue;
    const Vec3 share = -part * impulse;
    physics_->apply_impulse(
        contact.body_b, share,
        (contact.position - physics_->center_of_mass(contact.body_b)).cross(share));
  }
}

void KinematicDrive::wake() {
  asleep_ = false;
  still_us_ = 0;
  physics_->wake(body_);
}

// The plugin's drive converts the plan to its real velocity.
Displacement KinematicDrive::follow_model(SimTime now) {
  const BaseVelocity asked{planned_.way / step_s_, planned_.side / step_s_,
                           planned_.angle / step_s_};
  const BaseVelocity actual{twist_.linear.x(), twist_.linear.y(), twist_.angular.z()};
  made_ = model_->step({now, asked, actual, X_WBase_});
  if (!std::isfinite(made_.ahead) || !std::isfinite(made_.left) || !std::isfinite(made_.turn)) {
    throw physics::StateError(
        robot_name() + ": its drive '" + *description_->element->attribute("type") +
        "' gave the velocity " + std::to_string(made_.ahead) + ", " + std::to_string(made_.left) +
        ", " + std::to_string(made_.turn) + " at " + std::to_string(now) + " us");
  }
  const Displacement made =
      along_twist(made_.ahead * step_s_, made_.left * step_s_, made_.turn * step_s_);
  lag_.way += planned_.way - made.way;
  lag_.angle += planned_.angle - made.angle;
  lag_.moving = !is_still();
  return made;
}

bool KinematicDrive::is_still() const {
  return !model_ ||
         (math::hypot(made_.ahead, made_.left) < kStill_m_s && std::abs(made_.turn) < kStill_rad_s);
}

void KinematicDrive::before_step(SimTime now) {
  if (asleep_) {
    if (physics_->sleeping(body_)) return;
    wake();
  }
  way_ = planned_ = planner_.step(now, step_us_);
  if (model_) way_ = follow_model(now);
  if (description_->on_odometry) {  // the wheels turn as the robot believes it must; what comes of
                                    // it depends on what they are
    believed_heading_ = wrap_angle(believed_heading_ + planned_.angle);
    const SideRates turned =
        WheelKinematics::believed(description_).wheels({planned_.way, planned_.angle});
    const PlaneMotion made = WheelKinematics::real(description_).motion(turned);
    way_ = along_arc(made.v, made.omega);
  }
  wheel_angles_.advance(way_);
  if (!is_alone()) {
    choose_support();
  } else if (!on_plane_) {
    supported_ = false;
  }
  if (on_plane_) {
    before_on_plane();
  } else {
    before_on_contacts();
  }
}

bool KinematicDrive::servo(Twist& twist, double force, const Vec3& gravity) {
  double dx = way_.x / step_s_ + carrier_.linear.x() - twist.linear.x(),
         dy = way_.y / step_s_ + carrier_.linear.y() - twist.linear.y();
  double turn = way_.angle / step_s_ + carrier_.angular.z() - twist.angular.z();
  if (touched_ && held_) {  // what contacts took in the last step they will take again: the servo
                            // gives it in advance
    dx += sent_.x() - twist.linear.x();
    dy += sent_.y() - twist.linear.y();
    turn += sent_.z() - twist.angular.z();
  }
  bool reached = true;
  const double fall_x = gravity.x() * step_s_, fall_y = gravity.y() * step_s_;
  const double change = math::hypot(dx - fall_x, dy - fall_y), allowed = force * step_s_ / mass_;
  if (change > allowed) {
    dx = fall_x + (dx - fall_x) * allowed / change;
    dy = fall_y + (dy - fall_y) * allowed / change;
    reached = false;
  }
  const double allowed_turn = force * lever_ * step_s_ / yaw_inertia_;
  if (std::abs(turn) > allowed_turn) {
    turn = std::copysign(allowed_turn, turn);
    reached = false;
  }
  twist.linear.x() += dx;
  twist.linear.y() += dy;
  twist.angular.z() += turn;
  sent_ = {twist.linear.x(), twist.linear.y(), twist.angular.z()};
  if (!carriers_.empty())
    push_back(mass_ * (X_WBase_.rotation * Vec3(dx - fall_x, dy - fall_y, 0.0)));
  return reached;
}

void KinematicDrive::before_on_plane() {
  Pose& next = next_;
  next = X_WBase_;
  const double c2 = X_WBase_.rotation.w(), s2 = X_WBase_.rotation.z();  // of half the heading
  const double c = c2 * c2 - s2 * s2, s = 2.0 * c2 * s2;
  next.translation.x() += c * way_.x - s * way_.y;
  next.translation.y() += s * way_.x + c * way_.y;
  if (way_.angle != 0.0) next.rotation = about_z(heading_ + way_.angle);

  if (touched_ || behind_) {
    Twist twist = twist_;
    carriers_.clear();
    behind_ =
        !servo(twist, description_->traction ? std::min(max_force_, grip_on_plane()) : max_force_,
               Vec3::Zero());
    if (behind_) {
      physics_->drive(body_, body_twist(X_WBase_, twist));
      return;
    }
  }
  const Pose X_WB = next * X_BaseB_;
  const Twist mean{(X_WB.translation - physics_->pose(body_).translation) / step_s_,
                   {0.0, 0.0, way_.angle / step_s_}};
  physics_->guide(body_, mean, X_WB);
}

void KinematicDrive::before_on_contacts() {
  if (!supported_) {
    physics_->set_gravity(body_, gravity_);
    return;
  }
  const Vec3 up = X_WBase_.rotation * Vec3::UnitZ();
  physics_->set_gravity(body_, up * up.dot(gravity_));
  Twist twist = twist_;
  const double force = touched_ || behind_ ? max_force_ : std::numeric_limits<double>::infinity();
  const Vec3 along_plane = X_WBase_.rotation.conjugate() * Vec3(gravity_ - up * up.dot(gravity_));
  behind_ = !servo(twist, description_->traction ? std::min(force, grip_) : force, along_plane);
  physics_->drive(body_, body_twist(X_WBase_, twist));
}

void KinematicDrive::after_step(SimTime now) {
  if (asleep_) {
    velocity_.setZero();
    acceleration_.setZero();
    planner_.show_step();
    return;
  }
  if (on_plane_) {
    after_on_plane(now);
  } else {
    after_on_contacts(now);
  }
  const PlaneMotion wheels = of_wheels();
  wheel_v_ = wheels.v;
  wheel_omega_ = wheels.omega;
  planner_.show_step();
}

// The speed and turn rate that the wheels give at the rates of the plan.
PlaneMotion KinematicDrive::of_wheels() const {
  if (model_) return {made_.ahead, made_.turn};
  if (!description_->on_odometry) return {planner_.v(), planner_.omega()};
  return WheelKinematics::real(description_)
      .motion(WheelKinematics::believed(description_).wheels({planner_.v(), planner_.omega()}));
}

// On odometry the wheels do as planned, and the robot believes them.
void KinematicDrive::finish(SimTime now, double way, double angle, bool touched, double side) {
  if (description_->on_odometry && planner_.has_primitive())
    return planner_.finish(now, planned_.way, planned_.angle, false);
  if (touched) for_each_contact([&](const Contact& contact) { resist(contact); });
  planner_.finish(now, way, angle, touched, lag_, side);
  if (touched || !planner_.has_primitive())
    lag_ = {0.0, 0.0, lag_.moving};  // a velocity is not made up for
}

void KinematicDrive::after_on_plane(SimTime now) {
  held_ = touched_;
  touched_ = false;
  for_each_contact([&](const Contact&) { touched_ = true; });
  if (!touched_ && !behind_) {
    heading_ += way_.angle;
    if (std::abs(heading_) > M_PI) heading_ = wrap_angle(heading_);
    finish(now, way_.way, way_.angle, false, way_.side);
    const PlaneMotion wheels = of_wheels();
    const Twist twist{{wheels.v, side(), 0.0}, {0.0, 0.0, wheels.omega}};
    set_state(next_, twist);
    physics_->set_twist(body_, body_twist(X_WBase_, twist));
    fall_asleep_when_still(true);
    return;
  }
  // Bullet decided; out of the plane it can only have rounded.
  Pose X_WBase = base_pose();
  const double last_heading = heading_;
  const Vec3 moved = X_WBase.translation - X_WBase_.translation;
  heading_ = heading(X_WBase.rotation);
  X_WBase.rotation = about_z(heading_);
  X_WBase.translation.z() = X_WBase_.translation.z();
  const double angle = wrap_angle(heading_ - last_heading), middle = last_heading + 0.5 * angle;
  Twist twist = base_twist(X_WBase);
  twist.linear.z() = twist.angular.x() = twist.angular.y() = 0.0;
  set_state(X_WBase, twist);
  const double sine = math::sin(middle), cosine = math::cos(middle);
  finish(now, moved.x() * cosine + moved.y() * sine, angle, true,
         moved.y() * cosine - moved.x() * sine);
  fall_asleep_when_still(false);
}

void KinematicDrive::after_on_contacts(SimTime now) {
  const Vec3 up = X_WBase_.rotation * Vec3::UnitZ();
  held_ = touched_;
  touched_ = false;
  for_each_contact([&](const Contact& contact) { touched_ |= !is_support(contact, up); });
  Pose X_WBase = base_pose().normalized();
  const Quat turn = X_WBase_.rotation.conjugate() * X_WBase.rotation;
  const double bullet_angle = 2.0 * math::atan2(turn.z(), turn.w());
  const Vec3 moved = X_WBase_.rotation.conjugate() * (X_WBase.translation - X_WBase_.translation);
  if (!supported_ || touched_ || behind_) {
    set_state(X_WBase, base_twist(X_WBase));
    finish(now, moved.x(), wrap_angle(bullet_angle), true, moved.y());
    fall_asleep_when_still(false);
    return;
  }
  // Only the support: along the robot's own plane the plan holds, across it Bullet.
  const Vec3 carried = step_s_ * carrier_.linear;
  X_WBase.translation = X_WBase_ * Vec3(way_.x + carried.x(), way_.y + carried.y(), moved.z());
  X_WBase.rotation = (X_WBase_.rotation * (turn * about_z(-bullet_angle)) *
                      about_z(way_.angle + step_s_ * carrier_.angular.z()))
                         .normalized();
  Twist twist = base_twist(X_WBase);
  finish(now, way_.way, way_.angle, false, way_.side);
  const PlaneMotion wheels = of_wheels();
  twist.linear.x() = wheels.v + carrier_.linear.x();
  twist.linear.y() = side() + carrier_.linear.y();
  twist.angular.z() = wheels.omega + carrier_.angular.z();
  physics_->set_pose(body_, X_WBase * X_BaseB_);
  physics_->set_twist(body_, body_twist(X_WBase, twist));
  set_state(X_WBase, twist);
  const bool carried_along =
      carrier_.linear.norm() > kStill_m_s || carrier_.angular.norm() > kStill_rad_s;
  fall_asleep_when_still(!carried_along && std::abs(twist.linear.z()) < kStill_m_s &&
                         twist.angular.head<2>().norm() < kStill_rad_s);
}

void KinematicDrive::fall_asleep_when_still(bool still) {
  if (!still || !planner_.resting() || !is_still() || !physics_->may_sleep(body_)) {
    still_us_ = 0;
    return;
  }
  still_us_ += step_us_;
  if (still_us_ < kFallAsleep_us) return;
  asleep_ = true;
  twist_ = {};
  way_ = {};
  physics_->sleep(body_);
}

void KinematicDrive::read_wheels(Snapshot& snapshot) const {
  wheel_angles_.read(snapshot, {wheel_v_, side(), wheel_omega_}, planner_.curvature());
}

}  // namespace ruedo::robot
