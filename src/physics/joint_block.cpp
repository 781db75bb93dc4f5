// Bullet's constraints to rows, and their direct solution.
//
// Of a row with bounds (a motor's largest torque, a stop) nobody knows beforehand whether it is at
// one. All motors begin among the rows that are solved directly; one that comes out beyond its
// bounds goes to those that are relaxed one by one, for the rest of the substep.
#include "physics/joint_block.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace ruedo::physics {

namespace {

constexpr double kUnbounded = 1e17;    // Bullet's "infinity" is 1e18 or more
constexpr double kRegular = 1e-10;     // part of the diagonal: loops of joints say the same twice
constexpr double kIndependent = 1e-6;  // of its response that no other row has
constexpr size_t kMostRows = 8;        // of one of Bullet's constraints
constexpr size_t kRowsOfAHinge = 5;
constexpr size_t kSkip = 12;  // numbers of a row's Jacobian
constexpr size_t kMostInBlock =
    256;  // rows that are solved directly; a longer mechanism's others are relaxed

Vec3 vector_at(const btScalar* v) { return {v[0], v[1], v[2]}; }

// A universal joint's rows have a target of their own, whatever part of the error is undone.
bool says_more(const btTypedConstraint& constraint) {
  return constraint.getConstraintType() == D6_CONSTRAINT_TYPE ||
         constraint.getConstraintType() == D6_SPRING_CONSTRAINT_TYPE ||
         constraint.getConstraintType() == D6_SPRING_2_CONSTRAINT_TYPE ||
         constraint.getConstraintType() == FIXED_CONSTRAINT_TYPE;
}

// Where a hinge's frames are.
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
    const Vec3 axis_b = from_bt(B.getBasis() * in_b.getBasis().getColumn(2));
    askew = first.cross(second).cross(axis_b);
  }
  // What the five rows must undo, in m and rad.
  double error(int row) const {
    return row < 3 ? apart[row] : row == 3 ? askew.dot(first) : askew.dot(second);
  }
  Vec3 arm_a, arm_b, apart;   // from the centres of mass to the anchors, and from A's to B's
  Vec3 first, second, askew;  // square to A's axis; turns A's axis into B's
};

bool is_stop(const Row& row) { return row.lower == 0.0 || row.upper == 0.0; }

}  // namespace

// What Bullet says of a constraint's rows.
struct JointBlocks::Values {
  std::array<btScalar, kSkip * kMostRows> jacobian{}, error{}, softness{}, lower{}, upper{};
};

void JointBlocks::clear() {
  rows_.clear();
  thirds_.clear();
  joints_.clear();
  block_count_ = 0;
}

// Returns how many rows there are. `reduction` is the part of the joint's error that the rows'
// velocities undo in a substep.
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
  for (const Third& third : thirds_)
    if (third.row == row) return &third;
  return nullptr;
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

void JointBlocks::add(btTypedConstraint& constraint, int a, int b, int reference,
                      const SolverBodies& bodies, double substep_s) {
  auto* motors = static_cast<JointMotors*>(constraint.getUserConstraintPtr());
  Joint& joint = joints_.emplace_back();
  joint.constraint = &constraint;
  joint.first = rows_.size();
  joint.a = a;
  joint.b = b;
  joint.hinge = add_hinge(constraint, joint, bodies);
  if (!joint.hinge) add_asked(constraint, joint, bodies, substep_s);
  if (motors && motors->first.on) add_motor(motors->first, joint, reference, bodies);
  if (motors && motors->second.on) add_motor(motors->second, joint, reference, bodies);
  joint.count = rows_.size() - joint.first;
}

Row& JointBlocks::add_row(const Joint& joint) {
  Row& row = rows_.emplace_back();
  row.a = joint.a;
  row.b = joint.b;
  return row;
}

// Anchor to anchor and axis to axis, as Bullet has it. Returns false for what Bullet is asked for:
// other joints, and a hinge at a stop.
bool JointBlocks::add_hinge(btTypedConstraint& constraint, Joint& joint,
                            const SolverBodies& bodies) {
  if (constraint.getConstraintType() != HINGE_CONSTRAINT_TYPE) return false;
  auto& hinge = static_cast<btHingeConstraint&>(constraint);
  if (hinge.hasLimit()) {
    hinge.testLimit(hinge.getRigidBodyA().getCenterOfMassTransform(),
                    hinge.getRigidBodyB().getCenterOfMassTransform());
    if (hinge.getSolveLimit()) return false;
  }
  const HingeAt at(hinge);
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
  Values values;
  const int n = ask(constraint, 0.0, substep_s, values);
  joint.errors_only = !says_more(constraint);
  for (int i = 0; i < n; ++i) {
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

// Positive as the child, body b, moves against the parent.
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
  (joint.motors[0] ? joint.motors[1] : joint.motors[0]) = &motor;
  rows_.push_back(row);
  if (motor.reference && reference > 0) add_third(motor, reference, bodies);
}

// The last row's: the reference bears what the moments on parent and child leave over.
void JointBlocks::add_third(const JointMotor& motor, int reference, const SolverBodies& bodies) {
  Third third;
  third.row = rows_.size() - 1;
  third.body = reference;
  third.angular = -motor.axis - motor.parent_axis;
  third.turns = bodies[reference].inverse_inertia * third.angular;
  thirds_.push_back(third);
  Row& row = rows_.back();
  row.response = coupling(third.row, third.row);
  row.inverse = row.response > 1e-12 ? 1.0 / (row.response + row.softness) : 0.0;
}

size_t JointBlocks::root(size_t body) {
  while (parents_[body] != body) body = parents_[body] = parents_[parents_[body]];
  return body;
}

void JointBlocks::prepare(const SolverBodies& bodies) {
  if (rows_.empty()) return;
  parents_.resize(bodies.size());
  std::iota(parents_.begin(), parents_.end(), size_t{0});
  const auto moves = [&](int body) { return bodies[body].inverse_mass != Vec3::Zero(); };
  const auto unite = [&](int one, int other) {
    if (!moves(one) || !moves(other)) return;
    const size_t a = root(static_cast<size_t>(one)), b = root(static_cast<size_t>(other));
    parents_[std::max(a, b)] = std::min(a, b);
  };
  for (const Joint& joint : joints_) unite(joint.a, joint.b);
  for (const Third& third : thirds_) {
    unite(third.body, rows_[third.row].a);
    unite(third.body, rows_[third.row].b);
  }
  constexpr size_t kNone = static_cast<size_t>(-1);
  block_of_root_.assign(bodies.size(), kNone);
  for (Joint& joint : joints_) {
    size_t& block = block_of_root_[root(static_cast<size_t>(moves(joint.a) ? joint.a : joint.b))];
    if (block == kNone) {
      block = block_count_++;
      if (blocks_.size() < block_count_) blocks_.emplace_back();
      blocks_[block].free.clear();
      blocks_[block].bounded.clear();
      blocks_[block].factored = false;
    }
    joint.block = block;
    for (size_t i = joint.first; i < joint.first + joint.count; ++i) {
      const Row& row = rows_[i];
      if (row.inverse == 0.0) continue;
      const bool direct = !is_stop(row) && row.upper > 0.0 && row.lower < 0.0 &&
                          blocks_[block].free.size() < kMostInBlock;
      (direct ? blocks_[block].free : blocks_[block].bounded).push_back(i);
    }
  }
}

// The joints of a chain follow one another, and each is tied to its neighbours alone: near the
// diagonal is all that there is, and Cholesky's factor has it there, too.
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
      if (body == 0) return;  // nothing moves it
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

// Each pivot is taken off the rows that it reaches, at once: no sum waits for another one.
void JointBlocks::factor(Block& block) {
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
  block.factored = true;
}

void JointBlocks::solve_lower(const Block& block, double* x) const {
  const size_t n = block.free.size();
  for (size_t j = 0; j < n; ++j) {
    const double* of_j = &block.factor[j * n];
    const double part = x[j] * block.inverse[j];
    for (size_t i = j + 1; i <= block.end[j]; ++i) x[i] -= part * of_j[i];
  }
}

void JointBlocks::solve(const Block& block, std::vector<double>& x) const {
  const size_t n = block.free.size();
  solve_lower(block, x.data());
  for (size_t j = n; j-- > 0;) {
    const double* of_j = &block.factor[j * n];
    double sum = x[j];
    for (size_t i = block.end[j]; i > j; --i) sum -= of_j[i] * x[i];  // the newest one comes last
    x[j] = sum * block.inverse[j];
  }
}

bool JointBlocks::exact() const {
  return std::all_of(blocks_.begin(), blocks_.begin() + static_cast<std::ptrdiff_t>(block_count_),
                     [](const Block& block) { return block.exact && block.bounded.empty(); });
}

double JointBlocks::sweep(SolverBodies& bodies) {
  double worst = 0.0;
  for (size_t b = 0; b < block_count_; ++b) {
    Block& block = blocks_[b];
    for (size_t attempt = 0;; ++attempt) {
      if (!block.factored) factor(block);
      x_.resize(block.free.size());
      for (size_t i = 0; i < x_.size(); ++i) {
        const Row& row = rows_[block.free[i]];
        x_[i] = row.target - velocity(block.free[i], bodies) - row.softness * row.impulse;
        worst = std::max(worst, std::abs(x_[i]));
      }
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
  return rows_.empty() ? i : root(i);
}

void JointBlocks::tell_responses(const std::vector<Row*>& contacts,
                                 std::vector<double>& responses) {
  const size_t n = contacts.size();
  responses.resize(n * n);
  for (size_t i = 0; i < n; ++i) {
    for (size_t j = 0; j <= i; ++j) responses[i * n + j] = contacts[i]->coupling(*contacts[j]);
  }
  for (size_t b = 0; b < block_count_; ++b) {
    if (blocks_[b].factored) take_off_held(blocks_[b], contacts, responses);
  }
  for (size_t i = 0; i < n; ++i) {
    for (size_t j = 0; j < i; ++j) responses[j * n + i] = responses[i * n + j];
  }
}

// C^T K^-1 C, where K = L D L^T is the rows' own response and C that to the contacts.
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

double JointBlocks::look_again(double substep_s) {
  double largest = 0.0;
  for (Joint& joint : joints_) {
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
    const size_t motors = joint.motors[1] ? 2 : joint.motors[0] ? 1 : 0;
    for (size_t i = 0; i < joint.count - motors && i < static_cast<size_t>(n); ++i) {
      Row& row = rows_[joint.first + i];
      row.push_target = whole.error[i * kSkip] - (joint.errors_only ? 0.0 : none.error[i * kSkip]);
      largest = std::max(largest, std::abs(row.push_target));
    }
  }
  return largest;
}

double JointBlocks::sweep_push(SolverBodies& bodies) {
  double worst = 0.0;
  for (size_t b = 0; b < block_count_; ++b) {
    Block& block = blocks_[b];
    if (!block.factored) factor(block);
    x_.resize(block.free.size());
    for (size_t i = 0; i < x_.size(); ++i) {
      const Row& row = rows_[block.free[i]];
      x_[i] = row.push_target - push_velocity(block.free[i], bodies);
      worst = std::max(worst, std::abs(x_[i]));
    }
    solve(block, x_);
    for (size_t i = 0; i < x_.size(); ++i) give_push(block.free[i], bodies, x_[i]);
    for (const size_t i : block.bounded) {
      Row& row = rows_[i];
      if (!is_stop(row)) continue;  // a motor at its limit holds nothing
      const double wanted =
          std::clamp(row.push + (row.push_target - row.push_velocity(bodies)) * row.inverse,
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

void JointBlocks::tell_rows(Newton& newton) {
  for (Row& row : rows_) {
    if (row.inverse > 0.0) newton.add(row);
  }
}

void JointBlocks::write_back() const {
  for (const Joint& joint : joints_) {
    const size_t motors = joint.motors[1] ? 2 : joint.motors[0] ? 1 : 0;
    for (size_t i = 0; i < motors; ++i)
      joint.motors[i]->impulse = rows_[joint.first + joint.count - motors + i].impulse;
  }
}

}  // namespace ruedo::physics
