#include "physics/joints/joint_tree.h"

#include <algorithm>

#include "physics/base/newton.h"

namespace ruedo::physics {

namespace {

Eigen::Matrix3d cross_matrix(const Vec3& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

bool moves_freely(const btRigidBody& body) {
  const btVector3 all(1, 1, 1), inverse = body.getInvInertiaDiagLocal();
  return body.getLinearFactor() == all && body.getAngularFactor() == all && inverse.x() > 0.0 &&
         inverse.y() > 0.0 && inverse.z() > 0.0;
}

// A drive keeps such a body upright: it moves in a horizontal plane, and turns about its normal.
bool moves_in_plane(const btRigidBody& body) {
  return body.getLinearFactor() == btVector3(1, 1, 0) &&
         body.getAngularFactor() == btVector3(0, 0, 1);
}

}  // namespace

void JointTree::begin(const Vec3& about) {
  about_ = about;
  for (const Member& m : members_) place_[m.body] = kNone;
  members_.clear();
  ways_.clear();
}

JointTree::Member& JointTree::add_member(int body, const SolverBodies& bodies) {
  const size_t i = static_cast<size_t>(body);
  if (place_.size() <= i) place_.resize(std::max(bodies.size(), i + 1), kNone);
  place_[i] = members_.size();
  Member& m = members_.emplace_back();
  const btRigidBody& bullet = *bodies[i].bullet;
  m.body = body;
  m.first = ways_.size();
  m.arm = from_bt(bullet.getCenterOfMassPosition()) - about_;
  m.mass = 1.0 / bullet.getInvMass();
  const btMatrix3x3& R = bullet.getWorldTransform().getBasis();
  const Vec3 inverse = from_bt(bullet.getInvInertiaDiagLocal());
  for (int row = 0; row < 3; ++row) {
    const Vec3 scaled = from_bt(R.getRow(row)).cwiseQuotient(inverse);
    for (int column = 0; column <= row; ++column)
      m.inertia(row, column) = m.inertia(column, row) = scaled.dot(from_bt(R.getRow(column)));
  }
  return m;
}

void JointTree::add_way(const Vec3& angular, const Vec3& linear) {
  Way& way = ways_.emplace_back();
  way.along << angular, linear;
}

bool JointTree::add_root(int body, const SolverBodies& bodies) {
  const btRigidBody& bullet = *bodies[body].bullet;
  const bool in_plane = moves_in_plane(bullet);
  if (!in_plane && !moves_freely(bullet)) return false;
  const double inverse = bodies[body].inverse_inertia(2, 2);
  if (in_plane && inverse <= 0.0) return false;
  Member& m = add_member(body, bodies);
  m.kind = JointWays::Kind::other;
  // As all rows see it: a moment about the normal has that response, others have none.
  if (in_plane) m.inertia = Vec3(0.0, 0.0, 1.0 / inverse).asDiagonal();
  for (int i = 0; i < (in_plane ? 2 : 3); ++i) add_way(Vec3::Zero(), Vec3::Unit(i));
  for (int i = in_plane ? 2 : 0; i < 3; ++i) add_way(Vec3::Unit(i), m.arm.cross(Vec3::Unit(i)));
  return true;
}

bool JointTree::add(int body, int on, bool b, const JointWays& ways, const SolverBodies& bodies) {
  if (!moves_freely(*bodies[body].bullet)) return false;
  const size_t parent = has(on) ? place_[on] : kNone;
  Member& m = add_member(body, bodies);
  m.on = on;
  m.parent = parent;
  m.sign = b ? 1.0 : -1.0;
  m.kind = ways.kind;
  m.axis = ways.axis;
  m.anchor = ways.anchor - about_;
  m.apart = m.askew = Vec3::Zero();
  const btRigidBody* holder = bodies[on].bullet;
  m.arm_of_on = holder ? Vec3(from_bt(holder->getCenterOfMassPosition()) - about_) : m.anchor;
  const auto turn_about = [&](const Vec3& axis) {
    add_way(m.sign * axis, m.sign * m.anchor.cross(axis));
  };
  if (m.kind == JointWays::Kind::hinge) turn_about(m.axis);
  if (m.kind == JointWays::Kind::slider) add_way(Vec3::Zero(), m.sign * m.axis);
  if (m.kind == JointWays::Kind::ball) {
    for (int i = 0; i < 3; ++i) turn_about(Vec3::Unit(i));
  }
  return true;
}

void JointTree::tell_error(int body, const Vec3& apart, const Vec3& askew) {
  Member& m = members_[place_[body]];
  m.apart = apart;
  m.askew = askew;
}

void JointTree::let_go() {
  for (Way& way : ways_) {
    way.leads = false;
    way.softness = way.given = 0.0;
  }
}

void JointTree::lead(size_t way, double softness) {
  ways_[way].leads = softness == 0.0;
  ways_[way].softness = softness;
}

// About the reference point: momentum is this times the twist.
void JointTree::set_inertia(Member& m) const {
  const Eigen::Matrix3d arm = m.mass * cross_matrix(m.arm);
  m.held.topLeftCorner<3, 3>() = m.inertia - cross_matrix(m.arm) * arm;
  m.held.topRightCorner<3, 3>() = arm;
  m.held.bottomLeftCorner<3, 3>() = -arm;
  m.held.bottomRightCorner<3, 3>() = m.mass * Eigen::Matrix3d::Identity();
}

void JointTree::factor() {
  open_ = std::any_of(ways_.begin(), ways_.end(), [](const Way& way) { return !way.leads; });
  if (!open_) return;
  for (Member& m : members_) set_inertia(m);
  for (size_t i = members_.size(); i-- > 0;) {
    const Member& m = members_[i];
    Matrix6 left = m.held;
    for (size_t k = m.first; k < end_of(i); ++k) {
      Way& way = ways_[k];
      if (way.leads) continue;
      way.reach.noalias() = left * way.along;
      const double response = way.along.dot(way.reach);
      way.inverse = 1.0 / (response + (way.softness > 0.0 ? 1.0 / way.softness : 0.0));
      left.noalias() -= (way.inverse * way.reach) * way.reach.transpose();
    }
    if (m.parent != kNone) members_[m.parent].held += left;
  }
}

void JointTree::solve() {
  find_changes();
  find_impulses();
}

void JointTree::find_changes() {
  for (size_t i = 0; i < members_.size(); ++i) {
    Member& m = members_[i];
    m.pull.setZero();
    m.told = m.aim;
    for (size_t k = m.first; k < end_of(i); ++k)
      if (ways_[k].leads) m.told += (ways_[k].change = ways_[k].missing) * ways_[k].along;
  }
  for (size_t i = members_.size(); open_ && i-- > 0;) {
    Member& m = members_[i];
    m.pull.noalias() += m.held * m.told;
    for (size_t k = m.first; k < end_of(i); ++k) {
      Way& way = ways_[k];
      if (way.leads) continue;
      const double given = way.softness > 0.0 ? way.missing / way.softness : way.given;
      way.left = given - way.along.dot(m.pull);
      m.pull += (way.left * way.inverse) * way.reach;
    }
    if (m.parent != kNone) members_[m.parent].pull += m.pull;
  }
  for (size_t i = 0; i < members_.size(); ++i) {
    Member& m = members_[i];
    m.change = m.parent != kNone ? members_[m.parent].change : Six(Six::Zero());
    for (size_t k = end_of(i); k-- > m.first;) {
      Way& way = ways_[k];
      if (way.leads) continue;
      way.change = (way.left - way.reach.dot(m.change)) * way.inverse;
      m.change += way.change * way.along;
    }
    m.change += m.told;
  }
}

// For each joint: the change in momentum of everything it carries.
void JointTree::find_impulses() {
  for (Member& m : members_) {
    const Vec3 w = m.change.head<3>();
    const Vec3 momentum = m.mass * (m.change.tail<3>() + w.cross(m.arm));
    m.impulse << m.inertia * w + m.arm.cross(momentum), momentum;
  }
  for (size_t i = members_.size(); i-- > 0;) {
    const Member& m = members_[i];
    for (size_t k = m.first; k < end_of(i); ++k) ways_[k].impulse = ways_[k].along.dot(m.impulse);
    if (m.parent != kNone) members_[m.parent].impulse += m.impulse;
  }
}

std::pair<Vec3, Vec3> JointTree::change(int body) const {
  const Member& m = members_[place_[body]];
  const Vec3 w = m.change.head<3>();
  return {Vec3(m.change.tail<3>() + w.cross(m.arm)), w};
}

void JointTree::tell_bodies(Newton& newton) const {
  for (size_t i = 0; i < members_.size(); ++i) {
    const Member& m = members_[i];
    newton.add_body(m.body, m.parent != kNone ? m.on : 0, m.arm);
    for (size_t k = m.first; k < end_of(i); ++k) newton.add_way(ways_[k].along);
  }
}

}  // namespace ruedo::physics
