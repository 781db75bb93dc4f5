#include "world/drives/joint_start.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/text.h"
#include "ruedo/math.h"
#include "world/read/read_context.h"

namespace ruedo::world {
namespace {

bool turns(const Joint& joint) {
  return joint.type == JointType::revolute || joint.type == JointType::continuous ||
         joint.type == JointType::screw;
}

Pose moved_by(const Joint& joint, double position) {
  Pose X;
  const Vec3& axis = joint.axis.axis_in_J;
  if (turns(joint)) X.rotation = Quat(Eigen::AngleAxisd(position, axis));
  if (joint.type == JointType::prismatic) X.translation = position * axis;
  if (joint.type == JointType::screw) X.translation = joint.advance * position * axis;
  return X;
}

}  // namespace

bool has_position(const Joint& joint) { return turns(joint) || joint.type == JointType::prismatic; }

double position_of(const Model& model, const Joint& joint, const Pose& X_MParent,
                   const Pose& X_MChild) {
  const Pose& X_MC = model.links[joint.child].X_ML;
  const Pose X_MP = joint.parent.valid() ? model.links[joint.parent].X_ML : Pose{};
  const Pose before = X_MP.inverse() * X_MC, after = X_MParent.inverse() * X_MChild;
  const Pose X_PJ = X_MP.inverse() * joint.X_MJ;
  const Pose moved = X_PJ.inverse() * after * before.inverse() * X_PJ;
  if (joint.type == JointType::prismatic) return joint.axis.axis_in_J.dot(moved.translation);
  if (!turns(joint)) return 0.0;
  return wrap_angle(
      2.0 * math::atan2(moved.rotation.vec().dot(joint.axis.axis_in_J), moved.rotation.w()));
}

namespace {

// Where each link moves to, in the model, relative to where it was.
IndexedVector<ModelLinkIndex, Pose> moves_of_links(const Model& model,
                                                   const JointPositions& positions) {
  IndexedVector<ModelLinkIndex, ModelJointIndex> carrier(model.links.size());  // of each link
  for (const ModelJointIndex j : model.joints.indices()) {
    if (model.joints[j].type != JointType::gearbox)  // a gearbox carries nothing
      carrier[model.joints[j].child] = j;
  }
  IndexedVector<ModelLinkIndex, Pose> moves(model.links.size());
  IndexedVector<ModelLinkIndex, bool> done(model.links.size());
  for (const ModelLinkIndex link : model.links.indices()) {
    std::vector<ModelLinkIndex> way;  // towards the root, as far as not done yet
    for (ModelLinkIndex at = link; at.valid() && !done[at] && carrier[at].valid();
         at = model.joints[carrier[at]].parent) {
      done[at] = true;  // ends at a loop of joints, too
      way.push_back(at);
    }
    for (; !way.empty(); way.pop_back()) {
      const ModelJointIndex j = carrier[way.back()];
      const Joint& joint = model.joints[j];
      const Pose X_parent = joint.parent.valid() ? moves[joint.parent] : Pose{};
      moves[way.back()] =
          X_parent * joint.X_MJ * moved_by(joint, positions[j]) * joint.X_MJ.inverse();
    }
  }
  return moves;
}

// Of a joint that reads 0 at the file's `position`.
void count_from(double position, size_t j, Model& model) {
  Joint& joint = model.joints[j];
  joint.axis.lower -= position;
  joint.axis.upper -= position;
  joint.axis.spring_reference -= position;
  joint.mimic_offset -= position;
  if (joint.axis.start.mode == JointStart::Mode::position) joint.axis.start.value -= position;
  for (Joint& other : model.joints) {
    if (other.leader == static_cast<int>(j)) other.mimic_reference -= position;
  }
}

}  // namespace

namespace {

// A joint cannot be beyond its limits: it would be thrown back at the first step.
void keep_in_limits(const std::string& where, const Model& model, JointPositions& positions,
                    Findings& findings) {
  constexpr double kExact = 1e-6;  // rad, m: files have few digits
  for (const ModelJointIndex j : model.joints.indices()) {
    const Joint& joint = model.joints[j];
    if (positions[j] == 0.0) continue;
    const double within = std::clamp(positions[j], joint.axis.lower, joint.axis.upper);
    if (std::abs(within - positions[j]) <= kExact) continue;
    findings.error(joint.source, where + "/joint " + joint.name,
                   "it begins at " + shown(positions[j]) + " of its file, beyond its limits of " +
                       shown(joint.axis.lower) + " to " + shown(joint.axis.upper) + "; it is " +
                       shown(within) + " instead");
    positions[j] = within;
  }
}

}  // namespace

void begin_at(const JointPositions& positions, const std::string& where, Model& model,
              Findings& findings) {
  JointPositions all = positions;
  all.resize(model.joints.size(), 0.0);
  keep_in_limits(where, model, all, findings);
  if (std::all_of(all.begin(), all.end(), [](double each) { return each == 0.0; })) return;
  const IndexedVector<ModelLinkIndex, Pose> moves = moves_of_links(model, all);
  for (const ModelLinkIndex i : model.links.indices())
    model.links[i].X_ML = moves[i] * model.links[i].X_ML;
  for (const ModelJointIndex j : model.joints.indices()) {
    Joint& joint = model.joints[j];
    if (joint.parent.valid()) joint.X_MJ = moves[joint.parent] * joint.X_MJ;
    if (all[j] == 0.0) continue;
    count_from(all[j], j, model);
    findings.repaired(joint.source, where + "/joint " + joint.name,
                      "it begins at " + shown(std::round(all[j] * 1e6) / 1e6) +
                          (joint.type == JointType::prismatic ? " m" : " rad") +
                          " of its file, and its positions count from there");
  }
}

}  // namespace ruedo::world
