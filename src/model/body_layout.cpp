// Which links move as one. Links are joined by fixed joints, by the wheels of a kinematic drive,
// and by its passive wheels (casters): what hangs on a free joint and reaches down to the ground
// the robot stands on.
#include "model/body_layout.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "model/geometry.h"

namespace ruedo::model {
namespace {

constexpr double kGroundReach_m = 0.01;

// Groups of things that are one; the representative is the lowest number.
class Groups {
 public:
  explicit Groups(size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0); }
  int find(int i) const {
    while (parent_[static_cast<size_t>(i)] != i) i = parent_[static_cast<size_t>(i)];
    return i;
  }
  void join(int a, int b) {
    a = find(a);
    b = find(b);
    parent_[static_cast<size_t>(std::max(a, b))] = std::min(a, b);
  }

 private:
  std::vector<int> parent_;
};

bool unlimited(const Joint& joint) {
  if (joint.type == JointType::ball || joint.type == JointType::continuous ||
      joint.type == JointType::universal)
    return true;
  return joint.type == JointType::revolute && std::isinf(joint.axis.lower) &&
         std::isinf(joint.axis.upper);
}

// The links below a joint, through all further joints.
std::vector<int> subtree(const Model& model, int link) {
  std::vector<int> links{link};
  for (size_t i = 0; i < links.size(); ++i) {
    for (const Joint& joint : model.joints) {
      if (joint.parent == links[i] &&
          std::find(links.begin(), links.end(), joint.child) == links.end())
        links.push_back(joint.child);
    }
  }
  return links;
}

double lowest_point(const Model& model, const std::vector<int>& links, const Pose& X_BaseM) {
  double lowest = std::numeric_limits<double>::infinity();
  for (const int index : links) {
    const Link& link = model.links[static_cast<size_t>(index)];
    for (const Collision& c : link.collisions) {
      const Eigen::AlignedBox3d box = bounds(c.geometry);
      if (box.isEmpty()) continue;
      const Pose X = X_BaseM * link.X_ML * c.X_LC;
      for (int corner = 0; corner < 8; ++corner) {
        lowest = std::min(
            lowest, (X * box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner))).z());
      }
    }
  }
  return lowest;
}

bool is_drive_wheel(const Model& model, int joint) {
  if (!model.drive) return false;
  const auto in = [&](const std::vector<int>& list) {
    return std::find(list.begin(), list.end(), joint) != list.end();
  };
  return in(model.drive->left_joints) || in(model.drive->right_joints) ||
         in(model.drive->steer_joints);
}

// The link that a drive moves: what its wheels hang on, be it by way of what steers them.
int carrier_of(const Model& model) {
  const DriveDescription& drive = *model.drive;
  const std::vector<int>& first = !drive.steer_joints.empty()  ? drive.steer_joints
                                  : !drive.left_joints.empty() ? drive.left_joints
                                                               : drive.right_joints;
  return first.empty() ? 0 : std::max(model.joints[static_cast<size_t>(first[0])].parent, 0);
}

// What of a model moves as one, and which links turn with which of its joints: the same for all its
// instances.
struct Grouping {
  Groups links;
  std::vector<bool> joined;     // of each joint: its links are one
  std::vector<bool> is_static;  // of each group's representative
};

Grouping group(const Model& model) {
  Grouping result{Groups(model.links.size()), std::vector<bool>(model.joints.size(), false),
                  std::vector<bool>(model.links.size(), false)};
  const bool kinematic = model.drive && model.drive->kind == DriveDescription::Kind::kinematic;
  const auto join = [&](size_t j) {
    if (result.joined[j]) return;
    result.joined[j] = true;
    if (model.joints[j].parent >= 0)
      result.links.join(model.joints[j].parent, model.joints[j].child);
  };
  for (size_t j = 0; j < model.joints.size(); ++j) {
    const Joint& joint = model.joints[j];
    if (joint.type == JointType::fixed || (kinematic && is_drive_wheel(model, static_cast<int>(j))))
      join(j);
  }
  if (kinematic) {
    const Pose X_BaseM = model.drive->X_MBase.inverse();
    for (const Joint& joint : model.joints) {
      if (joint.parent < 0 || !unlimited(joint)) continue;
      const std::vector<int> below = subtree(model, joint.child);
      if (lowest_point(model, below, X_BaseM) > kGroundReach_m) continue;
      for (size_t k = 0; k < model.joints.size(); ++k) {
        if (std::find(below.begin(), below.end(), model.joints[k].child) != below.end()) join(k);
      }
    }
  }
  for (const Joint& joint : model.joints) {
    if (joint.parent < 0 && joint.type == JointType::fixed)
      result.is_static[static_cast<size_t>(result.links.find(joint.child))] = true;
  }
  return result;
}

}  // namespace

namespace {

// The rim's speed for a speed of base_link of 1 ahead, 1 to the left, and 1 rad/s. p: the wheel in
// base_link; axis: about which it turns, there.
Vec3 rim_of(const DriveDescription& drive, bool left, const Vec3& p, const Vec3& axis) {
  using Steering = DriveDescription::Steering;
  const double side = left ? -1.0 : 1.0;
  if (drive.steering == Steering::omni) {  // rollers across: only what is along its rim turns it
    const Vec3 along = axis.cross(Vec3::UnitZ()).normalized();
    return {along.x(), along.y(), p.x() * along.y() - p.y() * along.x()};
  }
  if (drive.steering == Steering::mecanum) {  // rollers at 45 degrees, whose axes meet in the
                                              // middle of the robot, seen from above
    return {1.0, p.x() * p.y() > 0 ? -1.0 : 1.0, side * 0.5 * (drive.track + drive.wheelbase)};
  }
  constexpr double kInTheMiddle_m = 1e-6;
  if (!(drive.track > 0) || std::abs(p.y()) < kInTheMiddle_m) return {1.0, 0.0, -p.y()};
  return {1.0, 0.0, side * 0.5 * drive.track};
}

}  // namespace

// Of the last models seen: fleets follow one another.
struct BodyLayout::Known {
  std::vector<std::pair<const Model*, Grouping>> groupings;

  const Grouping& of(const Model& model) {
    auto known = std::find_if(groupings.begin(), groupings.end(),
                              [&](const auto& each) { return each.first == &model; });
    if (known == groupings.end()) {
      if (groupings.size() >= 16) groupings.clear();
      groupings.emplace_back(&model, group(model));
      known = groupings.end() - 1;
    }
    return known->second;
  }
};

BodyLayout::BodyLayout(const WorldModel& world) {
  Known known;
  for (size_t i = 0; i < world.models.size(); ++i) add(world, static_cast<int>(i), known);
  list(0, 0);
}

void BodyLayout::append(const WorldModel& world) {
  Known known;
  const size_t first_body = bodies.size(), first_link = links.size();
  add(world, static_cast<int>(world.models.size()) - 1, known);
  list(first_body, first_link);
}

void BodyLayout::list(size_t first_body, size_t first_link) {
  for (size_t body = first_body; body < bodies.size(); ++body)
    listed.push_back({static_cast<int>(body), bodies[body].links.front()});
  for (size_t link = first_link; link < links.size(); ++link) {
    if (links[link].body < 0) listed.push_back({-1, static_cast<int>(link)});
  }
}

void BodyLayout::place_again(const WorldModel& world, int instance) {
  const ModelInstance& placed = world.models[static_cast<size_t>(instance)];
  const Model& model = *placed.model;
  for (LinkPlacement& link : links) {
    if (link.instance == instance && link.body < 0)
      link.X_BL = placed.X_WM * model.links[static_cast<size_t>(link.link)].X_ML;
  }
  for (BodyPlacement& body : bodies) {
    if (body.instance != instance) continue;
    const Link& root = model.links[static_cast<size_t>(body.root_link)];
    body.X_WB = placed.X_WM * root.X_ML;
    body.name = placed.name + "/" + root.name;
  }
  for (RobotPlacement& robot : robots) {
    if (robot.instance != instance || robot.body >= 0) continue;
    robot.X_BBase = placed.X_WM * (model.drive ? model.drive->X_MBase : Pose{});
  }
}

void BodyLayout::add(const WorldModel& world, int i, Known& known) {
  const ModelInstance& instance = world.models[static_cast<size_t>(i)];
  const Model& model = *instance.model;
  const int first = static_cast<int>(links.size());
  first_link.push_back(first);
  const Grouping& grouping = known.of(model);

  std::vector<int> body_of_group(model.links.size(), -1);
  for (size_t l = 0; l < model.links.size(); ++l) {
    const int root = grouping.links.find(static_cast<int>(l));
    const Pose& X_ML = model.links[l].X_ML;
    LinkPlacement link;
    link.instance = i;
    link.link = static_cast<int>(l);
    if (model.is_static || grouping.is_static[static_cast<size_t>(root)]) {
      link.X_BL = instance.X_WM * X_ML;
    } else {
      const Pose& X_MB = model.links[static_cast<size_t>(root)].X_ML;
      int& body = body_of_group[static_cast<size_t>(root)];
      if (body < 0) {
        body = static_cast<int>(bodies.size());
        bodies.push_back({i,
                          root,
                          {},
                          instance.X_WM * X_MB,
                          instance.name + "/" + model.links[static_cast<size_t>(root)].name});
      }
      link.body = body;
      link.X_BL = static_cast<int>(l) == root ? Pose{} : X_MB.inverse() * X_ML;
      bodies[static_cast<size_t>(body)].links.push_back(first + static_cast<int>(l));
    }
    links.push_back(link);
  }

  const int robot = instance.is_robot() ? static_cast<int>(robots.size()) : -1;
  RobotPlacement placement;
  placement.instance = i;
  if (robot >= 0) {
    int carrier = 0;
    Pose X_MBase;
    if (model.drive) {
      carrier = carrier_of(model);
      X_MBase = model.drive->X_MBase;
    }
    const LinkPlacement& link = links[static_cast<size_t>(first + carrier)];
    placement.body = link.body;
    placement.X_BBase =
        link.X_BL * model.links[static_cast<size_t>(carrier)].X_ML.inverse() * X_MBase;
  }
  if (model.drive) {
    const bool kinematic = model.drive->kind == DriveDescription::Kind::kinematic;
    const Pose X_BaseM = model.drive->X_MBase.inverse();
    const Vec3 left_M = model.drive->X_MBase.rotation * Vec3::UnitY();
    const auto add_wheel = [&](int j, bool left, bool steers) {
      const Joint& joint = model.joints[static_cast<size_t>(j)];
      const Pose X_LM = model.links[static_cast<size_t>(joint.child)].X_ML.inverse();
      WheelPlacement wheel;
      wheel.robot = robot;
      wheel.joint = j;
      wheel.link = first + joint.child;
      wheel.left = left;
      wheel.steers = steers;
      Vec3 axis_M = joint.X_MJ.rotation * joint.axis.axis_in_J;
      if (steers
              ? axis_M.z() < 0
              : model.drive->steering != DriveDescription::Steering::omni && axis_M.dot(left_M) < 0)
        axis_M = -axis_M;
      wheel.rim =
          rim_of(*model.drive, left, X_BaseM * joint.X_MJ.translation, X_BaseM.rotation * axis_M);
      wheel.axis_in_L = (X_LM.rotation * axis_M).normalized();
      wheel.center_in_L = X_LM * joint.X_MJ.translation;
      const int index = static_cast<int>(wheels.size());
      for (const int below : subtree(model, joint.child)) {
        int& turned_by = links[static_cast<size_t>(first + below)].wheel;
        if (kinematic && turned_by < 0) {
          turned_by = index;
          continue;
        }
        for (const int other : placement.wheels) {  // that hangs on this one
          if (wheels[static_cast<size_t>(other)].link == first + below)
            wheels[static_cast<size_t>(other)].on = index;
        }
      }
      placement.wheels.push_back(index);
      wheels.push_back(wheel);
    };
    for (const int j : model.drive->left_joints) add_wheel(j, true, false);
    for (const int j : model.drive->right_joints) add_wheel(j, false, false);
    for (const int j : model.drive->steer_joints) add_wheel(j, false, true);
  }
  if (!model.is_static) {
    for (size_t j = 0; j < model.joints.size(); ++j) {
      const Joint& joint = model.joints[j];
      if (grouping.joined[j] || is_drive_wheel(model, static_cast<int>(j))) continue;
      const auto body = [&](int link) {
        return link < 0 ? -1 : links[static_cast<size_t>(first + link)].body;
      };
      const int parent = body(joint.parent), child = body(joint.child);
      if (parent == child) continue;  // both static, or joined another way
      placement.joints.push_back(static_cast<int>(joints.size()));
      joints.push_back({i, static_cast<int>(j), parent, child});
    }
  }
  if (robot >= 0) robots.push_back(std::move(placement));
}

std::string body_name(const WorldModel& world, const BodyLayout& layout, int link) {
  if (link < 0) return "";
  const LinkPlacement& placement = layout.links[static_cast<size_t>(link)];
  if (placement.body >= 0) return layout.bodies[static_cast<size_t>(placement.body)].name;
  const ModelInstance& instance = world.models[static_cast<size_t>(placement.instance)];
  return instance.name + "/" + instance.model->links[static_cast<size_t>(placement.link)].name;
}

}  // namespace ruedo::model
