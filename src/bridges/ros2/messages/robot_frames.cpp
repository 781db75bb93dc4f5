#include "bridges/ros2/messages/robot_frames.h"

#include <algorithm>
#include <set>

#include "bridges/ros2/messages/names.h"
#include "world/model/body_layout.h"

namespace ruedo::ros2 {
namespace {

using world::Joint;
using world::JointType;
using Motion = LinkFrame::Motion;

Motion motion_of(JointType type) {
  switch (type) {
    case JointType::revolute:
    case JointType::continuous: return Motion::turn;
    case JointType::prismatic: return Motion::slide;
    case JointType::screw: return Motion::screw;
    default: return Motion::none;  // joints without one position stay where they are at the start
  }
}

// From the links that base_link sits on, along the joints, in whichever direction.
class Tree {
 public:
  Tree(const world::WorldModel& world, const world::BodyLayout& layout,
       const world::RobotPlacement& robot)
      : instance_(world.models[robot.instance]),
        model_(*instance_.model),
        layout_(layout),
        robot_(robot),
        frame_of_link_(model_.links.size()),
        seen_(model_.links.size()),
        moves_(model_.joints.size()) {
    for (const JointIndex j : robot.joints) moves_[layout.joints[j].joint] = true;
    for (const WheelIndex w : robot.wheels) moves_[layout.wheels[w].joint] = true;
    reserve_names();
    add_base();
    for (const ModelLinkIndex link : model_.links.indices()) {
      if (!seen_[link] && is_carrier(link)) add(link, 0, {}, false);
    }
    list_moved();
  }

  RobotFrames result() && {
    result_.description = urdf_of(model_, result_);
    return std::move(result_);
  }

 private:
  const world::LinkPlacement& placement(ModelLinkIndex link) const {
    return layout_.links[layout_.link_of(robot_.instance, link)];
  }
  // Moves as base_link does, though no joint ties it to that.
  bool is_carrier(ModelLinkIndex link) const {
    if (placement(link).body != robot_.body) return false;
    return std::none_of(model_.joints.begin(), model_.joints.end(), [&](const Joint& joint) {
      return joint.child == link && joint.parent.valid() && joint.type != JointType::gearbox &&
             placement(joint.parent).body == robot_.body;
    });
  }

  void reserve_names() {
    names_ = {"base_link", "odom", "map", "world"};
    for (const world::SensorDescription& sensor : model_.sensors) {
      const std::string name = ros_name(sensor.name);
      names_.insert({name, name + "_optical"});
    }
  }
  std::string unique(const std::string& wanted) {
    std::string name = ros_name(wanted);
    while (!names_.insert(name).second) name += "_link";
    return name;
  }

  void add_base() {
    LinkFrame base;
    base.name = "base_link";
    base.X_MF = model_.drive ? model_.drive->X_MBase : Pose{};
    result_.frames.push_back(base);
  }

  // A link that is called base_link and lies there is that frame.
  bool is_base(ModelLinkIndex link, const Pose& X_BF) const {
    constexpr double kNear = 1e-6;
    return model_.links[link].name == "base_link" && !result_.frames[0].link.valid() &&
           X_BF.translation.norm() < kNear &&
           X_BF.rotation.angularDistance(Quat::Identity()) < kNear;
  }

  void add(ModelLinkIndex link, size_t parent, ModelJointIndex joint, bool backwards) {
    seen_[link] = true;
    LinkFrame frame;
    frame.link = link;
    frame.joint = joint;
    frame.parent = parent;
    frame.X_MF = model_.links[link].X_ML;
    if (joint.valid()) move(frame, model_.joints[joint], backwards);
    const Pose X_MBase = result_.frames[0].X_MF;
    frame.X_BF = X_MBase.inverse() * frame.X_MF;
    frame.X_PF = result_.frames[parent].X_MF.inverse() * frame.X_MF;
    if (parent == 0 && frame.motion == Motion::none && is_base(link, frame.X_BF)) {
      result_.frames[0].link = frame.link;
      frame_of_link_[link] = 0;
    } else {
      frame.name = unique(model_.links[link].name);
      frame_of_link_[link] = result_.frames.size();
      result_.frames.push_back(std::move(frame));
    }
    add_neighbours(link);
  }

  void move(LinkFrame& frame, const Joint& joint, bool backwards) const {
    if (!moves_[frame.joint]) return;
    frame.motion = motion_of(joint.type);
    if (frame.motion == Motion::none) return;
    frame.X_MF = joint.X_MJ;
    frame.axis = backwards ? Vec3(-joint.axis.axis_in_J) : joint.axis.axis_in_J;
    frame.advance = joint.advance;
  }

  void add_neighbours(ModelLinkIndex link) {
    for (const ModelJointIndex j : model_.joints.indices()) {
      const Joint& joint = model_.joints[j];
      if (!joint.parent.valid() || joint.type == JointType::gearbox)
        continue;  // others carry its links
      const ModelLinkIndex parent = joint.parent, child = joint.child;
      if (parent == link && !seen_[child])
        add(child, frame_of_link_[link], j, false);
      else if (child == link && !seen_[parent])
        add(parent, frame_of_link_[link], j, true);
    }
  }

  size_t frame_of_joint(ModelJointIndex joint) const {
    const auto found = std::find_if(result_.frames.begin(), result_.frames.end(),
                                    [&](const LinkFrame& frame) { return frame.joint == joint; });
    return found == result_.frames.end() || found->motion == Motion::none
               ? 0
               : static_cast<size_t>(found - result_.frames.begin());
  }

  void list_moved() {
    for (const WheelIndex w : robot_.wheels) {
      const world::WheelPlacement& wheel = layout_.wheels[w];
      const Joint& joint = model_.joints[wheel.joint];
      const Pose X_LM = model_.links[joint.child].X_ML.inverse();
      const Vec3 axis_in_L = X_LM.rotation * (joint.X_MJ.rotation * joint.axis.axis_in_J);
      result_.wheels.push_back(
          {frame_of_joint(wheel.joint), axis_in_L.dot(wheel.axis_in_L) < 0 ? -1.0 : 1.0});
    }
    for (const JointIndex j : robot_.joints)
      result_.joints.push_back({frame_of_joint(layout_.joints[j].joint)});
    for (const ModelJointIndex j : model_.joints.indices()) {
      const Joint& joint = model_.joints[j];
      if (!moves_[j] && joint.parent.valid() && motion_of(joint.type) != Motion::none)
        result_.still.push_back(joint.name);
    }
    for (const world::SensorDescription& sensor : model_.sensors) {
      const size_t frame = frame_of_link_[sensor.link];
      for (size_t each = frame; each != 0; each = result_.frames[each].parent) {
        if (result_.frames[each].motion != Motion::none) result_.carriers[sensor.name] = frame;
      }
    }
  }

  const world::ModelInstance& instance_;
  const world::Model& model_;
  const world::BodyLayout& layout_;
  const world::RobotPlacement& robot_;
  RobotFrames result_;
  IndexedVector<ModelLinkIndex, size_t> frame_of_link_;
  IndexedVector<ModelLinkIndex, bool> seen_;
  IndexedVector<ModelJointIndex, bool> moves_;
  std::set<std::string> names_;
};

}  // namespace

Pose LinkFrame::at(double position) const {
  Pose moved;
  if (motion == Motion::turn || motion == Motion::screw)
    moved.rotation = Quat(Eigen::AngleAxisd(position, axis));
  if (motion == Motion::slide) moved.translation = position * axis;
  if (motion == Motion::screw) moved.translation = position * advance * axis;
  return X_PF * moved;
}

std::map<std::string, RobotFrames> robot_frames(const world::WorldModel& world) {
  const world::BodyLayout layout(world);
  std::map<std::string, RobotFrames> robots;
  for (const world::RobotPlacement& robot : layout.robots) {
    const world::ModelInstance& instance = world.models[robot.instance];
    if (!instance.removed) robots[instance.name] = Tree(world, layout, robot).result();
  }
  return robots;
}

}  // namespace ruedo::ros2
