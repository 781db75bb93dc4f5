// The rows of joints: Bullet's for its constraints, our own for hinges, motors and gearboxes, and
// those that Newton's method needs of a tree.
#include <algorithm>
#include <array>
#include <cmath>

#include "physics/base/newton.h"
#include "physics/joints/joint_block.h"
#include "physics/joints/joint_frames.h"

namespace ruedo::physics {

namespace {

constexpr size_t kMostRows = 8;  // of one Bullet constraint
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

}  // namespace

// The rows of a constraint, as Bullet gives them.
struct JointBlocks::Values {
  std::array<btScalar, kSkip * kMostRows> jacobian{}, error{}, softness{}, lower{}, upper{};
};

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

void JointBlocks::tell_pairs(std::vector<std::pair<int, int>>& pairs) const {
  for (const Joint& joint : joints_) pairs.emplace_back(joint.a, joint.b);
}

void JointBlocks::tell_rows(Newton& newton, const SolverBodies& bodies) {
  locked_.clear();
  for (const Joint& joint : joints_)
    if (blocks_[joint.block].is_tree) add_locked_rows(joint, bodies);
  for (Row& row : locked_)
    if (row.inverse > 0.0) newton.add(row);
  tell_motors(newton);
}

void JointBlocks::tell_trees(Newton& newton) const {
  for (size_t b = 0; b < block_count_; ++b) blocks_[b].tree.tell_bodies(newton);
}

void JointBlocks::tell_motors(Newton& newton) {
  for (Row& row : rows_)
    if (row.inverse > 0.0) newton.add(row);
}

// The rows of the forces and moments that a joint of a tree transmits.
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
