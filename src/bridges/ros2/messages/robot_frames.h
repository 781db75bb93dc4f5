// The links of a robot as ROS has them: frames in a tree below base_link, and the URDF that says
// the same.
//
// A link's frame lies in the joint that moves it, as URDF has it; other links' where the file puts
// them. base_link is Ruedo's: on the ground, below the centre of rotation. A link or device that
// has a name of another frame is called NAME_link.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "world/model/world_model.h"

namespace ruedo::ros2 {

struct LinkFrame {
  enum class Motion { none, turn, slide, screw };

  std::string name;       // without the robot's prefix
  size_t parent = 0;      // index into RobotFrames::frames; of base_link itself 0
  ModelLinkIndex link;    // none: base_link alone
  ModelJointIndex joint;  // none: tied to its parent by none
  Pose X_PF;              // in its parent, the joint at 0
  Pose X_BF, X_MF;        // in base_link and in the model at the start
  Motion motion = Motion::none;
  Vec3 axis = Vec3::UnitZ();  // in F
  double advance = 0.0;       // m/rad, of a screw

  Pose at(double position) const;  // in its parent; rad or m
};

struct RobotFrames {
  std::vector<LinkFrame> frames;  // parents first; the first is base_link
  struct Moved {
    size_t frame;       // 0: none
    double sign = 1.0;  // of the joint's position for a wheel's angle ahead
  };
  std::vector<Moved> wheels;               // in the order of odometry_t
  std::vector<Moved> joints;               // in the order of joint_state_t
  std::vector<std::string> still;          // joints that a kinematic drive carries and nothing
                                           // turns (casters): they stay at 0
  std::map<std::string, size_t> carriers;  // by sensor: the frame that moves with it; only where
                                           // that moves in base_link
  std::string description;                 // URDF
};

// By robot.
std::map<std::string, RobotFrames> robot_frames(const world::WorldModel& world);

// URDF of these frames.
std::string urdf_of(const world::Model& model, const RobotFrames& robot);

}  // namespace ruedo::ros2
