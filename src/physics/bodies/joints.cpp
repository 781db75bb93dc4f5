// Hinges, sliders, ball and universal joints. Friction acts like a motor with rate 0 and a bounded
// impulse, damping like one whose impulse is in proportion to the rate that results: however large
// they are, they never reverse a motion.
#include "physics/bodies/joints.h"

#include <algorithm>
#include <cmath>

#include "ruedo/math.h"

namespace ruedo::physics {

namespace {

// SDF limits beyond this mean "no limit".
constexpr double kNoLimit = 1e9;

bool limited(const world::JointAxis& axis) {
  return (axis.lower > -kNoLimit || axis.upper < kNoLimit) && axis.lower <= axis.upper;
}

// Bullet's hinge knows its angle modulo a turn. Limits beyond that, or on one side only, are
// enforced by a window of this size (rad) on both sides of the current angle, clipped at the
// limits.
constexpr double kWindow = 1.5;

bool within_a_turn(const world::JointAxis& axis) { return axis.lower > -M_PI && axis.upper < M_PI; }

// A frame at J with its x or z axis along the joint's axis.
Pose along(const Pose& X, const Vec3& axis_in_J, const Vec3& unit) {
  return {X.rotation * Quat::FromTwoVectors(unit, axis_in_J), X.translation};
}

// Changes of a motor's rate below this (m/s or rad/s) do not wake sleeping bodies.
constexpr double kNewRate = 1e-3;

// Bullet's universal joint counts its angles in the opposite direction; the first is about its
// frame's z, the second about y.
constexpr int kFirst = 2, kSecond = 1, kLocked = 0;
constexpr double kAside = 1e-9;
constexpr double kSquare =
    M_PI / 2 - 1e-3;  // range of the second angle: at the end the first axis is aligned with it

void set_turns(btRotationalLimitMotor& turns, double lower, double upper) {
  turns.m_loLimit = -upper;
  turns.m_hiLimit = -lower;
}

double bounded(double value, double limit) { return std::clamp(value, -limit, limit); }

// Holds nothing itself: it only carries its motor.
class Unconstrained : public btTypedConstraint {
 public:
  Unconstrained(btRigidBody& a, btRigidBody& b) : btTypedConstraint(GEAR_CONSTRAINT_TYPE, a, b) {}
  void getInfo1(btConstraintInfo1* info) override { info->m_numConstraintRows = info->nub = 0; }
  void getInfo2(btConstraintInfo2*) override {}
  void setParam(int, btScalar, int) override {}
  btScalar getParam(int, int) const override { return 0.0; }
};

Quat rotation_of(const btRigidBody& body) {
  return from_bt(body.getWorldTransform().getRotation());
}

// rad, about an axis that need not be the rotation's own.
double angle_about(const Vec3& axis, const Quat& turn) {
  const Vec3 square = axis.unitOrthogonal(), now = turn * square;
  return math::atan2(axis.dot(square.cross(now)), square.dot(now));
}

}  // namespace

JointConstraint::JointConstraint(const world::Joint& joint, btRigidBody& parent, btRigidBody& child,
                                 const Pose& X_PJ, const Pose& X_CJ, btRigidBody* reference)
    : JointState(joint),
      type_(joint.type),
      advance_(joint.advance),
      multiplier_(joint.mimic_multiplier),
      offset_(joint.mimic_offset - joint.mimic_multiplier * joint.mimic_reference),
      ratio_(joint.gear_ratio),
      reference_(reference),
      written_{joint.axis.effort, joint.axis.velocity, joint.axis.rate_gain},
      parent_(parent),
      child_(child),
      X_PJ_(X_PJ),
      X_CJ_(X_CJ) {
  constraint_ = make_constraint();
  constraint_->setUserConstraintPtr(motors_.get());
}

JointConstraint::Constraint JointConstraint::make_constraint() {
  switch (type_) {
    case world::JointType::revolute:
    case world::JointType::continuous: return make_hinge();
    case world::JointType::prismatic: return make_slider();
    case world::JointType::screw: return make_screw();
    case world::JointType::universal: return make_universal();
    case world::JointType::gearbox: return make_gearbox();
    case world::JointType::ball:
      return std::make_unique<btPoint2PointConstraint>(parent_, child_, to_bt(X_PJ_.translation),
                                                       to_bt(X_CJ_.translation));
    case world::JointType::fixed: break;
  }
  return std::make_unique<btFixedConstraint>(parent_, child_, to_bt(X_PJ_), to_bt(X_CJ_));
}

JointConstraint::Constraint JointConstraint::make_hinge() const {
  auto hinge = std::make_unique<btHingeConstraint>(
      parent_, child_, to_bt(along(X_PJ_, limits_.axis_in_J, Vec3::UnitZ())),
      to_bt(along(X_CJ_, limits_.axis_in_J, Vec3::UnitZ())), true);
  if (type_ == world::JointType::revolute && limited(limits_) && within_a_turn(limits_)) {
    hinge->setLimit(limits_.lower, limits_.upper, 1.0, 0.3, 0.0);
  } else {
    hinge->setLimit(1.0, -1.0);  // no limit, or a window in each substep
  }
  return hinge;
}

std::unique_ptr<btSliderConstraint> JointConstraint::make_slider() const {
  auto slider = std::make_unique<btSliderConstraint>(
      parent_, child_, to_bt(along(X_PJ_, limits_.axis_in_J, Vec3::UnitX())),
      to_bt(along(X_CJ_, limits_.axis_in_J, Vec3::UnitX())), true);
  slider->setLowerLinLimit(limited(limits_) ? std::max(limits_.lower, -kNoLimit) : 1.0);
  slider->setUpperLinLimit(limited(limits_) ? std::min(limits_.upper, kNoLimit) : -1.0);
  slider->setLowerAngLimit(0.0);
  slider->setUpperAngLimit(0.0);
  return slider;
}

// A slider that may rotate; the thread is a separate row.
JointConstraint::Constraint JointConstraint::make_screw() const {
  auto slider = make_slider();
  const double one = bounded(limits_.lower * advance_, kNoLimit),
               other = bounded(limits_.upper * advance_, kNoLimit);
  slider->setLowerLinLimit(limited(limits_) && advance_ != 0.0 ? std::min(one, other) : 1.0);
  slider->setUpperLinLimit(limited(limits_) && advance_ != 0.0 ? std::max(one, other) : -1.0);
  slider->setLowerAngLimit(1.0);
  slider->setUpperAngLimit(-1.0);
  return slider;
}

// Bullet needs perpendicular axes, in world coordinates at the start.
JointConstraint::Constraint JointConstraint::make_universal() {
  const Pose X_WJ = from_bt(parent_.getWorldTransform()) * X_PJ_;
  const Vec3 first = X_WJ.rotation * limits_.axis_in_J;
  Vec3 second = X_WJ.rotation * limits2_.axis_in_J;
  second -= first * first.dot(second);
  if (second.norm() < 1e-6) second = first.unitOrthogonal();
  btVector3 anchor = to_bt(X_WJ.translation), axis1 = to_bt(first),
            axis2 = to_bt(Vec3(second.normalized()));
  axis2_in_C_ = (from_bt(child_.getWorldTransform()).rotation.conjugate() * second).normalized();
  auto universal = std::make_unique<btUniversalConstraint>(parent_, child_, anchor, axis1, axis2);
  // Bullet drops a locked row whose error is exactly zero. It is therefore locked a nanometre off.
  universal->setLinearLowerLimit({kAside, kAside, kAside});
  universal->setLinearUpperLimit({kAside, kAside, kAside});
  set_turns(*universal->getRotationalLimitMotor(kLocked), -kAside, -kAside);
  set_turns(*universal->getRotationalLimitMotor(kFirst), 1.0,
            -1.0);  // no limit, or a window in each substep
  set_turns(*universal->getRotationalLimitMotor(kSecond), std::max(limits2_.lower, -kSquare),
            std::min(limits2_.upper, kSquare));
  return universal;
}

JointConstraint::Constraint JointConstraint::make_gearbox() {
  const Quat to_R = rotation_of(*reference_).conjugate();
  R_RP_ = to_R * rotation_of(parent_);
  R_RC_ = to_R * rotation_of(child_);
  R_RJ_ = R_RP_ * X_PJ_.rotation;
  return std::make_unique<Unconstrained>(parent_, child_);
}

// The part that belongs to Bullet's constraint; everything else follows from the joint and its
// bodies in each substep.
void JointConstraint::copy_from(const JointConstraint& other) {
  JointState::operator=(other);
  *motors_ = *other.motors_;
  for (JointMotor* motor : {&motors_->first, &motors_->second})
    if (motor->reference) motor->reference = reference_;
  if (constraint_) constraint_->setEnabled(other.constraint_->isEnabled());
}

void JointConstraint::exchange(StateArchive& archive) {
  JointState::exchange(archive);
  for (JointMotor* motor : {&motors_->first, &motors_->second}) {
    bool refers = motor->reference;
    archive(motor->on, motor->linear, motor->axis, motor->anchor, motor->advance,
            motor->parent_axis, refers, motor->rate, motor->lower, motor->upper, motor->softness,
            motor->impulse);
    motor->reference = refers ? reference_ : nullptr;
  }
  bool enabled = constraint_ && constraint_->isEnabled();
  archive(enabled);
  if (constraint_) constraint_->setEnabled(enabled);
}

Vec3 JointConstraint::axis_in_world() const {
  return from_bt(parent_.getWorldTransform().getRotation()) * (X_PJ_.rotation * limits_.axis_in_J);
}

double JointConstraint::velocity() const {
  const Vec3 axis = axis_in_world();
  const Vec3 turn = from_bt(child_.getAngularVelocity() - parent_.getAngularVelocity());
  switch (type_) {
    case world::JointType::revolute:
    case world::JointType::continuous:
    case world::JointType::universal:
    case world::JointType::screw: return axis.dot(turn);
    case world::JointType::prismatic: {
      const btVector3 arm = child_.getWorldTransform() * to_bt(X_CJ_.translation);
      return axis.dot(
          from_bt(child_.getVelocityInLocalPoint(arm - child_.getCenterOfMassPosition()) -
                  parent_.getVelocityInLocalPoint(arm - parent_.getCenterOfMassPosition())));
    }
    case world::JointType::gearbox:
      return gear_axis(limits2_).dot(
          from_bt(child_.getAngularVelocity() - reference_->getAngularVelocity()));
    default: return 0.0;
  }
}

void JointConstraint::set(JointSetting setting, double value) {
  (setting == JointSetting::rate_gain ? limits_.rate_gain
   : setting == JointSetting::effort  ? limits_.effort
                                      : limits_.velocity) = value;
  if (mode_ == Mode::motor) set_motor(told_.rate, told_.lowest, told_.highest, told_.gain);
  if (mode_ == Mode::effort) set_effort(told_.effort);
  if (mode_ == Mode::servo) set_servo(servo_);
  wake();
}

void JointConstraint::set_motor(double rate, double lowest_effort, double highest_effort,
                                double gain) {
  told_ = {rate, lowest_effort, highest_effort, gain, 0.0};
  rate = bounded(rate, limits_.velocity);
  lowest_effort = std::max(lowest_effort, -limits_.effort);
  highest_effort = std::min(highest_effort, limits_.effort);
  const bool news = mode_ != Mode::motor || std::abs(rate - command_) > kNewRate;
  mode_ = Mode::motor;
  command_ = rate;
  lowest_effort_ = lowest_effort;
  highest_effort_ = highest_effort;
  gain_ = std::min(gain, limits_.rate_gain);
  if (news) wake();
}

void JointConstraint::set_effort(double effort) {
  told_.effort = effort;
  effort = bounded(effort, limits_.effort);
  const bool news = mode_ != Mode::effort || effort != command_;
  mode_ = Mode::effort;
  command_ = effort;
  if (news) wake();
}

bool JointConstraint::leads() const {
  constexpr double kOfItsEffort = 0.99;  // beyond this it is at its limit, and may lag
  if (!constraint_ || !constraint_->isEnabled() || type_ == world::JointType::fixed) return true;
  if (mode_ != Mode::motor || follows_ || std::isfinite(gain_)) return false;
  const JointMotor& motor = motors_->first;
  return type_ != world::JointType::universal && type_ != world::JointType::screw &&
         motor.impulse >= kOfItsEffort * motor.lower && motor.impulse <= kOfItsEffort * motor.upper;
}

void JointConstraint::set_servo(const WheelServo& servo) {
  constexpr double kNewEffort = 1e-3;  // N m or N
  const double change = std::abs(servo.rate - woken_at_);
  const bool news = mode_ != Mode::servo || change > kNewRate || servo.gain * change > kNewEffort;
  mode_ = Mode::servo;
  servo_ = servo;
  if (!news) return;
  woken_at_ = servo.rate;
  wake();
}

void JointConstraint::wake() {
  if (!parent_.isStaticObject()) parent_.activate(true);
  if (!child_.isStaticObject()) child_.activate(true);
}

void JointConstraint::turn_on(JointMotor& motor, const Vec3& axis, double rate, double lowest,
                              double highest, double substep_s) const {
  constexpr double kMost = 1e9;  // stands for infinity, which an impulse cannot be
  motor.on = highest > 0.0 || lowest < 0.0;
  motor.linear = type_ == world::JointType::prismatic;
  motor.axis = axis;
  motor.anchor = from_bt(child_.getWorldTransform() * to_bt(X_CJ_.translation));
  motor.rate = rate;
  motor.lower = std::max(lowest, -kMost) * substep_s;
  motor.upper = std::min(highest, kMost) * substep_s;
  motor.softness = 0.0;
}

// Takes the rate at the end of the substep, not that at its beginning: stable at any damping.
void JointConstraint::damp(JointMotor& damper, const Vec3& axis, double damping,
                           double substep_s) const {
  if (damping <= 0.0) return;
  constexpr double kAnything = 1e9;  // N m or N
  turn_on(damper, axis, 0.0, -kAnything, kAnything, substep_s);
  damper.softness = 1.0 / (damping * substep_s);
}

void JointConstraint::serve(const Vec3& axis, double substep_s) {
  const double now = velocity();
  double rate = servo_.rate;
  if (rate * now > 0.0 && std::abs(now) >= limits_.velocity)
    rate = std::copysign(std::min(std::abs(rate), limits_.velocity), rate);
  motors_->first.impulse = 0.0;
  if (servo_.gain > 0.0) {
    turn_on(motors_->first, axis, rate, std::max(servo_.lowest_torque, -limits_.effort),
            std::min(servo_.highest_torque, limits_.effort), substep_s);
    motors_->first.softness = 1.0 / (servo_.gain * substep_s);
  }
  damp(motors_->damper, axis, limits_.damping, substep_s);
  if (limits_.friction > 0.0 && type_ != world::JointType::universal &&
      type_ != world::JointType::screw)
    turn_on(motors_->second, axis, 0.0, -limits_.friction, limits_.friction, substep_s);
}

void JointConstraint::push(double effort) {
  const btVector3 along_axis = to_bt(Vec3(axis_in_world() * effort));
  if (type_ == world::JointType::prismatic) {
    const btVector3 at = child_.getWorldTransform() * to_bt(X_CJ_.translation);
    child_.applyForce(along_axis, at - child_.getCenterOfMassPosition());
    parent_.applyForce(-along_axis, at - parent_.getCenterOfMassPosition());
  } else if (type_ != world::JointType::ball && type_ != world::JointType::fixed) {
    child_.applyTorque(along_axis);
    parent_.applyTorque(-along_axis);
  }
}

// Bullet does not count full turns: a window around the current angle.
void JointConstraint::limit_first_axis() {
  const double lower = std::max(limits_.lower, position_ - kWindow),
               upper = std::min(limits_.upper, position_ + kWindow);
  const double turned = position_ - wrap_angle(position_);
  set_turns(*static_cast<btUniversalConstraint&>(*constraint_).getRotationalLimitMotor(kFirst),
            lower - turned, upper - turned);
}

void JointConstraint::brake_second_axis(double substep_s) {
  const Vec3 axis = from_bt(child_.getWorldTransform().getRotation()) * axis2_in_C_;
  turn_on(motors_->second, axis, 0.0, -limits2_.friction, limits2_.friction, substep_s);
  damp(motors_->second_damper, axis, limits2_.damping, substep_s);
}

double JointConstraint::advanced() const {
  const btVector3 from = parent_.getWorldTransform() * to_bt(X_PJ_.translation);
  const btVector3 to = child_.getWorldTransform() * to_bt(X_CJ_.translation);
  return axis_in_world().dot(from_bt(to - from));
}

void JointConstraint::hold_thread(double substep_s) {
  constexpr double kEachSubstep = 0.2;  // of the error corrected
  constexpr double kAnything = 1e9;     // N
  const double error = advanced() - advance_ * position_;
  turn_on(motors_->second, axis_in_world(), -kEachSubstep * error / substep_s, -kAnything,
          kAnything, substep_s);
  motors_->second.linear = true;
  motors_->second.advance = advance_;
}

Vec3 JointConstraint::gear_axis(const world::JointAxis& axis) const {
  return rotation_of(*reference_) * (R_RJ_ * axis.axis_in_J);
}

double JointConstraint::turned(const btRigidBody& body, const Quat& start_in_R,
                               const world::JointAxis& axis, double before) const {
  const Quat turn =
      rotation_of(*reference_).conjugate() * rotation_of(body) * start_in_R.conjugate();
  return before + wrap_angle(angle_about(R_RJ_ * axis.axis_in_J, turn) - before);
}

void JointConstraint::mesh_gears(double substep_s) {
  constexpr double kEachSubstep = 0.2;  // of the error corrected
  constexpr double kAnything = 1e9;     // N m
  const double error = position_ + ratio_ * parent_position_;
  turn_on(motors_->first, gear_axis(limits2_), -kEachSubstep * error / substep_s, -kAnything,
          kAnything, substep_s);
  motors_->first.parent_axis = ratio_ * gear_axis(limits_);
  motors_->first.reference = reference_;
}

void JointConstraint::follow(double leader_position, double leader_rate, double substep_s) {
  constexpr double kEachSubstep = 0.3;  // of the lag corrected
  // Of the change of the leader's rate. Where they press something between them, the follower moves
  // the leader: at once, they would throw it to and fro.
  constexpr double kAnswered = 0.3;
  leader_rate_ = follows_ ? leader_rate_ + kAnswered * (leader_rate - leader_rate_) : leader_rate;
  follows_ = true;
  follow_rate_ =
      bounded(multiplier_ * leader_rate_ +
                  kEachSubstep * (multiplier_ * leader_position + offset_ - position_) / substep_s,
              limits_.velocity);
}

void JointConstraint::before_substep(double substep_s) {
  if (!constraint_ || !constraint_->isEnabled()) return;
  motors_->first.on = motors_->second.on = false;
  motors_->damper.on = motors_->second_damper.on = false;
  if (type_ == world::JointType::gearbox) return mesh_gears(substep_s);
  if (type_ == world::JointType::screw) hold_thread(substep_s);
  if (type_ == world::JointType::revolute && limited(limits_) && !within_a_turn(limits_)) {
    static_cast<btHingeConstraint&>(*constraint_)
        .setLimit(std::max(limits_.lower, position_ - kWindow),
                  std::min(limits_.upper, position_ + kWindow), 1.0, 0.3, 0.0);
  }
  if (type_ == world::JointType::universal) {
    brake_second_axis(substep_s);
    if (limited(limits_)) limit_first_axis();
  }
  if (type_ == world::JointType::ball || type_ == world::JointType::fixed) return;
  if (limits_.spring_stiffness > 0.0)
    push(limits_.spring_stiffness * (limits_.spring_reference - position_));
  const Vec3 axis = axis_in_world();
  if (follows_)
    return turn_on(motors_->first, axis, follow_rate_, -limits_.effort, limits_.effort, substep_s);
  if (mode_ == Mode::motor) {
    turn_on(motors_->first, axis, command_, lowest_effort_, highest_effort_, substep_s);
    if (std::isfinite(gain_)) motors_->first.softness = 1.0 / (gain_ * substep_s);
    return;
  }
  if (mode_ == Mode::servo) return serve(axis, substep_s);
  if (mode_ == Mode::effort) push(command_);
  turn_on(motors_->first, axis, 0.0, -limits_.friction, limits_.friction, substep_s);
  damp(motors_->damper, axis, limits_.damping, substep_s);
}

void JointConstraint::after_substep(double substep_s) {
  if (!constraint_ || !constraint_->isEnabled()) return;
  const bool driven = follows_ || mode_ == Mode::motor || mode_ == Mode::servo ||
                      type_ == world::JointType::gearbox;
  effort_ = driven ? motors_->first.impulse / substep_s : mode_ == Mode::effort ? command_ : 0.0;
  switch (type_) {
    case world::JointType::revolute:
    case world::JointType::continuous: {
      const double angle =
          static_cast<btHingeConstraint&>(*constraint_)
              .getHingeAngle(parent_.getWorldTransform(), child_.getWorldTransform());
      position_ += wrap_angle(angle - position_);
      break;
    }
    case world::JointType::prismatic: position_ = advanced(); break;
    case world::JointType::screw: {
      const Quat turn = rotation_of(parent_).conjugate() * rotation_of(child_) * X_CJ_.rotation *
                        X_PJ_.rotation.conjugate();
      position_ += wrap_angle(angle_about(X_PJ_.rotation * limits_.axis_in_J, turn) - position_);
      break;
    }
    case world::JointType::gearbox:
      position_ = turned(child_, R_RC_, limits2_, position_);
      parent_position_ = turned(parent_, R_RP_, limits_, parent_position_);
      break;
    case world::JointType::universal: {
      // A rotation about the parent's axis, then one about the child's: where the child's second
      // axis points, seen along the first.
      const Quat R_PC = from_bt(parent_.getWorldTransform().getRotation()).conjugate() *
                        from_bt(child_.getWorldTransform().getRotation());
      const Vec3 first = X_PJ_.rotation * limits_.axis_in_J;
      const Vec3 then = X_PJ_.rotation * (X_CJ_.rotation.conjugate() * axis2_in_C_),
                 now = R_PC * axis2_in_C_;
      position_ += wrap_angle(math::atan2(first.dot(then.cross(now)), then.dot(now)) - position_);
      break;
    }
    default: break;
  }
}

}  // namespace ruedo::physics
