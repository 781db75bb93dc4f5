// Which links move as one: the numbering of bodies, links, wheels, joints and robots that physics,
// scenes and snapshots share.
//
// Links that fixed joints tie together are one body; with the kinematic drive, the wheels belong to
// it too (their turning is an angle in the snapshot, not a body). Static models have no moving
// body.
#pragma once

#include <string>
#include <vector>

#include "world/model/world_model.h"

namespace ruedo::world {

struct LinkPlacement {
  InstanceIndex instance;
  ModelLinkIndex link;
  BodyIndex body;    // none: static, X_BL is then X_WL
  Pose X_BL;         // at wheel angle 0
  WheelIndex wheel;  // the wheel that turns the link
};

struct WheelPlacement {
  RobotIndex robot;
  ModelJointIndex joint;
  LinkIndex link;
  bool left = false;
  bool steers = false;             // it steers: its angle is about the vertical
  WheelIndex on;                   // the steering joint that it hangs on
  Vec3 rim = Vec3::UnitX();        // its rim's speed is rim . (vx, vy, omega) of base_link; not for
                                   // wheels that are steered
  Vec3 axis_in_L = Vec3::UnitY();  // unit; a positive angle about it rolls the robot ahead
  Vec3 center_in_L =
      Vec3::Zero();  // a point on the axis: the joint, which need not be the link's origin
};

struct BodyPlacement {
  InstanceIndex instance;
  ModelLinkIndex root_link;  // the body's frame is this link's frame
  std::vector<LinkIndex> links;
  Pose X_WB;         // at the start
  std::string name;  // MODEL/LINK
};

struct JointPlacement {  // joints that are neither fixed nor wheels of a drive
  InstanceIndex instance;
  ModelJointIndex joint;
  BodyIndex parent_body;  // none: the world
  BodyIndex child_body;
};

struct RobotPlacement {
  InstanceIndex instance;
  BodyIndex body;                  // that carries base_link; none for a robot that does not move
  Pose X_BBase;                    // base_link in that body (X_WBase without one)
  std::vector<WheelIndex> wheels;  // left ones first, then right, front first, then those that
                                   // steer
  std::vector<JointIndex> joints;
};

// A body in ruedo/info. Segmentation labels it with its place in that list + 1.
struct ListedBody {
  BodyIndex body;  // none: a static link
  LinkIndex link;  // of a body its first
};

struct BodyLayout {
  IndexedVector<LinkIndex, LinkPlacement> links;       // all links of all models, in world order
  IndexedVector<InstanceIndex, LinkIndex> first_link;  // of each instance
  IndexedVector<BodyIndex, BodyPlacement> bodies;      // movable ones, in world order
  IndexedVector<WheelIndex, WheelPlacement> wheels;
  IndexedVector<JointIndex, JointPlacement> joints;
  IndexedVector<RobotIndex, RobotPlacement> robots;  // instances that are robots, in world order
  std::vector<ListedBody>
      listed;  // movable bodies, then static links; of instances that were added the same

  explicit BodyLayout(const WorldModel& world);

  // Appends the world's newest instance. Everything that exists keeps its number.
  void append(const WorldModel& world);
  // A removed instance is in use again, at another place and under another name. Same model, same
  // numbers.
  void place_again(const WorldModel& world, InstanceIndex instance);

  LinkIndex link_of(InstanceIndex instance, ModelLinkIndex link) const {
    return LinkIndex(first_link[instance] + link);
  }
  // X_BL of a link, with the wheel that turns it at its angle in wheel_angles (rad, as in
  // Snapshot).
  Pose link_in_body(LinkIndex link, const IndexedVector<WheelIndex, double>& wheel_angles) const;

 private:
  struct Known;  // what was worked out for a model
  void add(const WorldModel& world, InstanceIndex instance, Known& known);
  void list(BodyIndex first_body, LinkIndex first_link);
};

// The name under which ruedo/info lists a link: its body's MODEL/LINK, or its own if it is static.
std::string body_name(const WorldModel& world, const BodyLayout& layout, LinkIndex link);

}  // namespace ruedo::world
