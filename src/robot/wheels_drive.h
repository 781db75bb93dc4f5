// The wheels drive: motorised wheels in friction contact, and the controller that a real base has
// around them.
//
// The plan of speed and turn rate (the same as the kinematic drive's) becomes wheel rates by the
// robot's own kinematics, with what it believes of its radii and track. A servo at each wheel's
// encoder follows them: torque = rate gain * (rate missing)
// + angle gain * (angle missing), within the torque limit and the motor's line from stall to no
// load. What the body does is physics. The robot knows its encoders only: primitives measure their
// way by its odometry, so what slips, it does not know. With <ruedo:yaw_gain> its gyro's heading
// takes the place of the odometry's, and a loop turns it there.
//
// Wheels that steer are held at the angles that the plan's circle asks for, each for itself; those
// with rollers grip along the axis of the roller below them only.
#pragma once

#include <optional>
#include <vector>

#include "model/base_odometry.h"
#include "robot/drive.h"

namespace ruedo::robot {

class WheelsDrive final : public Drive {
 public:
  WheelsDrive(const model::WorldModel& world, const model::BodyLayout& layout,
              physics::PhysicsWorld& physics, RobotIndex robot);

  void before_step(SimTime now) override;
  void after_step(SimTime now) override;
  void read_wheels(Snapshot& snapshot) const override;
  void wake() override;
  void take(const Drive& other) override { *this = static_cast<const WheelsDrive&>(other); }

 private:
  WheelsDrive& operator=(const WheelsDrive&) = default;
  void begin_at_rest() override;
  SideRates mean_of_sides(const std::vector<double>& of_wheels) const;
  double yaw_correction();
  void turn_wheels(const Displacement& way);
  void steer(size_t wheel, double angle);
  double rate_of(size_t wheel, const Vec3& twist, double curvature) const;
  double steering_of(size_t wheel, double curvature) const;
  Vec3 believed_way();
  void place_wheels(const model::BodyLayout& layout);
  void set_gains(double mass);
  void drive_wheel(size_t wheel, double rate);
  Lag lag() const;
  void read_wheel_rates();
  bool touches_something();
  void fall_asleep_when_still();

  struct Servo {
    double angle = 0.0;  // rad, where the wheel should be
    double rate_gain = 0.0, angle_gain = 0.0;
  };
  struct Place {
    bool left, steers, steered;  // steered: by another one
    Vec3 rim;
    double x, y;  // m, in base_link: of what steers it, where something does
  };
  std::vector<Servo> servos_;      // as wheels_
  std::vector<Place> places_;      // as wheels_
  std::vector<BodyIndex> bodies_;  // the robot's own: chassis and wheels
  double max_torque_;              // N m, each wheel
  WheelKinematics believed_;
  std::optional<model::BaseOdometry> base_;         // of what is no differential drive
  std::vector<double> last_angles_;                 // of the encoders, as wheels_
  Vec3 believed_rate_ = Vec3::Zero();               // of the base, by the encoders
  Displacement way_;                                // that the plan makes in this step
  double way_missing_ = 0.0, angle_missing_ = 0.0;  // m, rad: planned less believed
  double yaw_integral_ = 0.0;                       // rad/s
  SimTime still_us_ = 0;
  bool asleep_ = false;
};

}  // namespace ruedo::robot
