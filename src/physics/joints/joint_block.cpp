// Converts Bullet's constraints to rows and solves them directly.
//
// For a row with bounds (a motor's maximum torque, a stop) it is not known in advance whether it is
// at one. All motors start among the rows that are solved directly; one that exceeds its bounds is
// relaxed iteratively with the others of that kind for the rest of the substep. In a tree such a
// motor gives its maximum, and holds again where that is too much; a stop holds while it is pushed.
// Motors and stops are exchanged between the sets of those that hold and the others until none is
// wrong (principal pivoting; K. Murty, "Note on a Bard-type scheme for solving the complementarity
// problem", 1974).
#include "physics/joints/joint_block.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

namespace ruedo::physics {

namespace {

// relative to the diagonal: loops of joints contain redundant rows
constexpr double kRegular = 1e-10;
constexpr double kIndependent = 1e-6;  // part of a row's response that is independent of the others
constexpr size_t kMostRows = 8;        // of one Bullet constraint
constexpr size_t kRowsOfAHinge = 5;
constexpr size_t kSkip = 12;  // numbers in a row's Jacobian

Vec3 vector_at(const btScalar* v) { return {v[0], v[1], v[2]}; }

// A universal joint's rows have a target of their own, independent of the error reduction.
bool says_more(const btTypedConstraint& constraint) {
  return constraint.getConstraintType() == D6_CONSTRAINT_TYPE ||
         constraint.getConstraintType() == D6_SPRING_CONSTRAINT_TYPE ||
         constraint.getConstraintType() == D6_SPRING_2_CONSTRAINT_TYPE ||
         constraint.getConstraintType() == FIXED_CONSTRAINT_TYPE;
}

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

// The position error of the bodies in m and rad.
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

// Bullet's row for the stop that the joint is at.
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

bool moves(const SolverBody& body) { return body.inverse_mass != Vec3::Zero(); }

bool is_stop(const Row& row) { return row.lower == 0.0 || row.upper == 0.0; }

}  // namespace

// The rows of a constraint, as Bullet gives them.
struct JointBlocks::Values {
  std::array<btScalar, kSkip * kMostRows> jacobian{}, error{}, softness{}, lower{}, upper{};
};

void JointBlocks::clear() {
  rows_.clear();
  way_of_row_.clear();
  damper_of_row_.clear();
  thirds_.clear();
  third_of_row_.clear();
  joints_.clear();
  block_count_ = 0;
}

// Returns the number of rows. `reduction` is the part of the joint's error that the rows' target
// velocities correct in a substep.
int JointBlocks::ask(btTypedConstraint& constraint, double reduction, double substep_s,
                     Values& values) {
  btTypedConstraint::btConstraintInfo1 size;
  constraint.buildJacobian();
  constraint.getInfo1(&size);
  if (size.m_numConstraintRows <= 0) return 0;
  values = {};
  values.lower.fill(-BT_LARGE_FLOAT);
  values.upper.fill(BT_LARGE_FLOAT);
  btTypedConstraint::btConstraintInfo2 info;
  info.fps = 1.0 / substep_s;
  info.erp = reduction;
  info.m_J1linearAxis = values.jacobian.data();
  info.m_J1angularAxis = values.jacobian.data() + 3;
  info.m_J2linearAxis = values.jacobian.data() + 6;
  info.m_J2angularAxis = values.jacobian.data() + 9;
  info.rowskip = kSkip;
  info.m_constraintError = values.error.data();
  info.cfm = values.softness.data();
  info.m_lowerLimit = values.lower.data();
  info.m_upperLimit = values.upper.data();
  info.m_numIterations = 1;
  info.m_damping = 1.0;
  constraint.getInfo2(&info);
  return size.m_numConstraintRows;
}

const JointBlocks::Third* JointBlocks::third_of(size_t row) const {
  if (row >= third_of_row_.size() || third_of_row_[row] == kNoThird) return nullptr;
  return &thirds_[third_of_row_[row]];
}

double JointBlocks::coupling(size_t i, size_t j) const {
  const Row &one = rows_[i], &other = rows_[j];
  double sum = one.coupling(other);
  if (thirds_.empty()) return sum;
  const Third *of_one = third_of(i), *of_other = third_of(j);
  if (of_one) {
    const int body = of_one->body;
    if (other.a == body) sum += of_one->angular.dot(other.turns_a);
    if (other.b == body) sum += of_one->angular.dot(other.turns_b);
    if (of_other && of_other->body == body) sum += of_one->angular.dot(of_other->turns);
  }
  if (of_other) {
    if (one.a == of_other->body) sum += one.angular_a.dot(of_other->turns);
    if (one.b == of_other->body) sum += one.angular_b.dot(of_other->turns);
  }
  return sum;
}

double JointBlocks::coupling(size_t i, const Row& other) const {
  double sum = rows_[i].coupling(other);
  if (const Third* third = third_of(i)) {
    if (other.a == third->body) sum += third->angular.dot(other.turns_a);
    if (other.b == third->body) sum += third->angular.dot(other.turns_b);
  }
  return sum;
}

double JointBlocks::velocity(size_t i, const SolverBodies& bodies) const {
  const Third* third = third_of(i);
  return rows_[i].velocity(bodies) + (third ? third->angular.dot(bodies[third->body].w) : 0.0);
}

double JointBlocks::push_velocity(size_t i, const SolverBodies& bodies) const {
  const Third* third = third_of(i);
  return rows_[i].push_velocity(bodies) +
         (third ? third->angular.dot(bodies[third->body].push_w) : 0.0);
}

void JointBlocks::give(size_t i, SolverBodies& bodies, double more) {
  rows_[i].give(bodies, more);
  if (const Third* third = third_of(i)) bodies[third->body].w += third->turns * more;
}

void JointBlocks::give_push(size_t i, SolverBodies& bodies, double more) {
  rows_[i].give_push(bodies, more);
  if (const Third* third = third_of(i)) bodies[third->body].push_w += third->turns * more;
}

double JointBlocks::relax(size_t i, SolverBodies& bodies) {
  Row& row = rows_[i];
  if (!third_of(i)) return row.relax(bodies);
  const double more = (row.target - velocity(i, bodies) - row.softness * row.impulse) * row.inverse;
  give(i, bodies, more);
  return std::abs(more) * row.response;
}

void JointBlocks::add(btTypedConstraint& constraint, int a, int b, int reference) {
  Joint& joint = joints_.emplace_back();
  joint.constraint = &constraint;
  joint.a = a;
  joint.b = b;
  joint.reference = reference;
  joint.ways = ways_of(constraint);
  joint.stop = stop_of(constraint);
}

void JointBlocks::add_rows(Joint& joint, const SolverBodies& bodies, double substep_s) {
  Block& block = blocks_[joint.block];
  auto* motors = static_cast<JointMotors*>(joint.constraint->getUserConstraintPtr());
  joint.first = rows_.size();
  joint.hinge = !block.is_tree && !joint.stop && add_hinge(*joint.constraint, joint, bodies);
  if (!joint.hinge) add_asked(*joint.constraint, joint, bodies, substep_s);
  const size_t first_motor = rows_.size();
  size_t damper = 0;
  if (motors) {
    if (motors->first.on) add_motor(motors->first, joint, joint.reference, bodies);
    if (motors->damper.on) {
      damper = rows_.size();
      add_motor(motors->damper, joint, joint.reference, bodies);
    }
    if (motors->second.on) add_motor(motors->second, joint, joint.reference, bodies);
    if (motors->second_damper.on) add_motor(motors->second_damper, joint, joint.reference, bodies);
  }
  joint.count = rows_.size() - joint.first;
  way_of_row_.resize(rows_.size(), JointTree::kNone);
  bool led = false;  // a tree can prescribe one degree of freedom only once
  Stop* stop = nullptr;
  if (block.is_tree && joint.stop && joint.way != JointTree::kNone) {
    const Row& row = rows_[joint.first];
    if (row.inverse > 0.0 && row.softness == 0.0 && is_stop(row)) {
      stop = &block.stops.emplace_back();
      stop->row = joint.first;
      stop->way = joint.way;
      stop->sign = (row.linear_b + row.angular_b).dot(joint.ways.axis) < 0.0 ? -1.0 : 1.0;
    }
  }
  for (size_t i = joint.first; i < rows_.size(); ++i) {
    const Row& row = rows_[i];
    if (row.inverse == 0.0 || (stop && i == stop->row)) continue;
    const bool of_tree = block.is_tree && i >= first_motor;
    if (of_tree) way_of_row_[i] = joint.way;
    if (of_tree && led && i == damper) {
      damper_of_row_.resize(rows_.size());
      damper_of_row_[first_motor] = damper;
      continue;
    }
    const bool direct = !is_stop(row) && row.upper > 0.0 && row.lower < 0.0 && !(of_tree && led) &&
                        (block.is_tree || block.free.size() < kMostRowsAtOnce);
    if (stop && of_tree && direct)
      stop->motor = i;
    else
      (direct ? block.free : block.bounded).push_back(i);
    led |= of_tree && direct;
  }
}

Row& JointBlocks::add_row(const Joint& joint) {
  Row& row = rows_.emplace_back();
  row.a = joint.a;
  row.b = joint.b;
  return row;
}

// Anchor to anchor and axis to axis, as Bullet does. Returns false if Bullet has to provide the
// rows: for other joints, and for a hinge at a stop.
bool JointBlocks::add_hinge(btTypedConstraint& constraint, Joint& joint,
                            const SolverBodies& bodies) {
  if (constraint.getConstraintType() != HINGE_CONSTRAINT_TYPE) return false;
  const HingeAt at(static_cast<btHingeConstraint&>(constraint));
  for (int i = 0; i < 3; ++i) {
    Row& row = add_row(joint);
    row.linear_a = Vec3::Unit(i);
    row.linear_b = -row.linear_a;
    row.angular_a = at.arm_a.cross(row.linear_a);
    row.angular_b = -at.arm_b.cross(row.linear_a);
  }
  for (const Vec3* square : {&at.first, &at.second}) {
    Row& row = add_row(joint);
    row.angular_a = *square;
    row.angular_b = -*square;
  }
  for (size_t i = joint.first; i < rows_.size(); ++i) {
    rows_[i].lower = -BT_LARGE_FLOAT;
    rows_[i].upper = BT_LARGE_FLOAT;
    rows_[i].prepare(bodies);
  }
  return true;
}

void JointBlocks::add_asked(btTypedConstraint& constraint, Joint& joint, const SolverBodies& bodies,
                            double substep_s) {
  const bool in_tree = blocks_[joint.block].is_tree;
  if (in_tree && !joint.stop) return;
  Values values;
  const int n = ask(constraint, 0.0, substep_s, values);
  joint.errors_only = !says_more(constraint);
  for (int i = in_tree ? *joint.stop : 0; i < (in_tree ? *joint.stop + 1 : n); ++i) {
    const size_t at = static_cast<size_t>(i) * kSkip;
    joint.errors_only = joint.errors_only && values.error[at] == 0.0;
    Row& row = add_row(joint);
    row.linear_a = vector_at(&values.jacobian[at]);
    row.angular_a = vector_at(&values.jacobian[at + 3]);
    row.linear_b = vector_at(&values.jacobian[at + 6]);
    row.angular_b = vector_at(&values.jacobian[at + 9]);
    row.softness = values.softness[at];
    row.target = values.error[at];
    row.lower = values.lower[at];
    row.upper = values.upper[at];
    row.prepare(bodies);
  }
}

// Positive when the child, body b, moves relative to the parent.
void JointBlocks::add_motor(JointMotor& motor, Joint& joint, int reference,
                            const SolverBodies& bodies) {
  Row row;
  row.a = joint.a;
  row.b = joint.b;
  const auto arm = [&](int body) {
    const btRigidBody* bullet = bodies[body].bullet;
    return bullet ? Vec3(motor.anchor - from_bt(bullet->getCenterOfMassPosition()))
                  : Vec3(Vec3::Zero());
  };
  if (motor.linear) {
    row.linear_a = -motor.axis;
    row.angular_a = motor.advance * motor.axis - arm(joint.a).cross(motor.axis);
    row.linear_b = motor.axis;
    row.angular_b = arm(joint.b).cross(motor.axis) - motor.advance * motor.axis;
  } else if (motor.reference) {
    row.angular_a = motor.parent_axis;
    row.angular_b = motor.axis;
  } else {
    row.angular_a = -motor.axis;
    row.angular_b = motor.axis;
  }
  row.softness = motor.softness;
  row.target = motor.rate;
  row.lower = motor.lower;
  row.upper = motor.upper;
  row.prepare(bodies);
  joint.motors[joint.motor_count++] = &motor;
  rows_.push_back(row);
  if (motor.reference && reference > 0) add_third(motor, reference, bodies);
}

// For the last row: the reference bears the remaining moment of parent and child.
void JointBlocks::add_third(const JointMotor& motor, int reference, const SolverBodies& bodies) {
  Third third;
  third.row = rows_.size() - 1;
  third.body = reference;
  third.angular = -motor.axis - motor.parent_axis;
  third.turns = bodies[reference].inverse_inertia * third.angular;
  third_of_row_.resize(rows_.size(), kNoThird);
  third_of_row_.back() = thirds_.size();
  thirds_.push_back(third);
  Row& row = rows_.back();
  row.response = coupling(third.row, third.row);
  row.inverse = row.response > 1e-12 ? 1.0 / (row.response + row.softness) : 0.0;
}

size_t JointBlocks::root(size_t body) {
  while (parents_[body] != body) body = parents_[body] = parents_[parents_[body]];
  return body;
}

void JointBlocks::prepare(const SolverBodies& bodies, double substep_s) {
  if (joints_.empty()) return;
  closing_per_s_ = 1.0 / substep_s;
  unite(bodies);
  find_blocks(bodies);
  for (size_t b = 0; b < block_count_; ++b) blocks_[b].is_tree = make_tree(blocks_[b], bodies);
  for (Joint& joint : joints_) add_rows(joint, bodies, substep_s);
}

void JointBlocks::unite(const SolverBodies& bodies) {
  parents_.resize(bodies.size());
  std::iota(parents_.begin(), parents_.end(), size_t{0});
  const auto together = [&](int one, int other) {
    if (!moves(bodies[one]) || !moves(bodies[other])) return;
    const size_t a = root(static_cast<size_t>(one)), b = root(static_cast<size_t>(other));
    parents_[std::max(a, b)] = std::min(a, b);
  };
  for (const Joint& joint : joints_) {
    together(joint.a, joint.b);
    together(joint.reference, joint.a);
    together(joint.reference, joint.b);
  }
}

void JointBlocks::find_blocks(const SolverBodies& bodies) {
  block_of_root_.assign(bodies.size(), JointTree::kNone);
  joint_of_body_.assign(bodies.size(), JointTree::kNone);
  for (size_t j = 0; j < joints_.size(); ++j) {
    Joint& joint = joints_[j];
    const int body = moves(bodies[joint.a]) ? joint.a : joint.b;
    size_t& block = block_of_root_[root(static_cast<size_t>(body))];
    if (block == JointTree::kNone) {
      block = block_count_++;
      if (blocks_.size() < block_count_) blocks_.emplace_back();
      for (auto* list : {&blocks_[block].joints, &blocks_[block].free, &blocks_[block].bounded})
        list->clear();
      blocks_[block].spent.clear();
      blocks_[block].stops.clear();
      blocks_[block].bodies = blocks_[block].hung = 0;
      blocks_[block].factored = false;
    }
    joint.block = block;
    blocks_[block].joints.push_back(j);
    blocks_[block].hung += !moves(bodies[joint.a]) || !moves(bodies[joint.b]);
  }
  for (size_t j = joints_.size(); j-- > 0;) {  // reversed, so that a body's first joint comes first
    Joint& joint = joints_[j];
    joint.next_of_a = std::exchange(joint_of_body_[joint.a], j);
    joint.next_of_b = std::exchange(joint_of_body_[joint.b], j);
  }
  for (size_t i = 1; i < bodies.size(); ++i) {
    if (!moves(bodies[i]) || joint_of_body_[i] == JointTree::kNone) continue;
    ++blocks_[block_of_root_[root(i)]].bodies;
  }
}

bool JointBlocks::make_tree(Block& block, const SolverBodies& bodies) {
  const bool hangs = block.hung == 1;
  if (block.hung > 1 || block.joints.size() + !hangs != block.bodies) return false;
  const auto known = [this](size_t j) {
    return joints_[j].ways.kind != JointWays::Kind::other && joints_[j].reference == 0;
  };
  if (!std::all_of(block.joints.begin(), block.joints.end(), known)) return false;
  const auto on_ground = [&](size_t j) {
    return !moves(bodies[joints_[j].a]) || !moves(bodies[joints_[j].b]);
  };
  const size_t first =
      hangs ? *std::find_if(block.joints.begin(), block.joints.end(), on_ground) : block.joints[0];
  Joint& joint = joints_[first];
  if (!hangs) {
    const int body = joint.a;
    block.tree.begin(from_bt(bodies[body].bullet->getCenterOfMassPosition()));
    return block.tree.add_root(body, bodies) && grow(block, body, bodies);
  }
  const bool b = moves(bodies[joint.b]);
  block.tree.begin(joint.ways.anchor);
  const int body = b ? joint.b : joint.a;
  if (!block.tree.add(body, b ? joint.a : joint.b, b, joint.ways, bodies)) return false;
  joint.way = block.tree.only_way();
  return grow(block, body, bodies);
}

// From the root, body by body.
bool JointBlocks::grow(Block& block, int root, const SolverBodies& bodies) {
  grown_.assign(1, root);
  for (size_t i = 0; i < grown_.size(); ++i) {
    const int on = grown_[i];
    for (size_t j = joint_of_body_[on]; j != JointTree::kNone;) {
      Joint& joint = joints_[j];
      const bool b = joint.a == on;
      const int body = b ? joint.b : joint.a;
      j = b ? joint.next_of_a : joint.next_of_b;
      if (!moves(bodies[body]) || block.tree.has(body)) continue;
      if (!block.tree.add(body, on, b, joint.ways, bodies)) return false;
      joint.way = block.tree.only_way();
      grown_.push_back(body);
    }
  }
  return true;
}

// The joints of a chain are consecutive, and each is coupled to its neighbours only: the matrix is
// banded, and so is its Cholesky factor.
void JointBlocks::find_envelope(Block& block) {
  constexpr size_t kNone = static_cast<size_t>(-1);
  const size_t n = block.free.size();
  block.begin.resize(n);
  for (const size_t i : block.free) {
    for_each_body(i, [&](int body) {
      if (first_of_body_.size() <= static_cast<size_t>(body))
        first_of_body_.resize(static_cast<size_t>(body) + 1);
      first_of_body_[body] = kNone;
    });
  }
  for (size_t i = 0; i < n; ++i) {
    block.begin[i] = i;
    for_each_body(block.free[i], [&](int body) {
      if (body == 0) return;  // immovable
      size_t& first = first_of_body_[body];
      if (first == kNone) first = i;
      block.begin[i] = std::min(block.begin[i], first);
    });
  }
  block.end.resize(n);
  std::iota(block.end.begin(), block.end.end(), size_t{0});
  for (size_t i = 0; i < n; ++i) block.end[block.begin[i]] = i;
  for (size_t j = 1; j < n; ++j) block.end[j] = std::max(block.end[j], block.end[j - 1]);
}

void JointBlocks::write_matrix(Block& block) {
  const size_t n = block.free.size();
  block.factor.resize(n * n);
  for (size_t j = 0; j < n; ++j) {
    double* of_j = &block.factor[j * n];
    const Row& row = rows_[block.free[j]];
    of_j[j] = row.response * (1.0 + kRegular) + row.softness;
    for (size_t i = j + 1; i <= block.end[j]; ++i)
      of_j[i] = block.begin[i] > j ? 0.0
                : thirds_.empty()  ? row.coupling(rows_[block.free[i]])
                                   : coupling(block.free[i], block.free[j]);
  }
}

void JointBlocks::factor(Block& block) {
  block.factored = true;
  if (!block.is_tree) return factor_matrix(block);
  block.tree.let_go();
  for (const size_t i : block.free) block.tree.lead(way_of_row_[i], softness_of(i));
  for (const Spent& spent : block.spent)
    if (const Row* damper = damper_of(spent.row))
      block.tree.lead(way_of_row_[spent.row], damper->softness);
  for (const Stop& stop : block.stops)
    if (stop.holds) block.tree.lead(stop.way, 0.0);
  block.tree.factor();
}

// Right-looking: each pivot is subtracted at once from the rows it reaches, so that no sum waits
// for another.
void JointBlocks::factor_matrix(Block& block) {
  find_envelope(block);
  write_matrix(block);
  const size_t n = block.free.size();
  block.inverse.resize(n);
  block.exact = true;
  for (size_t j = 0; j < n; ++j) {
    double* of_j = &block.factor[j * n];
    const double response = rows_[block.free[j]].response;
    block.exact = block.exact && of_j[j] > kIndependent * response;
    of_j[j] = std::max(of_j[j], 1e-300 + kRegular * response);
    block.inverse[j] = 1.0 / of_j[j];
    const size_t end = block.end[j];
    for (size_t i = j + 1; i <= end; ++i) {
      if (of_j[i] == 0.0) continue;
      const double part = of_j[i] * block.inverse[j];
      double* of_i = &block.factor[i * n];
      for (size_t k = i; k <= end; ++k) of_i[k] -= part * of_j[k];
    }
  }
}

void JointBlocks::solve_lower(const Block& block, double* x) const {
  const size_t n = block.free.size();
  for (size_t j = 0; j < n; ++j) {
    const double* of_j = &block.factor[j * n];
    const double part = x[j] * block.inverse[j];
    for (size_t i = j + 1; i <= block.end[j]; ++i) x[i] -= part * of_j[i];
  }
}

// From velocity errors of the rows to impulses.
void JointBlocks::solve(Block& block, std::vector<double>& x) const {
  const size_t n = block.free.size();
  if (block.is_tree) {
    for (size_t i = 0; i < n; ++i) block.tree.aim(way_of_row_[block.free[i]], x[i]);
    block.tree.solve();
    for (size_t i = 0; i < n; ++i) x[i] = block.tree.impulse(way_of_row_[block.free[i]]);
    return;
  }
  solve_lower(block, x.data());
  for (size_t j = n; j-- > 0;) {
    const double* of_j = &block.factor[j * n];
    double sum = x[j];
    // from the last column, whose x is the newest
    for (size_t i = block.end[j]; i > j; --i) sum -= of_j[i] * x[i];
    x[j] = sum * block.inverse[j];
  }
}

bool JointBlocks::only_trees() const {
  return std::all_of(blocks_.begin(), blocks_.begin() + static_cast<std::ptrdiff_t>(block_count_),
                     [](const Block& block) { return block.is_tree; });
}

bool JointBlocks::exact() const {
  return std::all_of(blocks_.begin(), blocks_.begin() + static_cast<std::ptrdiff_t>(block_count_),
                     [](const Block& block) { return block.exact && block.bounded.empty(); });
}

// x_: the velocity errors of the rows. Returns the largest.
double JointBlocks::aim(Block& block, const SolverBodies& bodies) {
  double worst = 0.0;
  x_.resize(block.free.size());
  for (size_t i = 0; i < x_.size(); ++i) {
    const Row& row = rows_[block.free[i]];
    x_[i] = row.target - velocity(block.free[i], bodies) - row.softness * row.impulse;
    worst = std::max(worst, std::abs(x_[i]));
  }
  return worst;
}

// Of a motor in a tree and the damper beside it, which add up like springs side by side.
double JointBlocks::softness_of(size_t motor) const {
  const double alone = rows_[motor].softness;
  const Row* damper = damper_of(motor);
  return damper && alone > 0.0 ? 1.0 / (1.0 / alone + 1.0 / damper->softness) : alone;
}

// The rate error of a motor that holds, with the damper beside it.
double JointBlocks::missing(const Block& block, size_t motor) const {
  const Row& row = rows_[motor];
  const double rate = block.tree.rate(way_of_row_[motor]);
  const Row* damper = damper_of(motor);
  if (!damper || row.softness == 0.0) return row.target - rate - row.softness * row.impulse;
  return softness_of(motor) * (row.target / row.softness - row.impulse - damper->impulse) - rate;
}

// After a solution: how much more impulse the damper beside a motor gives.
double JointBlocks::damper_gives(const Block& block, size_t motor) const {
  const Row* damper = damper_of(motor);
  if (!damper) return 0.0;
  return -block.tree.rate_after(way_of_row_[motor]) / damper->softness - damper->impulse;
}

// Motors that hold get their rate error; those at a bound get what they can give, and their dampers
// what the rate makes of them.
double JointBlocks::aim_motors(Block& block) {
  double worst = 0.0;
  x_.resize(block.free.size());
  for (size_t i = 0; i < x_.size(); ++i) {
    x_[i] = missing(block, block.free[i]);
    worst = std::max(worst, std::abs(x_[i]));
  }
  for (const Spent& spent : block.spent) {
    const Row& row = rows_[spent.row];
    const size_t way = way_of_row_[spent.row];
    const double more = bound_of(spent) - row.impulse;
    worst = std::max(worst, std::abs(more) * row.response);
    const Row* damper = damper_of(spent.row);
    if (!damper) {
      block.tree.push(way, more);
      continue;
    }
    const double error = damper->softness * (more - damper->impulse) - block.tree.rate(way);
    block.tree.aim(way, error);
    worst = std::max(worst, std::abs(error));
  }
  aim_stops(block, worst);
  return worst;
}

// Stops that hold get the error of their rate; of others the impulse ends, which the motor beside
// them has taken over if there is one.
void JointBlocks::aim_stops(Block& block, double& worst) const {
  for (const Stop& stop : block.stops) {
    const Row& row = rows_[stop.row];
    if (stop.holds) {
      const double missing = stop.sign * row.target - block.tree.rate(stop.way);
      block.tree.aim(stop.way, missing);
      worst = std::max(worst, std::abs(missing));
    } else if (stop.motor == JointTree::kNone) {
      block.tree.push(stop.way, -stop.sign * row.impulse);
      worst = std::max(worst, std::abs(row.impulse) * row.response);
    }
  }
}

// After a solution, of a stop that holds: what its motor gives at that rate, and the stop the rest.
// A motor that moves against the stop gives its maximum, but one without any only what is needed.
JointBlocks::Shares JointBlocks::shares_of(const Block& block, const Stop& stop) const {
  constexpr double kNoMaximum = 0.9e9;  // N m or N
  constexpr double kSame = 1e-9;        // rad/s, m/s
  const Row& row = rows_[stop.row];
  const double rate = stop.sign * row.target;
  double whole = stop.sign * row.impulse + block.tree.impulse(stop.way);
  Shares shares;
  if (stop.motor != JointTree::kNone) {
    const Row& motor = rows_[stop.motor];
    whole += motor.impulse;
    if (const Row* damper = damper_of(stop.motor)) {
      shares.damper = -rate / damper->softness;
      whole += damper->impulse - shares.damper;
    }
    double low = motor.lower, high = motor.upper;
    if (motor.softness > 0.0)
      low = high = std::clamp((motor.target - rate) / motor.softness, low, high);
    else if (rate < motor.target - kSame)
      low = high * closing_per_s_ < kNoMaximum ? high : 0.0;
    else if (rate > motor.target + kSame)
      high = low * closing_per_s_ > -kNoMaximum ? low : 0.0;
    shares.motor = std::clamp(whole, low, high);
    whole -= shares.motor;
  }
  shares.stop = stop.sign * whole;
  return shares;
}

// After a solution: releases stops that pull, and lets those hold that a joint passes, at most so
// many of them. Returns how many there were.
size_t JointBlocks::choose_stops(Block& block, size_t most) {
  constexpr double kSame = 1e-9;  // rad/s, m/s
  size_t wrong = 0;
  for (Stop& stop : block.stops) {
    const Row& row = rows_[stop.row];
    const double way_out = row.upper == 0.0 ? -1.0 : 1.0;  // of the row
    if (stop.holds) {
      if (way_out * shares_of(block, stop).stop >= 0.0 || ++wrong > most) continue;
      if (stop.motor != JointTree::kNone) block.free.push_back(stop.motor);
    } else {
      const double rate = stop.sign * block.tree.rate_after(stop.way);
      if (way_out * (rate - row.target) >= -kSame || ++wrong > most) continue;
      std::erase(block.free, stop.motor);
      std::erase_if(block.spent, [&](const Spent& spent) { return spent.row == stop.motor; });
    }
    stop.holds = !stop.holds;
  }
  return wrong;
}

// The impulses of stops, and of what is beside those that hold.
void JointBlocks::give_shares(Block& block) {
  for (const Stop& stop : block.stops) {
    if (!stop.holds) {
      rows_[stop.row].impulse = 0.0;
      continue;
    }
    const Shares shares = shares_of(block, stop);
    rows_[stop.row].impulse = shares.stop;
    if (stop.motor == JointTree::kNone) continue;
    rows_[stop.motor].impulse = shares.motor;
    if (damper_of(stop.motor)) rows_[damper_of_row_[stop.motor]].impulse = shares.damper;
  }
}

// After a solution: moves motors in the wrong set to the other one, at most so many of them.
// Returns how many were in the wrong one.
size_t JointBlocks::choose_spent(Block& block, size_t most) {
  constexpr double kSame = 1e-9;  // rad/s, m/s
  const size_t were_spent = block.spent.size();
  size_t wrong = 0, kept = 0;
  for (size_t i = 0; i < block.free.size(); ++i) {
    const size_t r = block.free[i];
    const double wanted = rows_[r].impulse + x_[i] - damper_gives(block, r);
    const bool holds = wanted >= rows_[r].lower && wanted <= rows_[r].upper;
    if (holds || ++wrong > most) {
      block.free[kept++] = r;
    } else {
      block.spent.push_back({r, wanted > rows_[r].upper});
    }
  }
  block.free.resize(kept);
  kept = 0;
  for (size_t i = 0; i < block.spent.size(); ++i) {
    const Spent spent = block.spent[i];
    const Row& row = rows_[spent.row];
    const double error =
        row.target - block.tree.rate_after(way_of_row_[spent.row]) - row.softness * bound_of(spent);
    const bool too_much = spent.upper ? error < -kSame : error > kSame;
    if (i >= were_spent || !too_much || ++wrong > most) {
      block.spent[kept++] = spent;
    } else {
      block.free.push_back(spent.row);
    }
  }
  block.spent.resize(kept);
  return wrong;
}

double JointBlocks::sweep_tree(Block& block, SolverBodies& bodies) {
  // Exchanges of all at once that make it no better; then one by one until one does (J. Judice, F.
  // Pires, "A block principal pivoting algorithm for large-scale strictly monotone linear
  // complementarity problems", 1994).
  constexpr int kAllAtOnce = 6, kMost = 60;
  size_t least = SIZE_MAX;
  int left = kAllAtOnce;
  const int most = kMost + static_cast<int>(block.stops.size());
  for (const Stop& stop : block.stops) {  // they share anew
    if (stop.motor == JointTree::kNone) continue;
    rows_[stop.motor].impulse += stop.sign * std::exchange(rows_[stop.row].impulse, 0.0);
  }
  double worst =
      block.tree.aim([&](int body) { return std::pair(bodies[body].v, bodies[body].w); }, 0.0);
  for (int i = 0; i < most; ++i) {
    if (!block.factored) factor(block);
    worst = std::max(worst, aim_motors(block));
    solve(block, x_);
    const size_t at_once = left > 0 ? SIZE_MAX : 1;
    const size_t motors = choose_spent(block, at_once);
    const size_t wrong = motors + choose_stops(block, left > 0 ? SIZE_MAX : motors > 0 ? 0 : 1);
    block.exact = wrong == 0;
    if (block.exact) break;
    left = wrong < least ? kAllAtOnce : std::max(left - 1, 0);
    least = std::min(least, wrong);
    block.factored = false;
  }
  if (!block.factored) {
    factor(block);
    aim_motors(block);
    solve(block, x_);
    block.exact = false;
  }
  give_shares(block);
  const auto damp = [&](size_t motor) {
    const double more = damper_gives(block, motor);
    if (damper_of(motor)) rows_[damper_of_row_[motor]].impulse += more;
    return more;
  };
  for (size_t i = 0; i < x_.size(); ++i)
    rows_[block.free[i]].impulse += x_[i] - damp(block.free[i]);
  for (const Spent& spent : block.spent) {
    damp(spent.row);
    rows_[spent.row].impulse = bound_of(spent);
  }
  block.tree.for_each_change([&](int body, const Vec3& v, const Vec3& w) {
    bodies[body].v += v;
    bodies[body].w += w;
  });
  for (const size_t i : block.bounded) worst = std::max(worst, relax(i, bodies));
  return worst;
}

// A motor at a bound gives nothing against a push, its damper holds.
void JointBlocks::hold_push(Block& block) const {
  for (const Spent& spent : block.spent) {
    const size_t way = way_of_row_[spent.row];
    if (damper_of(spent.row))
      block.tree.aim(way, -block.tree.rate(way));
    else
      block.tree.push(way, 0.0);
  }
  for (const Stop& stop : block.stops) {
    if (stop.holds)
      block.tree.aim(stop.way, -block.tree.rate(stop.way));
    else if (stop.motor == JointTree::kNone)
      block.tree.push(stop.way, 0.0);
  }
}

double JointBlocks::aim_push(Block& block, const SolverBodies& bodies, bool stops) {
  double worst = 0.0;
  if (block.is_tree) {
    worst = block.tree.aim(
        [&](int body) { return std::pair(bodies[body].push_v, bodies[body].push_w); },
        closing_per_s_);
    hold_push(block);
    for (const Stop& stop : block.stops) {
      if (!stop.holds) continue;
      const double missing =
          (stops ? stop.sign * rows_[stop.row].push_target : 0.0) - block.tree.rate(stop.way);
      block.tree.aim(stop.way, missing);
      worst = std::max(worst, std::abs(missing));
    }
  }
  x_.resize(block.free.size());
  for (size_t i = 0; i < x_.size(); ++i) {
    const size_t r = block.free[i];
    const double now = block.is_tree ? block.tree.rate(way_of_row_[r]) : push_velocity(r, bodies);
    x_[i] = rows_[r].push_target - now;
    worst = std::max(worst, std::abs(x_[i]));
  }
  return worst;
}

double JointBlocks::sweep(SolverBodies& bodies) {
  double worst = 0.0;
  for (size_t b = 0; b < block_count_; ++b) {
    Block& block = blocks_[b];
    if (block.is_tree) {
      worst = std::max(worst, sweep_tree(block, bodies));
      continue;
    }
    for (size_t attempt = 0;; ++attempt) {
      if (!block.factored) factor(block);
      worst = std::max(worst, aim(block, bodies));
      solve(block, x_);
      size_t kept = 0;
      for (size_t i = 0; i < x_.size(); ++i) {
        const Row& row = rows_[block.free[i]];
        const double wanted = row.impulse + x_[i];
        if (wanted >= row.lower && wanted <= row.upper) {
          block.free[kept++] = block.free[i];
        } else {
          block.bounded.push_back(block.free[i]);
        }
      }
      if (kept == x_.size()) break;
      block.free.resize(kept);
      block.factored = false;
      for (const size_t i : block.bounded) worst = std::max(worst, relax(i, bodies));
    }
    for (size_t i = 0; i < x_.size(); ++i) give(block.free[i], bodies, x_[i]);
    for (const size_t i : block.bounded) worst = std::max(worst, relax(i, bodies));
  }
  return worst;
}

size_t JointBlocks::mechanism(int body, const SolverBodies& bodies) {
  const size_t i = static_cast<size_t>(body);
  if (bodies[i].inverse_mass == Vec3::Zero()) return 0;
  return joints_.empty() ? i : root(i);
}

void JointBlocks::tell_responses(const std::vector<Row*>& contacts,
                                 std::vector<double>& responses) {
  const size_t n = contacts.size();
  responses.resize(n * n);
  for (size_t i = 0; i < n; ++i) {
    for (size_t j = 0; j <= i; ++j) responses[i * n + j] = contacts[i]->coupling(*contacts[j]);
  }
  for (size_t b = 0; b < block_count_; ++b) {
    if (!blocks_[b].factored) continue;
    blocks_[b].is_tree ? add_those_of_tree(blocks_[b], contacts, responses)
                       : take_off_held(blocks_[b], contacts, responses);
  }
  for (size_t i = 0; i < n; ++i) {
    for (size_t j = 0; j < i; ++j) responses[j * n + i] = responses[i * n + j];
  }
}

// C^T K^-1 C, where K = L D L^T is the response of the rows and C their coupling to the contacts.
void JointBlocks::take_off_held(const Block& block, const std::vector<Row*>& contacts,
                                std::vector<double>& responses) {
  const size_t n = contacts.size(), m = block.free.size();
  held_.resize(n * m);
  bool any = false;
  for (size_t i = 0; i < n; ++i) {
    double* of_i = &held_[i * m];
    for (size_t k = 0; k < m; ++k) {
      of_i[k] = coupling(block.free[k], *contacts[i]);
      any |= of_i[k] != 0.0;
    }
  }
  if (!any) return;
  for (size_t i = 0; i < n; ++i) {
    solve_lower(block, &held_[i * m]);
    for (size_t j = 0; j <= i; ++j) {
      for (size_t k = 0; k < m; ++k)
        responses[i * n + j] -= held_[i * m + k] * held_[j * m + k] * block.inverse[k];
    }
  }
}

// An impulse moves its own bodies, and through the joints all of the mechanism.
void JointBlocks::add_those_of_tree(Block& block, const std::vector<Row*>& contacts,
                                    std::vector<double>& responses) {
  const size_t n = contacts.size();
  for (size_t i = 0; i < n; ++i) {
    const Row& row = *contacts[i];
    if (!block.tree.has(row.a) && !block.tree.has(row.b)) continue;
    const auto moved = [&](int body) {
      Vec3 v = Vec3::Zero(), w = Vec3::Zero();
      if (body == row.a) v += row.moves_a, w += row.turns_a;
      if (body == row.b) v += row.moves_b, w += row.turns_b;
      return std::pair(v, w);
    };
    block.tree.aim(moved, 0.0);
    for (const size_t k : block.free)
      block.tree.aim(way_of_row_[k], -block.tree.rate(way_of_row_[k]));
    hold_push(block);
    block.tree.solve();
    for (size_t j = 0; j <= i; ++j) {
      const Row& other = *contacts[j];
      double more = 0.0;
      if (block.tree.has(other.a)) {
        const auto [v, w] = block.tree.change(other.a);
        more += other.linear_a.dot(v) + other.angular_a.dot(w);
      }
      if (block.tree.has(other.b)) {
        const auto [v, w] = block.tree.change(other.b);
        more += other.linear_b.dot(v) + other.angular_b.dot(w);
      }
      responses[i * n + j] += more;
    }
  }
}

double JointBlocks::look_again(double substep_s) {
  double largest = 0.0;
  for (Joint& joint : joints_) {
    Block& block = blocks_[joint.block];
    if (block.is_tree) {
      const auto [apart, askew] = errors_of(joint.ways.kind, *joint.constraint);
      const bool b = block.tree.hangs_on(joint.b, joint.a);
      block.tree.tell_error(b ? joint.b : joint.a, apart, askew);
      largest = std::max({largest, apart.cwiseAbs().maxCoeff() / substep_s,
                          askew.cwiseAbs().maxCoeff() / substep_s});
      if (!joint.stop) continue;
      Values whole;
      ask(*joint.constraint, 1.0, substep_s, whole);
      double& target = rows_[joint.first].push_target;
      target = whole.error[static_cast<size_t>(*joint.stop) * kSkip];
      largest = std::max(largest, std::abs(target));
      continue;
    }
    if (joint.hinge) {
      const HingeAt at(static_cast<btHingeConstraint&>(*joint.constraint));
      for (size_t i = 0; i < kRowsOfAHinge; ++i) {
        double& target = rows_[joint.first + i].push_target;
        target = at.error(static_cast<int>(i)) / substep_s;
        largest = std::max(largest, std::abs(target));
      }
      continue;
    }
    Values whole, none;
    const int n = ask(*joint.constraint, 1.0, substep_s, whole);
    if (!joint.errors_only) ask(*joint.constraint, 0.0, substep_s, none);
    for (size_t i = 0; i < joint.count - joint.motor_count && i < static_cast<size_t>(n); ++i) {
      Row& row = rows_[joint.first + i];
      row.push_target = whole.error[i * kSkip] - (joint.errors_only ? 0.0 : none.error[i * kSkip]);
      largest = std::max(largest, std::abs(row.push_target));
    }
  }
  return largest;
}

double JointBlocks::sweep_push(SolverBodies& bodies, bool stops) {
  double worst = 0.0;
  for (size_t b = 0; b < block_count_; ++b) {
    Block& block = blocks_[b];
    if (!block.factored) factor(block);
    worst = std::max(worst, aim_push(block, bodies, stops));
    solve(block, x_);
    if (block.is_tree) {
      block.tree.for_each_change([&](int body, const Vec3& v, const Vec3& w) {
        bodies[body].push_v += v;
        bodies[body].push_w += w;
      });
    } else {
      for (size_t i = 0; i < x_.size(); ++i) give_push(block.free[i], bodies, x_[i]);
    }
    for (const size_t i : block.bounded) {
      Row& row = rows_[i];
      if (!is_stop(row)) continue;  // a motor at its limit holds nothing
      const double wanted = std::clamp(
          row.push + ((stops ? row.push_target : 0.0) - row.push_velocity(bodies)) * row.inverse,
          row.lower, row.upper);
      worst = std::max(worst, std::abs(wanted - row.push) * row.response);
      row.give_push(bodies, wanted - row.push);
    }
  }
  return worst;
}

void JointBlocks::tell_pairs(std::vector<std::pair<int, int>>& pairs) const {
  for (const Joint& joint : joints_) pairs.emplace_back(joint.a, joint.b);
}

void JointBlocks::tell_rows(Newton& newton, const SolverBodies& bodies) {
  locked_.clear();
  for (const Joint& joint : joints_)
    if (blocks_[joint.block].is_tree) add_locked_rows(joint, bodies);
  for (std::vector<Row>* rows : {&locked_, &rows_}) {
    for (Row& row : *rows)
      if (row.inverse > 0.0) newton.add(row);
  }
}

// What a joint of a tree transmits.
void JointBlocks::add_locked_rows(const Joint& joint, const SolverBodies& bodies) {
  using Kind = JointWays::Kind;
  const Kind kind = joint.ways.kind;
  const Vec3& axis = joint.ways.axis;
  const Vec3 square = axis.unitOrthogonal();
  const std::array<Vec3, 3> directions = {square, axis.cross(square), axis};
  const auto arm = [&](int body) {
    const btRigidBody* bullet = bodies[body].bullet;
    return bullet ? Vec3(joint.ways.anchor - from_bt(bullet->getCenterOfMassPosition()))
                  : Vec3(Vec3::Zero());
  };
  const auto lock = [&](const Vec3& linear, const Vec3& angular) {
    Row& row = locked_.emplace_back();
    row.a = joint.a;
    row.b = joint.b;
    row.linear_a = linear;
    row.linear_b = -linear;
    row.angular_a = arm(joint.a).cross(linear) + angular;
    row.angular_b = -arm(joint.b).cross(linear) - angular;
    row.lower = -BT_LARGE_FLOAT;
    row.upper = BT_LARGE_FLOAT;
    row.prepare(bodies);
  };
  const size_t places = kind == Kind::slider ? 2 : 3, turns = kind == Kind::ball    ? 0
                                                              : kind == Kind::hinge ? 2
                                                                                    : 3;
  for (size_t i = 0; i < places; ++i) lock(directions[i], Vec3::Zero());
  for (size_t i = 0; i < turns; ++i) lock(Vec3::Zero(), directions[i]);
}

void JointBlocks::write_back() const {
  for (const Joint& joint : joints_) {
    const size_t first = joint.first + joint.count - joint.motor_count;
    for (size_t i = 0; i < joint.motor_count; ++i)
      joint.motors[i]->impulse = rows_[first + i].impulse;
  }
}

}  // namespace ruedo::physics
