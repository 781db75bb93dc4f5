// The kinematic drive: base_link follows the closed form of the plan; Bullet decides only what contacts change.
//
// On a level plane the robot moves in x, y and yaw, and has no contact with the plane. Where wheels touch anything
// else from above (a ramp, a step, a box), or on no plane, it has six degrees of freedom: a servo gives it the
// velocities in its own plane, gravity along that plane is held by the drive, and where only the support was
// touched, height, roll and pitch are Bullet's and the rest is the plan's, so that nothing creeps. In the air it
// falls. Against other contacts the servo pushes with the drive's max_force at most.
#pragma once

#include <vector>

#include "robot/drive.h"
#include "robot/wheel_angles.h"

namespace ruedo::robot {

class KinematicDrive final : public Drive {
 public:
  // planes: heights of the world's level planes; must outlive the drive.
  KinematicDrive(const model::WorldModel& world, const model::BodyLayout& layout, physics::PhysicsWorld& physics,
                 int robot, const std::vector<double>& planes);

  void before_step(SimTime now) override;
  void after_step(SimTime now) override;
  void read_wheels(Snapshot& snapshot) const override;
  void wake() override;
  void ground_changed() override;

 private:
  void begin_at_rest() override;
  void stand_on_near_plane();
  void choose_support();
  void stand_on_plane(double height);
  void leave_plane();
  void before_on_plane();
  void before_on_contacts();
  void after_on_plane(SimTime now);
  void after_on_contacts(SimTime now);
  void fall_asleep_when_still(bool still);
  // Brings `twist` (of base_link, in it) to the plan's mean velocities in the plane, as far as the force allows
  // when `bounded`. Returns whether it got there.
  bool servo(Twist& twist, bool bounded);
  bool is_support(const Contact& contact, const Vec3& up) const;
  double plane_gap(double height) const { return X_WBase_.translation.z() + lowest_ - height; }

  bool on_plane_ = false, asleep_ = false;
  bool touched_ = false;         // by more than the support, in the last step
  bool held_ = false;            // ... and in the step before
  bool behind_ = false;          // the servo did not reach the plan's velocities
  Vec3 sent_ = Vec3::Zero();     // what the servo gave last: m/s ahead, m/s to the left, rad/s
  bool supported_ = false;       // on contacts: wheels stand on something
  Displacement way_;             // that the plan makes in this step
  double heading_ = 0.0;         // of base_link on a plane, rad
  WheelAngles wheel_angles_;
  SimTime still_us_ = 0;
  Pose next_;                    // of base_link after this step, on a plane
  const std::vector<double>& planes_;
  const double lowest_;          // of the wheels below base_link
  const double mass_, yaw_inertia_, lever_, max_force_;
  const Vec3 gravity_;
};

}  // namespace ruedo::robot
