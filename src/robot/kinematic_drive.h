// The kinematic drive: base_link follows the closed form of the plan; Bullet decides only what
// contacts change.
//
// On a level plane the robot moves in x, y and yaw, and has no contact with the plane. Where wheels
// touch anything else from above (a ramp, a step, a box, a lift, another robot), or on no plane, it
// has six degrees of freedom: a servo gives it the velocities in its own plane, relative to what
// carries it; gravity along that plane is held by the drive, and where only the support was
// touched, height, roll and pitch are Bullet's and the rest is the plan's, so that nothing creeps.
// Where no drive wheel stands on anything it is a body like others. Against other contacts the
// servo pushes with the drive's max_force at most, and with <ruedo:traction> no harder than
// friction under the wheels allows: on contacts always, so that a slope can be too steep; on a
// level plane only against what it touches.
#pragma once

#include <memory>
#include <vector>

#include "robot/drive.h"
#include "robot/wheel_angles.h"
#include "ruedo/bound.h"
#include "ruedo/drive.h"
#include "world/model/ground.h"

namespace ruedo::robot {

class KinematicDrive final : public Drive {
 public:
  // planes: heights of the world's level planes; must outlive the drive.
  KinematicDrive(const world::WorldModel& world, const world::BodyLayout& layout,
                 physics::PhysicsWorld& physics, RobotIndex robot,
                 const std::vector<world::LevelPlane>& planes);

  void before_step(SimTime now) override;
  void after_step(SimTime now) override;
  void read_wheels(Snapshot& snapshot) const override;
  void wake() override;
  void copy_from(const Drive& other) override;
  void exchange(StateArchive& archive) override;
  void ground_changed() override;

 private:
  KinematicDrive& operator=(const KinematicDrive&) = default;
  void begin_at_rest() override;
  const std::string& robot_name() const;
  void make_model();
  Displacement follow_model(SimTime now);
  double side() const { return model_ ? made_.left : planner_.side(); }
  bool is_still() const;
  void stand_on_near_plane();
  void choose_support();
  void stand_on_plane(const world::LevelPlane& plane);
  void leave_plane();
  void before_on_plane();
  void before_on_contacts();
  void after_on_plane(SimTime now);
  void after_on_contacts(SimTime now);
  PlaneMotion of_wheels() const;
  void finish(SimTime now, double way, double angle, bool touched, double side);
  void fall_asleep_when_still(bool still);
  // Changes `twist` (of base_link, expressed in it) towards the plan's mean velocities in the
  // plane, relative to the supporting body, as far as `force` (N) allows after compensating
  // `gravity` (m/s^2, in base_link) along the plane. Returns whether it got there.
  bool servo(Twist& twist, double force, const Vec3& gravity);
  bool is_support(const Contact& contact, const Vec3& up) const;
  bool on_wheel(const Contact& contact) const;
  bool is_belt(LinkIndex link) const;
  bool is_own(const Contact& contact) const;  // contact with another part of the robot
  bool flipper_stands(const Vec3& up) const;
  bool is_alone() const;
  template <class Visit>
  void for_each_contact(Visit visit) const;
  double friction(const Contact& contact) const;
  double grip_on_plane() const;
  void look_at_support();
  void push_back(const Vec3& impulse);
  double plane_gap(double height) const { return X_WBase_.translation.z() + lowest_ - height; }

  bool on_plane_ = false, asleep_ = false;
  bool touched_ = false;      // by other things than its support, in the last step
  bool held_ = false;         // ... and in the step before
  bool behind_ = false;       // the servo did not reach the planned velocities
  Vec3 sent_ = Vec3::Zero();  // the servo's last command: m/s forward, m/s to the left, rad/s
  bool supported_ = false;    // on contacts: wheels stand on something
  double grip_ = 0.0;         // on contacts: N, friction force available under the wheels
  Twist carrier_{
      Vec3::Zero(),
      // velocity of the supporting body, at base_link and expressed in it; zero: it does not move
      Vec3::Zero()};
  std::vector<Contact> carriers_;  // contacts of the wheels with movable things
  double plane_friction_ = 1.0;    // of the plane below
  Displacement way_, planned_;     // the wheels' motion in this step, and the planned one
  // A plugin's drive; null: the base moves as planned.
  struct Model : std::unique_ptr<DriveModel> {
    using std::unique_ptr<DriveModel>::operator=;
    Model() = default;
    Model& operator=(const Model&) { return *this; }  // copied separately, in copy_from()
  } model_;
  BaseVelocity made_;     // the plugin drive's last output
  Lag lag_;               // of the plugin drive's output, behind the plan
  double heading_ = 0.0;  // of base_link on a plane, rad
  WheelAngles wheel_angles_;
  SimTime still_us_ = 0;
  Pose next_;  // base_link after this step, on a plane
  Bound<const std::vector<world::LevelPlane>> planes_;
  Bound<const world::WorldModel> world_;
  Bound<const world::BodyLayout> layout_;
  double lowest_;  // of the wheels, below base_link
  double wheel_friction_;
  bool wheels_touch_;                // whether they have shapes
  bool belts_touch_;                 // likewise for a tracked vehicle's belts
  std::vector<BodyIndex> flippers_;  // belts carried by joints
  double mass_, yaw_inertia_, lever_, max_force_;
  Vec3 gravity_;
};

}  // namespace ruedo::robot
