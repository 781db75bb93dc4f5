// The wheels drive: motorised wheels in friction contact, and the controller that a real base has
// around them.
//
// The plan of speed and turn rate (the same as for the kinematic drive) is converted to wheel rates
// with the geometry that the robot believes it has. A servo on each wheel's encoder follows them:
// torque = rate gain * (rate error) + angle gain * (angle error), within the torque limit and the
// motor's torque-speed line. Physics moves the body. The robot knows its encoders only:
// primitives measure distance by its odometry and do not notice slip. With <ruedo:yaw_gain>, its
// gyro's heading replaces the odometry's, and a control loop turns the robot back to it.
//
// Steered wheels are held at the angles that the planned circle requires, each individually; wheels
// with rollers grip only along the axis of the roller below them.
#pragma once

#include <optional>
#include <vector>

#include "robot/drive.h"
#include "world/model/base_odometry.h"
#include "world/model/ground.h"

namespace ruedo::robot {

class WheelsDrive final : public Drive {
 public:
  WheelsDrive(const world::WorldModel& world, const world::BodyLayout& layout,
              physics::PhysicsWorld& physics, RobotIndex robot,
              const std::vector<world::LevelPlane>& planes);

  void before_step(SimTime now) override;
  void after_step(SimTime now) override;
  void read_wheels(Snapshot& snapshot) const override;
  void wake() override;
  void copy_from(const Drive& other) override { *this = static_cast<const WheelsDrive&>(other); }
  void exchange(StateArchive& archive) override;

 private:
  WheelsDrive& operator=(const WheelsDrive&) = default;
  void begin_at_rest() override;
  void leave_the_ground();
  void stand_still();
  SideRates mean_of_sides(const std::vector<double>& of_wheels) const;
  double yaw_correction();
  void turn_wheels(const Displacement& way);
  void steer(size_t wheel, double angle);
  double rate_of(size_t wheel, const Vec3& twist, double curvature) const;
  double steering_of(size_t wheel, double curvature) const;
  Vec3 believed_way();
  void place_wheels(const world::BodyLayout& layout);
  void set_gains(double mass);
  void drive_wheel(size_t wheel, double rate);
  Lag lag() const;
  void read_wheel_rates();
  bool touches_something();
  void fall_asleep_when_still();

  struct Servo {
    double angle = 0.0;  // rad, target angle of the wheel
    double rate_gain = 0.0, angle_gain = 0.0;
  };
  struct Place {
    bool left, steers, steered;  // steered: carried by a steering joint
    Vec3 rim;
    double x, y;  // m, in base_link: of its steering joint, if there is one
  };
  std::vector<Servo> servos_;      // as wheels_
  std::vector<Place> places_;      // as wheels_
  std::vector<BodyIndex> bodies_;  // its own: chassis, suspension and wheels
  Bound<const std::vector<world::LevelPlane>> planes_;
  std::vector<BodyIndex> all_bodies_;  // of its model
  double lowest_;                      // of the wheels, below base_link
  double max_torque_;                  // N m, each wheel
  WheelKinematics believed_;
  std::optional<world::BaseOdometry> base_;         // for drives other than differential ones
  std::vector<double> last_angles_;                 // of the encoders, as in wheels_
  Vec3 believed_rate_ = Vec3::Zero();               // of the base, by the encoders
  Displacement way_;                                // planned for this step
  double way_missing_ = 0.0, angle_missing_ = 0.0;  // m, rad: planned minus estimated
  double yaw_integral_ = 0.0;                       // rad/s
  SimTime still_us_ = 0;
  bool asleep_ = false;
};

}  // namespace ruedo::robot
