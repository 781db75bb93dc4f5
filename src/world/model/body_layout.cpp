// Which links move as one body. Links are merged by fixed joints, by the wheels of a kinematic
// drive and their suspension, and by its passive wheels (casters): links on a free joint that reach
// down to the ground.
#include "world/model/body_layout.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "world/model/bounds.h"

namespace ruedo::world {
namespace {

constexpr double kGroundReach_m = 0.01;

// Disjoint sets; the representative of a set is its lowest number.
class Groups {
 public:
  explicit Groups(size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0); }
  int find(int i) const {
    while (parent_[i] != i) i = parent_[i];
    return i;
  }
  void join(int a, int b) {
    a = find(a);
    b = find(b);
    parent_[std::max(a, b)] = std::min(a, b);
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
std::vector<ModelLinkIndex> subtree(const Model& model, ModelLinkIndex link) {
  std::vector<ModelLinkIndex> links{link};
  for (size_t i = 0; i < links.size(); ++i) {
    for (const Joint& joint : model.joints) {
      if (joint.parent == links[i] &&
          std::find(links.begin(), links.end(), joint.child) == links.end())
        links.push_back(joint.child);
    }
  }
  return links;
}

double lowest_point(const Model& model, const std::vector<ModelLinkIndex>& links,
                    const Pose& X_BaseM) {
  double lowest = std::numeric_limits<double>::infinity();
  for (const ModelLinkIndex index : links) {
    const Link& link = model.links[index];
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

bool is_drive_wheel(const Model& model, ModelJointIndex joint) {
  if (!model.drive) return false;
  const auto in = [&](const std::vector<ModelJointIndex>& list) {
    return std::find(list.begin(), list.end(), joint) != list.end();
  };
  return in(model.drive->left_joints) || in(model.drive->right_joints) ||
         in(model.drive->steer_joints);
}

// The links of a model that move as one body, and those that turn with its joints. The same for
// all instances of the model.
struct Grouping {
  Groups links;
  IndexedVector<ModelJointIndex, bool> joined;  // its links are one
  std::vector<bool> is_static;                  // of each group's representative
  ModelLinkIndex carrier{0};                    // the link that its drive moves
};

ModelJointIndex joint_above(const Model& model, ModelLinkIndex link) {
  for (const ModelJointIndex j : model.joints.indices()) {
    if (model.joints[j].child == link && model.joints[j].parent.valid()) return j;
  }
  return {};
}

// The joints from a link up to what moves as one with the carrier; none if that is not above it.
std::vector<ModelJointIndex> way_up(const Model& model, const Groups& links, ModelLinkIndex from,
                                    ModelLinkIndex carrier) {
  std::vector<ModelJointIndex> way;
  while (links.find(from) != links.find(carrier)) {
    const ModelJointIndex above = joint_above(model, from);
    if (!above.valid() || way.size() > model.joints.size()) return {};
    way.push_back(above);
    from = model.joints[above].parent;
  }
  return way;
}

// The links that carry the wheels and the joints that steer them, each perhaps on a suspension.
std::vector<ModelLinkIndex> holders_of(const Model& model) {
  std::vector<ModelLinkIndex> holders;
  for (const auto* joints :
       {&model.drive->steer_joints, &model.drive->left_joints, &model.drive->right_joints}) {
    for (const ModelJointIndex joint : *joints) {
      if (model.joints[joint].parent.valid()) holders.push_back(model.joints[joint].parent);
    }
  }
  return holders;
}

// The link that a drive moves: the parent of its first wheel, or of the first joint that steers,
// or what is further up and carries them all.
ModelLinkIndex carrier_of(const Model& model, const Groups& links) {
  const std::vector<ModelLinkIndex> holders = holders_of(model);
  if (holders.empty()) return ModelLinkIndex(0);
  const auto carries_all = [&](ModelLinkIndex link) {
    return std::all_of(holders.begin(), holders.end(), [&](ModelLinkIndex each) {
      return links.find(each) == links.find(link) || !way_up(model, links, each, link).empty();
    });
  };
  ModelLinkIndex carrier = holders[0];
  for (size_t steps = 0; steps <= model.joints.size() && !carries_all(carrier); ++steps) {
    const ModelJointIndex above = joint_above(model, carrier);
    if (!above.valid()) return holders[0];
    carrier = model.joints[above].parent;
  }
  return carrier;
}

Grouping group(const Model& model) {
  Grouping result{Groups(model.links.size()),
                  {std::vector<bool>(model.joints.size(), false)},
                  std::vector<bool>(model.links.size(), false)};
  const bool kinematic = model.drive && model.drive->kind == DriveDescription::Kind::kinematic;
  const auto join = [&](ModelJointIndex j) {
    if (result.joined[j]) return;
    result.joined[j] = true;
    if (model.joints[j].parent.valid())
      result.links.join(model.joints[j].parent, model.joints[j].child);
  };
  for (const ModelJointIndex j : model.joints.indices()) {
    if (model.joints[j].type == JointType::fixed || (kinematic && is_drive_wheel(model, j)))
      join(j);
  }
  if (kinematic) {
    const Pose X_BaseM = model.drive->X_MBase.inverse();
    for (const Joint& joint : model.joints) {
      if (!joint.parent.valid() || !unlimited(joint)) continue;
      const std::vector<ModelLinkIndex> below = subtree(model, joint.child);
      if (lowest_point(model, below, X_BaseM) > kGroundReach_m) continue;
      for (const ModelJointIndex k : model.joints.indices()) {
        if (std::find(below.begin(), below.end(), model.joints[k].child) != below.end()) join(k);
      }
    }
  }
  if (model.drive) {
    result.carrier = carrier_of(model, result.links);
    if (kinematic) {  // it moves as a whole: its suspension is rigid
      for (const ModelLinkIndex each : holders_of(model)) {
        for (const ModelJointIndex j : way_up(model, result.links, each, result.carrier)) join(j);
      }
    }
  }
  for (const Joint& joint : model.joints) {
    if (!joint.parent.valid() && joint.type == JointType::fixed)
      result.is_static[result.links.find(joint.child)] = true;
  }
  return result;
}

}  // namespace

namespace {

// The rim speed for a base_link velocity of 1 m/s forward, 1 m/s to the left and 1 rad/s. p: the
// wheel's position in base_link; axis: its axis of rotation, in base_link.
Vec3 rim_of(const DriveDescription& drive, bool left, const Vec3& p, const Vec3& axis) {
  using Steering = DriveDescription::Steering;
  const double side = left ? -1.0 : 1.0;
  // rollers lie across: only motion along the rim turns the wheel
  if (drive.steering == Steering::omni) {
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

// Cache of the last models seen: the robots of a fleet follow one another.
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
  for (const InstanceIndex i : world.models.indices()) add(world, i, known);
  list(BodyIndex(0), LinkIndex(0));
}

void BodyLayout::append(const WorldModel& world) {
  Known known;
  const BodyIndex first_body = bodies.next();
  const LinkIndex first_new_link = links.next();
  add(world, InstanceIndex(world.models.size() - 1), known);
  list(first_body, first_new_link);
}

void BodyLayout::list(BodyIndex first_body, LinkIndex first_link) {
  for (BodyIndex body = first_body; bodies.has(body); ++body)
    listed.push_back({body, bodies[body].links.front()});
  for (LinkIndex link = first_link; links.has(link); ++link) {
    if (!links[link].body.valid()) listed.push_back({{}, link});
  }
}

void BodyLayout::place_again(const WorldModel& world, InstanceIndex instance) {
  const ModelInstance& placed = world.models[instance];
  const Model& model = *placed.model;
  for (LinkPlacement& link : links) {
    if (link.instance == instance && !link.body.valid())
      link.X_BL = placed.X_WM * model.links[link.link].X_ML;
  }
  for (BodyPlacement& body : bodies) {
    if (body.instance != instance) continue;
    const Link& root = model.links[body.root_link];
    body.X_WB = placed.X_WM * root.X_ML;
    body.name = placed.name + "/" + root.name;
  }
  for (RobotPlacement& robot : robots) {
    if (robot.instance != instance || robot.body.valid()) continue;
    robot.X_BBase = placed.X_WM * (model.drive ? model.drive->X_MBase : Pose{});
  }
}

namespace {

void add_links(BodyLayout& layout, const ModelInstance& instance, InstanceIndex i,
               const Grouping& grouping) {
  const Model& model = *instance.model;
  IndexedVector<ModelLinkIndex, BodyIndex> body_of_group(model.links.size());
  for (const ModelLinkIndex l : model.links.indices()) {
    const ModelLinkIndex root(grouping.links.find(l));
    const Pose& X_ML = model.links[l].X_ML;
    LinkPlacement link;
    link.instance = i;
    link.link = l;
    if (model.is_static || grouping.is_static[root]) {
      link.X_BL = instance.X_WM * X_ML;
    } else {
      const Pose& X_MB = model.links[root].X_ML;
      BodyIndex& body = body_of_group[root];
      if (!body.valid()) {
        body = layout.bodies.next();
        layout.bodies.push_back(
            {i, root, {}, instance.X_WM * X_MB, instance.name + "/" + model.links[root].name});
      }
      link.body = body;
      link.X_BL = l == root ? Pose{} : X_MB.inverse() * X_ML;
      layout.bodies[body].links.push_back(layout.links.next());
    }
    layout.links.push_back(link);
  }
}

enum class Side { left, right, steers };

void add_wheel(BodyLayout& layout, const Model& model, RobotIndex robot, RobotPlacement& placement,
               ModelJointIndex j, Side side) {
  const DriveDescription& drive = *model.drive;
  const InstanceIndex i = placement.instance;
  const Joint& joint = model.joints[j];
  const Pose X_LM = model.links[joint.child].X_ML.inverse(), X_BaseM = drive.X_MBase.inverse();
  WheelPlacement wheel;
  wheel.robot = robot;
  wheel.joint = j;
  wheel.link = layout.link_of(i, joint.child);
  wheel.steers = side == Side::steers;
  wheel.left = wheel.steers ? (X_BaseM * joint.X_MJ.translation).y() > 0.0 : side == Side::left;
  Vec3 axis_M = joint.X_MJ.rotation * joint.axis.axis_in_J;
  const Vec3 left_M = drive.X_MBase.rotation * Vec3::UnitY();
  if (wheel.steers ? axis_M.z() < 0
                   : drive.steering != DriveDescription::Steering::omni && axis_M.dot(left_M) < 0)
    axis_M = -axis_M;
  wheel.rim =
      rim_of(drive, wheel.left, X_BaseM * joint.X_MJ.translation, X_BaseM.rotation * axis_M);
  wheel.axis_in_L = (X_LM.rotation * axis_M).normalized();
  wheel.center_in_L = X_LM * joint.X_MJ.translation;
  const WheelIndex index = layout.wheels.next();
  for (const ModelLinkIndex below : subtree(model, joint.child)) {
    WheelIndex& turned_by = layout.links[layout.link_of(i, below)].wheel;
    if (drive.kind == DriveDescription::Kind::kinematic && !turned_by.valid()) {
      turned_by = index;
      continue;
    }
    for (const WheelIndex other : placement.wheels) {  // the wheels that hang on this one
      if (layout.wheels[other].link == layout.link_of(i, below)) layout.wheels[other].on = index;
    }
  }
  placement.wheels.push_back(index);
  layout.wheels.push_back(wheel);
}

void add_joints(BodyLayout& layout, const Model& model, const Grouping& grouping,
                RobotPlacement& placement) {
  const InstanceIndex i = placement.instance;
  for (const ModelJointIndex j : model.joints.indices()) {
    const Joint& joint = model.joints[j];
    if (grouping.joined[j] || is_drive_wheel(model, j)) continue;
    const auto body = [&](ModelLinkIndex link) {
      return link.valid() ? layout.links[layout.link_of(i, link)].body : BodyIndex();
    };
    const BodyIndex parent = body(joint.parent), child = body(joint.child);
    if (parent == child) continue;  // both static, or merged in another way
    placement.joints.push_back(layout.joints.next());
    layout.joints.push_back({i, j, parent, child});
  }
}

}  // namespace

void BodyLayout::add(const WorldModel& world, InstanceIndex i, Known& known) {
  const ModelInstance& instance = world.models[i];
  const Model& model = *instance.model;
  const Grouping& grouping = known.of(model);
  first_link.push_back(links.next());
  add_links(*this, instance, i, grouping);
  RobotPlacement robot;
  robot.instance = i;
  if (instance.is_robot()) {
    const ModelLinkIndex carrier = grouping.carrier;
    const Pose X_MBase = model.drive ? model.drive->X_MBase : Pose();
    const LinkPlacement& link = links[link_of(i, carrier)];
    robot.body = link.body;
    robot.X_BBase = link.X_BL * model.links[carrier].X_ML.inverse() * X_MBase;
  }
  if (model.drive) {
    const RobotIndex index = instance.is_robot() ? robots.next() : RobotIndex();
    const DriveDescription& drive = *model.drive;
    for (const ModelJointIndex j : drive.left_joints)
      add_wheel(*this, model, index, robot, j, Side::left);
    for (const ModelJointIndex j : drive.right_joints)
      add_wheel(*this, model, index, robot, j, Side::right);
    for (const ModelJointIndex j : drive.steer_joints)
      add_wheel(*this, model, index, robot, j, Side::steers);
  }
  if (!model.is_static) add_joints(*this, model, grouping, robot);
  if (instance.is_robot()) robots.push_back(std::move(robot));
}

std::string body_name(const WorldModel& world, const BodyLayout& layout, LinkIndex link) {
  if (!link.valid()) return "";
  const LinkPlacement& placement = layout.links[link];
  if (placement.body.valid()) return layout.bodies[placement.body].name;
  const ModelInstance& instance = world.models[placement.instance];
  return instance.name + "/" + instance.model->links[placement.link].name;
}

}  // namespace ruedo::world
