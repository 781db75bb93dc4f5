// Which links move as one: the numbering of bodies, links, wheels, joints and robots that physics,
// scenes and snapshots share.
//
// Links that fixed joints tie together are one body; with the kinematic drive, the wheels belong to
// it too (their turning is an angle in the snapshot, not a body). Static models have no moving
// body.
#pragma once

#include <string>
#include <vector>

#include "model/world_model.h"

namespace ruedo::model {

struct LinkPlacement {
  int instance = -1;  // index into WorldModel::models
  int link = -1;      // index into Model::links
  int body = -1;      // index into BodyLayout::bodies; -1: static, X_BL is then X_WL
  Pose X_BL;          // at wheel angle 0
  int wheel = -1;     // index into BodyLayout::wheels when the link turns with that wheel
};

struct WheelPlacement {
  int robot = -1;  // index into BodyLayout::robots
  int joint = -1;  // index into Model::joints
  int link = -1;   // index into BodyLayout::links
  bool left = false;
  bool steers = false;       // its angle is that of steering, about the vertical
  int on = -1;               // index into BodyLayout::wheels: the steering joint that it hangs on
  Vec3 rim = Vec3::UnitX();  // its rim's speed is rim . (vx, vy, omega) of base_link; not for
                             // wheels that are steered
  Vec3 axis_in_L = Vec3::UnitY();  // unit; a positive angle about it rolls the robot ahead
  Vec3 center_in_L =
      Vec3::Zero();  // a point on the axis: the joint, which need not be the link's origin
};

struct BodyPlacement {
  int instance = -1;
  int root_link = -1;      // index into Model::links; the body's frame is this link's frame
  std::vector<int> links;  // indices into BodyLayout::links
  Pose X_WB;               // at the start
  std::string name;        // MODEL/LINK
};

struct JointPlacement {  // joints that are neither fixed nor wheels of a drive
  int instance = -1;
  int joint = -1;        // index into Model::joints
  int parent_body = -1;  // -1: the world
  int child_body = -1;
};

struct RobotPlacement {
  int instance = -1;
  int body = -1;            // that carries base_link; -1 for a robot that does not move
  Pose X_BBase;             // base_link in that body (X_WBase when body is -1)
  std::vector<int> wheels;  // indices into BodyLayout::wheels: left ones first, then right, front
                            // first, then those that steer
  std::vector<int> joints;  // indices into BodyLayout::joints
};

// What ruedo/info lists as a body, and pictures label with its place in that list + 1.
struct ListedBody {
  int body = -1;  // index into BodyLayout::bodies; -1: a static link
  int link = -1;  // index into BodyLayout::links; of a body its first
};

struct BodyLayout {
  std::vector<LinkPlacement> links;   // all links of all models, in world order
  std::vector<int> first_link;        // of each instance
  std::vector<BodyPlacement> bodies;  // movable ones, in world order
  std::vector<WheelPlacement> wheels;
  std::vector<JointPlacement> joints;
  std::vector<RobotPlacement> robots;  // instances that are robots, in world order
  std::vector<ListedBody>
      listed;  // movable bodies, then static links; of instances that were added the same

  explicit BodyLayout(const WorldModel& world);

  // The world has a new instance at its end. All that there was keeps its numbers.
  void append(const WorldModel& world);
  // An instance that was removed stands somewhere else now, with another name: the same model, the
  // same numbers.
  void place_again(const WorldModel& world, int instance);

  // X_BL of a link, with the wheel that turns it at its angle in wheel_angles (rad, as in
  // Snapshot).
  Pose link_in_body(int link, const std::vector<double>& wheel_angles) const;

 private:
  struct Known;  // what was worked out of models
  void add(const WorldModel& world, int instance, Known& known);
  void list(size_t first_body, size_t first_link);
};

// As ruedo/info names what a link belongs to: its body's MODEL/LINK, or its own where it is static.
std::string body_name(const WorldModel& world, const BodyLayout& layout, int link);

}  // namespace ruedo::model
