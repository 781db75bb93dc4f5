#include "physics/joints/joint_frames.h"

namespace ruedo::physics {

namespace {

// The frames of a slider or fixed joint.
struct FramesAt {
  FramesAt(const btTypedConstraint& constraint, const btTransform& in_a, const btTransform& in_b) {
    A = constraint.getRigidBodyA().getCenterOfMassTransform() * in_a;
    B = constraint.getRigidBodyB().getCenterOfMassTransform() * in_b;
  }
  Vec3 apart() const { return from_bt(B.getOrigin() - A.getOrigin()); }
  Vec3 askew() const {
    btVector3 sum(0, 0, 0);
    for (int i = 0; i < 3; ++i) sum += A.getBasis().getColumn(i).cross(B.getBasis().getColumn(i));
    return 0.5 * from_bt(sum);
  }
  btTransform A, B;
};

FramesAt frames_of(btTypedConstraint& constraint, JointWays::Kind kind) {
  if (kind == JointWays::Kind::slider) {
    auto& slider = static_cast<btSliderConstraint&>(constraint);
    return {slider, slider.getFrameOffsetA(), slider.getFrameOffsetB()};
  }
  if (kind == JointWays::Kind::ball) {
    auto& ball = static_cast<btPoint2PointConstraint&>(constraint);
    const btMatrix3x3& same = btMatrix3x3::getIdentity();
    return {ball, btTransform(same, ball.getPivotInA()), btTransform(same, ball.getPivotInB())};
  }
  auto& fixed = static_cast<btGeneric6DofSpring2Constraint&>(constraint);
  return {fixed, fixed.getFrameOffsetA(), fixed.getFrameOffsetB()};
}

JointWays::Kind kind_of(const btTypedConstraint& constraint) {
  using Kind = JointWays::Kind;
  switch (constraint.getConstraintType()) {
    case HINGE_CONSTRAINT_TYPE: {
      const auto& hinge = static_cast<const btHingeConstraint&>(constraint);
      return hinge.getLowerLimit() == hinge.getUpperLimit() ? Kind::other : Kind::hinge;
    }
    case SLIDER_CONSTRAINT_TYPE: {
      auto& slider =
          const_cast<btSliderConstraint&>(static_cast<const btSliderConstraint&>(constraint));
      const bool turns = slider.getLowerAngLimit() != slider.getUpperAngLimit();
      const bool fixed = slider.getLowerLinLimit() == slider.getUpperLinLimit();
      return turns || fixed ? Kind::other : Kind::slider;
    }
    case POINT2POINT_CONSTRAINT_TYPE: return Kind::ball;
    case D6_SPRING_2_CONSTRAINT_TYPE: return Kind::fixed;  // no other joint has this type
    default: return Kind::other;
  }
}

}  // namespace

JointWays ways_of(btTypedConstraint& constraint) {
  JointWays ways;
  ways.kind = kind_of(constraint);
  if (ways.kind == JointWays::Kind::other) return ways;
  if (ways.kind == JointWays::Kind::hinge) {
    const HingeAt at(static_cast<btHingeConstraint&>(constraint));
    ways.axis = at.axis;
    ways.anchor = at.arm_b + from_bt(constraint.getRigidBodyB().getCenterOfMassPosition());
    return ways;
  }
  const FramesAt at = frames_of(constraint, ways.kind);
  ways.anchor = from_bt(at.B.getOrigin());
  if (ways.kind == JointWays::Kind::slider) ways.axis = from_bt(at.A.getBasis().getColumn(0));
  return ways;
}

std::pair<Vec3, Vec3> errors_of(JointWays::Kind kind, btTypedConstraint& constraint) {
  if (kind == JointWays::Kind::hinge) {
    const HingeAt at(static_cast<btHingeConstraint&>(constraint));
    return {at.apart, at.askew};
  }
  const FramesAt at = frames_of(constraint, kind);
  Vec3 apart = at.apart();
  if (kind == JointWays::Kind::ball) return {apart, Vec3::Zero()};
  if (kind == JointWays::Kind::slider) {
    const Vec3 axis = from_bt(at.A.getBasis().getColumn(0));
    apart -= axis * axis.dot(apart);
  }
  return {apart, at.askew()};
}

std::optional<int> stop_of(btTypedConstraint& constraint) {
  constexpr int kOfAHinge = 5, kOfASlider = 4;
  if (constraint.getConstraintType() == HINGE_CONSTRAINT_TYPE) {
    auto& hinge = static_cast<btHingeConstraint&>(constraint);
    if (!hinge.hasLimit()) return std::nullopt;
    hinge.testLimit(hinge.getRigidBodyA().getCenterOfMassTransform(),
                    hinge.getRigidBodyB().getCenterOfMassTransform());
    return hinge.getSolveLimit() ? std::optional(kOfAHinge) : std::nullopt;
  }
  if (constraint.getConstraintType() == SLIDER_CONSTRAINT_TYPE) {
    auto& slider = static_cast<btSliderConstraint&>(constraint);
    btTypedConstraint::btConstraintInfo1 size;
    slider.getInfo1(&size);
    return slider.getSolveLinLimit() ? std::optional(kOfASlider) : std::nullopt;
  }
  return std::nullopt;
}

}  // namespace ruedo::physics
