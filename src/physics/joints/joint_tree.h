// A mechanism whose joints make a tree, solved in reduced coordinates: the articulated-body
// algorithm, for impulses (R. Featherstone, "Rigid Body Dynamics Algorithms", 2008, chapter 7).
//
// The degrees of freedom of a joint (one for a hinge, three for a ball) are eliminated from the
// leaves to the root, and velocities are then propagated from the root to the leaves: the cost is
// linear in the number of bodies, not cubic. All twists and impulses are about one point, so that
// none has to be shifted from link to link. A degree of freedom with a motor is not free: its
// velocity is prescribed.
#pragma once

#include <vector>

#include "physics/base/rows.h"

namespace ruedo::physics {

class Newton;

// The degrees of freedom of a joint's second body relative to the first one, which carries axis and
// anchor.
struct JointWays {
  enum class Kind : uint8_t { other, hinge, slider, fixed, ball };
  Kind kind = Kind::other;
  Vec3 axis = Vec3::UnitZ(), anchor = Vec3::Zero();  // world
};

class JointTree {
 public:
  static constexpr size_t kNone = static_cast<size_t>(-1);

  void begin(const Vec3& about);
  // The root, if nothing holds it or a drive keeps it upright. Returns whether it can be one.
  bool add_root(int body, const SolverBodies& bodies);
  // Adds a body that hangs on an added one, or on something immovable. b: the joint's second body,
  // to which the degrees of freedom refer. Returns whether the body can be part of a tree.
  bool add(int body, int on, bool b, const JointWays& ways, const SolverBodies& bodies);
  bool has(int body) const {
    return static_cast<size_t>(body) < place_.size() && place_[body] != kNone;
  }
  // Whether the one of two jointed bodies is the child of the other.
  bool hangs_on(int body, int on) const { return has(body) && members_[place_[body]].on == on; }
  // The degree of freedom of the body added last, if it has just one.
  size_t only_way() const {
    return members_.back().first + 1 == ways_.size() ? members_.back().first : kNone;
  }
  // Prescribes the velocity of a degree of freedom; with a softness, approximately.
  void let_go();  // all degrees of freedom become free
  void lead(size_t way, double softness);

  void factor();

  // Computes the joints' velocity errors in terms of the bodies' velocities (`velocity_of`: linear
  // and angular), including the correction of position errors in a substep (1/s; 0: none). Returns
  // the largest.
  template <class VelocityOf>
  double aim(const VelocityOf& velocity_of, double closing);
  // of the body's joint, m and rad
  void tell_error(int body, const Vec3& apart, const Vec3& askew);
  double rate(size_t way) const { return ways_[way].now; }  // in the current velocities
  void aim(size_t way, double missing) { ways_[way].missing = missing; }
  // of a free degree of freedom
  void push(size_t way, double impulse) { ways_[way].given = impulse; }
  // Converts them to velocity changes, and to impulses along the degrees of freedom.
  void solve();
  double impulse(size_t way) const { return ways_[way].impulse; }
  double rate_after(size_t way) const { return ways_[way].now + ways_[way].change; }
  // Calls act(body, linear, angular) for each.
  template <class Act>
  void for_each_change(Act&& act) const {
    for (const Member& m : members_) {
      const Vec3 w = m.change.head<3>();
      act(m.body, Vec3(m.change.tail<3>() + w.cross(m.arm)), w);
    }
  }
  std::pair<Vec3, Vec3> change(int body) const;
  size_t ways() const { return ways_.size(); }
  void tell_bodies(Newton& newton) const;

 private:
  using Six = Eigen::Matrix<double, 6, 1>;  // angular, linear
  using Matrix6 = Eigen::Matrix<double, 6, 6>;
  struct Member {
    int body = 0, on = 0;
    size_t parent = kNone;  // member
    size_t first = 0;       // way
    double sign = 1.0;      // -1 if the body is the joint's first one
    JointWays::Kind kind = JointWays::Kind::other;
    Vec3 axis, anchor, apart, askew;  // from here on positions are relative to the reference point
    Vec3 arm, arm_of_on;              // centres of mass
    double mass = 0.0;
    Eigen::Matrix3d inertia;  // about the centre of mass
    Matrix6 held;             // articulated inertia of everything that the joint carries
    Six aim, told;            // of the joint: velocity changes wanted without and with motors
    Six pull, change, impulse;
  };
  struct Way {
    Six along, reach;
    bool leads = false;
    double softness = 0.0, inverse = 0.0, left = 0.0;
    double now = 0.0, missing = 0.0, given = 0.0, change = 0.0, impulse = 0.0;
  };

  Member& add_member(int body, const SolverBodies& bodies);
  void add_way(const Vec3& angular, const Vec3& linear);
  size_t end_of(size_t member) const {
    return member + 1 < members_.size() ? members_[member + 1].first : ways_.size();
  }
  void set_inertia(Member& member) const;
  void find_changes();
  void find_impulses();

  Vec3 about_ = Vec3::Zero();
  bool open_ = false;            // a degree of freedom is free
  std::vector<Member> members_;  // parents before children
  std::vector<Way> ways_;
  std::vector<size_t> place_;  // index of a body in members_
};

template <class VelocityOf>
double JointTree::aim(const VelocityOf& velocity_of, double closing) {
  double worst = 0.0;
  for (size_t i = 0; i < members_.size(); ++i) {
    Member& m = members_[i];
    m.aim.setZero();
    if (m.kind == JointWays::Kind::other) continue;  // the root
    const auto [v, w] = velocity_of(m.body);
    const auto [v_on, w_on] = velocity_of(m.on);
    Vec3 turns = m.sign * (w - w_on);
    Vec3 moves =
        m.sign * (v + w.cross(m.anchor - m.arm) - v_on - w_on.cross(m.anchor - m.arm_of_on));
    if (m.kind == JointWays::Kind::hinge) {
      ways_[m.first].now = m.axis.dot(turns);
      turns -= ways_[m.first].now * m.axis;
    } else if (m.kind == JointWays::Kind::slider) {
      ways_[m.first].now = m.axis.dot(moves);
      moves -= ways_[m.first].now * m.axis;
    } else if (m.kind == JointWays::Kind::ball) {
      turns.setZero();
    }
    moves += closing * m.apart;
    turns += closing * m.askew;
    worst = std::max({worst, moves.cwiseAbs().maxCoeff(), turns.cwiseAbs().maxCoeff()});
    m.aim.head<3>() = -m.sign * turns;
    m.aim.tail<3>() = -m.sign * (moves + m.anchor.cross(turns));
  }
  return worst;
}

}  // namespace ruedo::physics
