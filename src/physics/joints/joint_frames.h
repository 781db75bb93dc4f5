// Where the frames of Bullet's constraints are: the degrees of freedom and errors of joints.
#pragma once

#include <optional>
#include <utility>

#include "physics/base/bullet.h"
#include "physics/joints/joint_tree.h"

namespace ruedo::physics {

// The frames of a hinge.
struct HingeAt {
  explicit HingeAt(btHingeConstraint& hinge) {
    const btTransform &A = hinge.getRigidBodyA().getCenterOfMassTransform(),
                      &B = hinge.getRigidBodyB().getCenterOfMassTransform();
    const btTransform &in_a = hinge.getAFrame(), &in_b = hinge.getBFrame();
    arm_a = from_bt(A.getBasis() * in_a.getOrigin());
    arm_b = from_bt(B.getBasis() * in_b.getOrigin());
    apart = from_bt(B.getOrigin() - A.getOrigin()) + arm_b - arm_a;
    first = from_bt(A.getBasis() * in_a.getBasis().getColumn(0));
    second = from_bt(A.getBasis() * in_a.getBasis().getColumn(1));
    axis = from_bt(A.getBasis() * in_a.getBasis().getColumn(2));
    askew = axis.cross(from_bt(B.getBasis() * in_b.getBasis().getColumn(2)));
  }
  // The errors that the five rows correct, in m and rad.
  double error(int row) const {
    return row < 3 ? apart[row] : row == 3 ? askew.dot(first) : askew.dot(second);
  }
  Vec3 arm_a, arm_b, apart;  // from the centres of mass to the anchors, and from A's anchor to B's
  Vec3 axis, first, second;  // A's axis, and two vectors perpendicular to it
  Vec3 askew;                // rotation from A's axis to B's
};

JointWays ways_of(btTypedConstraint& constraint);

// The position error of the bodies in m and rad.
std::pair<Vec3, Vec3> errors_of(JointWays::Kind kind, btTypedConstraint& constraint);

// Bullet's row for the stop that the joint is at.
std::optional<int> stop_of(btTypedConstraint& constraint);

}  // namespace ruedo::physics
