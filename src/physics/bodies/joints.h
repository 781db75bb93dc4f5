// Joints between bodies as Bullet constraints: limits, damping, friction, motors.
//
// A joint's position is 0 at the start, and grows as the child rotates about the axis or moves
// along it.
#pragma once

#include <cmath>
#include <memory>
#include <vector>

#include "physics/base/rows.h"
#include "physics/base/servo.h"
#include "physics/bodies/rigid_bodies.h"
#include "ruedo/state_archive.h"
#include "world/model/body_layout.h"

namespace ruedo::physics {

// The joint's command and response: all state that changes between substeps.
struct JointState {
  explicit JointState(const world::Joint& joint) : limits_(joint.axis), limits2_(joint.axis2) {}

  enum class Mode { passive, motor, effort, servo };
  bool follows_ = false;  // in the coming substep, with follow_rate_
  double follow_rate_ = 0.0;
  double leader_rate_ = 0.0;           // smoothed
  double parent_position_ = 0.0;       // rad about the first axis
  world::JointAxis limits_, limits2_;  // limits2_: second axis of universal joints and gearboxes
  struct {
    double rate = 0.0, lowest = 0.0, highest = 0.0, gain = 0.0, effort = 0.0;
  } told_;  // before limits are applied
  WheelServo servo_;
  double woken_at_ = 0.0;  // the servo's rate when the bodies were last woken
  Mode mode_ = Mode::passive;
  double command_ = 0.0, lowest_effort_ = 0.0, highest_effort_ = 0.0, gain_ = 0.0;
  double position_ = 0.0, effort_ = 0.0;

  void exchange(StateArchive& archive) {
    archive(follows_, follow_rate_, leader_rate_, parent_position_, limits_.effort,
            limits_.velocity, limits_.rate_gain, told_, servo_, woken_at_, mode_, command_,
            lowest_effort_, highest_effort_, gain_, position_, effort_);
  }
};

class JointConstraint : private JointState {
 public:
  // X_PJ, X_CJ: the joint's frame in Bullet's frames I of parent and child. reference: for a
  // gearbox.
  JointConstraint(const world::Joint& joint, btRigidBody& parent, btRigidBody& child,
                  const Pose& X_PJ, const Pose& X_CJ, btRigidBody* reference = nullptr);

  btTypedConstraint* constraint() {
    return constraint_.get();
  }  // null: nothing to hold (no such joint)

  // For a universal joint, these and the commands refer to its first axis; for a gearbox, to the
  // child's axis, relative to the reference; 0 for a ball joint.
  double position() const { return position_; }  // rad or m
  double velocity() const;
  double effort() const { return effort_; }

  // Holds that rate within these efforts until the next command (rad/s or m/s; N m or N). With a
  // gain (N m s/rad or N s/m) the effort is proportional to the rate error; with an infinite gain
  // the rate is held exactly.
  void set_motor(double rate, double lowest_effort, double highest_effort, double gain);
  void set_effort(double effort);  // gives that effort until the next command
  void set_servo(const WheelServo& servo);
  // Applies until the bodies are reset; the current command is limited at once.
  void set(JointSetting setting, double value);
  bool commanded() const { return mode_ != Mode::passive; }

  // Whether it may move faster than its bodies do now: by a command or a spring.
  bool may_start() const {
    return mode_ == Mode::effort || mode_ == Mode::servo || limits_.spring_stiffness > 0.0 ||
           std::abs(command_) > 1e-3;
  }

  // Whether its motion is prescribed or zero: forces on its bodies do not change it.
  bool leads() const;

  // The bodies were reset to the start: position 0, no command.
  void reset() {
    position_ = effort_ = command_ = 0.0;
    parent_position_ = 0.0;
    follows_ = false;
    mode_ = Mode::passive;
    limits_.effort = written_.effort;
    limits_.velocity = written_.velocity;
    limits_.rate_gain = written_.rate_gain;
  }

  void disable() {  // it holds nothing from now on
    if (constraint_) constraint_->setEnabled(false);
    reset();
  }

  // Takes the state of the same joint in another copy of the world.
  void copy_from(const JointConstraint& other);
  void exchange(StateArchive& archive);  // likewise

  // For the coming substep: follows another joint, with at most its maximum effort. The leader does
  // not feel it.
  void follow(double leader_position, double leader_rate, double substep_s);
  void before_substep(double substep_s);
  void after_substep(double substep_s);

 private:
  using Constraint = std::unique_ptr<btTypedConstraint>;
  Constraint make_constraint();  // of the joint's type
  Constraint make_hinge() const;
  std::unique_ptr<btSliderConstraint> make_slider() const;
  Constraint make_screw() const;
  Constraint make_universal();
  Constraint make_gearbox();
  Vec3 axis_in_world() const;
  void wake();
  void turn_on(JointMotor& motor, const Vec3& axis, double rate, double lowest, double highest,
               double substep_s) const;
  void damp(JointMotor& damper, const Vec3& axis, double damping, double substep_s) const;
  void serve(const Vec3& axis, double substep_s);
  void push(double effort);  // for one substep
  void limit_first_axis();   // of a universal joint, for one substep
  void brake_second_axis(double substep_s);
  double advanced() const;  // m along the axis since the start
  void hold_thread(double substep_s);
  Vec3 gear_axis(const world::JointAxis& axis) const;  // world
  void mesh_gears(double substep_s);
  // rad about an axis of the reference since the start, unwrapped using the previous value
  double turned(const btRigidBody& body, const Quat& start_in_R, const world::JointAxis& axis,
                double before) const;

  world::JointType type_;
  double advance_;              // m/rad: screw only
  double multiplier_, offset_;  // applied to the leader's position
  double ratio_;                // gearbox only, like the following
  btRigidBody* reference_;
  Quat R_RJ_, R_RP_, R_RC_;  // at the start: the joint's frame and both bodies in the reference
  struct {
    double effort, velocity, rate_gain;
  } written_;  // as in the file
  btRigidBody& parent_;
  btRigidBody& child_;
  Pose X_PJ_, X_CJ_;
  Vec3 axis2_in_C_ = Vec3::UnitY();  // universal only
  Constraint constraint_;
  std::unique_ptr<JointMotors> motors_ =
      std::make_unique<JointMotors>();  // never moves in memory: the constraint points to it
};

}  // namespace ruedo::physics
