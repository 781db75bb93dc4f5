// Plans a robot's commanded motion: converts commands and motion primitives to a plan of speed and
// turn rate within the robot's limits, and a state to publish.
//
// A plan starts at a whole microsecond and is evaluated in closed form, so that a robot's path does
// not depend on the step size. A new command replans from the current velocities, so that nothing
// exceeds the limits.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "robot/base_motion.h"
#include "robot/motion_log.h"
#include "robot/robots.h"
#include "robot/wheel_kinematics.h"
#include "ruedo/bound.h"
#include "ruedo/math.h"
#include "ruedo/state_archive.h"
#include "world/model/world_model.h"

namespace ruedo::robot {

// The distance of a robot behind its plan. 0 for a drive that follows its plan exactly.
struct Lag {
  double way = 0.0, angle = 0.0;  // m, rad
  bool moving = false;            // not at rest yet
};

class MotionPlanner {
 public:
  // rims: of its rolling wheels, in order (world::WheelPlacement::rim); needed if they can roll
  // sideways.
  explicit MotionPlanner(const world::DriveDescription& drive, const std::vector<Vec3>& rims = {});

  // Commands, at sim time `now`. Invalid values are refused, and only the log changes.
  void command(const VelocityCommand& command, SimTime now);
  void command(const WheelCommand& command, SimTime now);
  // heading: of base_link in odom (rad).
  void command(const MoveCommand& command, SimTime now, double heading);
  void refuse(int64_t id, int8_t kind, int8_t reason);

  // The robot was placed somewhere, at rest: its current motion is cancelled.
  void stand_still(SimTime now);
  void shift_time(SimTime us);  // sim time was set back by that much

  // The displacement planned from now to now + step_us.
  Displacement step(SimTime now, int64_t step_us);
  // Before finish(): a foreign link that the robot touched in this step, and the work (J) that it
  // absorbed from the commanded motion.
  void resist(LinkIndex link, double work);
  // After step(): the actual result, with base_link's travelled distance (m), angle (rad) and
  // distance to the left (m). `touched`: by something that may have changed them. Ends primitives,
  // also those whose plan is over once the robot has settled.
  void finish(SimTime now, double way, double angle, bool touched, const Lag& lag = {},
              double side = 0.0);

  double v() const { return v_; }  // m/s and rad/s at the end of the last step, as planned
  double omega() const { return omega_; }
  double side() const { return side_; }  // m/s, to the left
  double curvature() const {
    return is_steered() ? math::tan(steering_) / drive_->wheelbase : 0.0;
  }  // 1/m
  bool has_primitive() const { return primitive_.axis != Axis::none; }
  bool by_wheels() const { return by_wheels_; }  // the last command gave wheel rates
  bool resting() const { return resting_; }  // at rest, and nothing happens until the next command
  const MotionLog& log() const { return log_; }
  void show_step() { log_.advance(); }
  void exchange(StateArchive& archive);

 private:
  enum class Axis { none, way, angle, arc };
  struct Primitive {
    Axis axis = Axis::none;  // none: no primitive is running
    double target = 0.0;     // m; rad for angle; distance along an arc in m
    double unit = 1.0;       // published units per m or rad of `target`
    double curvature = 0.0;  // arc: 1/m
    double done = 0.0;       // m or rad that were executed
    double done_before_plan = 0.0;
    double begins = 0.0;  // s from the start of the plan to the start of the primitive's own motion
    double begins_at = 0.0;  // position of the profile at that time
    Limits limits;
  };

  double seconds(SimTime now) const { return static_cast<double>(now - start_) * 1e-6; }
  bool is_steered() const;  // turns by steering only: not on the spot
  bool moves_sideways() const;
  void set_velocity(double v, double side, double omega, SimTime now, int8_t kind);
  void hold_wheels(const WheelCommand& command, SimTime now);
  void steer_for(double v, double omega);
  void keep_wheel_rates(double& v, double& side, double& omega) const;
  Displacement way_of(double begin, double end) const;
  void brake(SimTime now);
  void take_speeds(SimTime to);
  void set_plan(const Profile& v, const Profile& omega, SimTime now, double side = 0.0);
  void plan_primitive(SimTime now);
  void replace_running();
  void show(int64_t id, int8_t kind, int8_t state, int8_t reason = 0, LinkIndex blocked_by = {});
  LinkIndex strongest() const;
  void publish_progress();
  void begin_window(SimTime now);
  void watch_for_block(SimTime now, bool touched);
  bool turns_round(double v, double side, double omega) const;
  void watch_held(SimTime now, const Vec3& made, bool touched);
  bool settled(SimTime now, const Lag& lag) const;
  // The plan for a command, or the reason why it is not possible.
  int8_t aim(const MoveCommand& command, double heading, Primitive& next) const;
  int8_t aim_on_arc(const MoveCommand& command, Primitive& next) const;
  static Limits stricter(const Limits& own, const MoveCommand& command, double fallback_speed);

  // Hot: used in each step of steady motion.
  double v_ = 0.0, omega_ = 0.0, side_ = 0.0, steering_ = 0.0;
  bool steady_ = true, resting_ = true;
  SimTime deadline_;  // of the watchdog; far in the future if it is off
  Bound<const world::DriveDescription> drive_;
  WheelKinematics kinematics_;  // converts speeds to wheel rates, as in the drive
  Limits way_limits_, angle_limits_, side_limits_;
  std::vector<Vec3> rims_;  // of mecanum and omni wheels
  // The plan.
  SimTime start_ = 0;
  Profile plan_v_, plan_omega_, plan_side_;
  SteeringPlan plan_steering_;
  double target_v_ = 0.0, target_omega_ = 0.0, target_side_ = 0.0, target_steering_ = 0.0;
  bool by_wheels_ = false;
  bool holding_ = false;  // a velocity or wheel command is active
  Primitive primitive_;
  // Detection of blocks: start of the window, a primitive's progress at that time and its highest
  // planned speed since, or what a velocity made of its highest speeds (ahead, to the left, turn),
  // and whether anything touched.
  SimTime window_start_ = 0;
  double window_done_ = 0.0, window_fastest_ = 0.0;
  Vec3 window_made_ = Vec3::Zero(), window_planned_ = Vec3::Zero();
  bool window_touched_ = false;
  std::vector<std::pair<LinkIndex, double>> window_work_;  // by resisting link, J
  MotionLog log_;
};

}  // namespace ruedo::robot
