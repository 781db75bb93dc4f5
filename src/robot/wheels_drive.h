// The wheels drive: motorised wheels in friction contact, with what a real base has around them.
//
// The plan of speed and turn rate (the same as the kinematic drive's) goes to a wheel-speed controller, whose motors
// are limited in torque, and a yaw loop that turns the wheels further apart until the robot turns as planned:
// skid steering loses up to half of the turn rate in slip. Distance is controlled by the wheels' angles, as an
// encoder would see it; so what the wheels slip along the way, the robot does not know.
#pragma once

#include <vector>

#include "robot/drive.h"

namespace ruedo::robot {

class WheelsDrive final : public Drive {
 public:
  WheelsDrive(const model::WorldModel& world, const model::BodyLayout& layout, physics::PhysicsWorld& physics, int robot);

  void before_step(SimTime now) override;
  void after_step(SimTime now) override;
  void read_wheels(Snapshot& snapshot) const override;
  void wake() override;

 private:
  void begin_at_rest() override;
  double way_of_wheels() const;          // m, from the mean of the wheels' angles
  Lag lag() const;
  void read_wheel_rates();
  void fall_asleep_when_still();

  std::vector<int> bodies_;              // the robot's own: chassis and wheels
  double max_torque_;                    // N m, each wheel
  Displacement way_;                     // that the plan makes in this step
  double planned_way_ = 0.0;             // m, of the wheels
  double heading_error_ = 0.0;           // rad, planned less real
  double slip_correction_ = 0.0;         // rad/s, learned by the yaw loop
  double turned_ = 0.0;                  // rad, last step
  SimTime still_us_ = 0;
  bool asleep_ = false;
};

}  // namespace ruedo::robot
