// Trees of joints against Gauss's principle: of all velocities that the joints allow, the solution
// differs least from the given ones, measured by kinetic energy. Here it is solved as one dense
// system.
#include <gtest/gtest.h>

#include <memory>
#include <random>

#include "physics/joints/joint_tree.h"

namespace ruedo::physics {
namespace {

using Kind = JointWays::Kind;

struct Tie {
  int body, on;
  bool b;  // the body is the joint's second one
  JointWays ways;
  bool led;
  double softness, target, push;  // push: impulse along an open way
};

// Bodies with random poses, inertias and velocities.
class RandomTree {
 public:
  RandomTree(unsigned seed, int bodies, bool hung, bool all_led = false) : random_(seed) {
    bodies_.emplace_back();
    for (int i = 1; i <= bodies; ++i) add_body();
    for (int i = 1; i <= bodies; ++i) {
      if (i == 1 && !hung) continue;
      const int on = i == 1 ? 0 : std::uniform_int_distribution(1, i - 1)(random_);
      constexpr Kind kKinds[] = {Kind::hinge, Kind::slider, Kind::hinge, Kind::ball, Kind::fixed};
      const Kind kind = kKinds[(static_cast<unsigned>(i) + seed) % (all_led ? 3 : 5)];
      const bool led = all_led || ((kind == Kind::hinge || kind == Kind::slider) && i % 3 != 0);
      const double softness = all_led || i % 2 == 0 ? 0.0 : 0.05;
      const JointWays ways{kind, vector().normalized(), vector()};
      const double target = number();
      ties_.push_back({i, on, i % 2 == 0, ways, led, softness, target, number()});
    }
  }

  // The velocities after, as six numbers a body.
  Eigen::VectorXd by_tree() {
    JointTree tree;
    tree.begin(vector());
    std::vector<size_t> ways;
    if (ties_.size() < bodies_.size() - 1) {
      EXPECT_TRUE(tree.add_root(1, bodies_));
    }
    for (const Tie& tie : ties_) {
      EXPECT_TRUE(tree.add(tie.body, tie.on, tie.b, tie.ways, bodies_));
      ways.push_back(tree.only_way());
    }
    tree.aim([&](int body) { return std::pair(bodies_[body].v, bodies_[body].w); }, 0.0);
    for (const bool first : {true, false}) {  // what was led at first may be open then
      tree.let_go();
      for (size_t i = 0; i < ties_.size(); ++i) {
        if (ties_[i].led || (first && ways[i] != JointTree::kNone))
          tree.lead(ways[i], first ? 0.0 : ties_[i].softness);
      }
      tree.factor();
      for (size_t i = 0; i < ties_.size(); ++i) {
        if (ways[i] == JointTree::kNone) continue;
        tree.aim(ways[i], ties_[i].target - tree.rate(ways[i]));
        if (!ties_[i].led && !first) tree.push(ways[i], ties_[i].push);
      }
      tree.solve();
    }
    Eigen::VectorXd x = given();
    tree.for_each_change([&](int body, const Vec3& v, const Vec3& w) {
      x.segment<3>(6 * (body - 1)) += v;
      x.segment<3>(6 * (body - 1) + 3) += w;
    });
    for (size_t i = 0; i < ties_.size(); ++i)
      impulses_.push_back(ties_[i].led ? tree.impulse(ways[i]) : 0.0);
    return x;
  }

  // M (x - given) = J^T p + pushes; J x + softness p = target.
  Eigen::VectorXd by_gauss() {
    const Eigen::Index n = given().size();
    Eigen::MatrixXd J(0, n);
    std::vector<double> softness, target;
    std::vector<Eigen::Index> motor;
    const auto add = [&](const Tie& tie, const Vec3& moves, const Vec3& turns, double soft,
                         double rate) {
      J.conservativeResize(J.rows() + 1, Eigen::NoChange);
      J.bottomRows<1>().setZero();
      put(J, tie.body, tie.b ? 1.0 : -1.0, tie, moves, turns);
      put(J, tie.on, tie.b ? -1.0 : 1.0, tie, moves, turns);
      softness.push_back(soft);
      target.push_back(rate);
    };
    for (const Tie& tie : ties_) {
      const Vec3 &axis = tie.ways.axis, first = axis.unitOrthogonal(), second = axis.cross(first);
      const Kind kind = tie.ways.kind;
      for (const Vec3& d : {first, second, axis}) {
        const bool along = d == axis;
        if (kind != Kind::slider || !along) add(tie, d, Vec3::Zero(), 0.0, 0.0);
        if (kind != Kind::ball && (kind != Kind::hinge || !along))
          add(tie, Vec3::Zero(), d, 0.0, 0.0);
      }
      motor.push_back(J.rows());
      if (!tie.led) continue;
      const bool turns = kind == Kind::hinge;
      add(tie, turns ? Vec3(Vec3::Zero()) : axis, turns ? axis : Vec3(Vec3::Zero()), tie.softness,
          tie.target);
    }
    const Eigen::Index m = J.rows();
    Eigen::MatrixXd K = Eigen::MatrixXd::Zero(n + m, n + m);
    Eigen::VectorXd right(n + m);
    K.topLeftCorner(n, n) = mass();
    K.topRightCorner(n, m) = -J.transpose();
    K.bottomLeftCorner(m, n) = J;
    for (Eigen::Index i = 0; i < m; ++i) K(n + i, n + i) = softness[i], right(n + i) = target[i];
    right.head(n) = mass() * given() + pushes();
    const Eigen::VectorXd x = K.fullPivLu().solve(right);
    for (size_t i = 0; i < ties_.size(); ++i)
      expected_.push_back(ties_[i].led ? x(n + motor[i]) : 0.0);
    return x.head(n);
  }
  const std::vector<double>& impulses() const { return impulses_; }
  const std::vector<double>& expected_impulses() const { return expected_; }

 private:
  double number() { return std::uniform_real_distribution(-1.0, 1.0)(random_); }
  Vec3 vector() { return {number(), number(), number()}; }

  void add_body() {
    const btVector3 moments(0.1 + std::abs(number()), 0.1 + std::abs(number()),
                            0.1 + std::abs(number()));
    auto bullet =
        std::make_unique<btRigidBody>(0.5 + std::abs(number()), nullptr, nullptr, moments);
    const Quat turn = Quat(number(), number(), number(), number()).normalized();
    bullet->setWorldTransform(btTransform(to_bt(turn), to_bt(Vec3(3.0 * vector()))));
    bullet->updateInertiaTensor();
    SolverBody& body = bodies_.emplace_back();
    body.bullet = bullet.get();
    body.inverse_mass = Vec3::Constant(bullet->getInvMass());
    body.v = vector();
    body.w = vector();
    owned_.push_back(std::move(bullet));
  }
  Eigen::VectorXd given() const {
    Eigen::VectorXd x(6 * static_cast<Eigen::Index>(owned_.size()));
    for (size_t i = 1; i < bodies_.size(); ++i)
      x.segment<6>(6 * static_cast<Eigen::Index>(i - 1)) << bodies_[i].v, bodies_[i].w;
    return x;
  }
  Eigen::VectorXd pushes() const {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(given().size());
    for (const Tie& tie : ties_) {
      const bool turns = tie.ways.kind == Kind::hinge;
      if (tie.led || (!turns && tie.ways.kind != Kind::slider)) continue;
      Eigen::MatrixXd J = Eigen::MatrixXd::Zero(1, sum.size());
      const Vec3 none = Vec3::Zero();
      put(J, tie.body, tie.b ? 1.0 : -1.0, tie, turns ? none : tie.ways.axis,
          turns ? tie.ways.axis : none);
      put(J, tie.on, tie.b ? -1.0 : 1.0, tie, turns ? none : tie.ways.axis,
          turns ? tie.ways.axis : none);
      sum += tie.push * J.transpose();
    }
    return sum;
  }
  Eigen::MatrixXd mass() const {
    const Eigen::Index n = given().size();
    Eigen::MatrixXd M = Eigen::MatrixXd::Zero(n, n);
    for (size_t i = 0; i < owned_.size(); ++i) {
      const Eigen::Index at = 6 * static_cast<Eigen::Index>(i);
      M.block<3, 3>(at, at) = Eigen::Matrix3d::Identity() / owned_[i]->getInvMass();
      const Eigen::Matrix3d R = from_bt(owned_[i]->getWorldTransform()).rotation.toRotationMatrix();
      const Vec3 moments = from_bt(owned_[i]->getInvInertiaDiagLocal()).cwiseInverse();
      M.block<3, 3>(at + 3, at + 3) = R * moments.asDiagonal() * R.transpose();
    }
    return M;
  }
  // Of the last row: the velocity of the anchor on a body, and the body's turn rate.
  void put(Eigen::MatrixXd& J, int body, double sign, const Tie& tie, const Vec3& moves,
           const Vec3& turns) const {
    if (body == 0) return;
    const Vec3 arm = tie.ways.anchor - from_bt(bodies_[body].bullet->getCenterOfMassPosition());
    const Eigen::Index row = J.rows() - 1, at = 6 * (body - 1);
    J.block<1, 3>(row, at) += sign * moves.transpose();
    J.block<1, 3>(row, at + 3) += sign * (arm.cross(moves) + turns).transpose();
  }

  std::mt19937 random_;
  SolverBodies bodies_;
  std::vector<std::unique_ptr<btRigidBody>> owned_;
  std::vector<Tie> ties_;
  std::vector<double> impulses_, expected_;
};

TEST(JointTree, MovesByGaussPrinciple) {
  for (unsigned seed = 0; seed < 10; ++seed) {
    for (const bool hung : {false, true}) {
      RandomTree tree(seed, 2 + static_cast<int>(seed), hung);
      const Eigen::VectorXd moves = tree.by_tree(), expected = tree.by_gauss();
      EXPECT_LT((moves - expected).cwiseAbs().maxCoeff(), 1e-10) << seed << hung;
      for (size_t i = 0; i < tree.impulses().size(); ++i)
        EXPECT_NEAR(tree.impulses()[i], tree.expected_impulses()[i], 1e-9) << seed << hung << i;
    }
  }
}

// Where no direction is free, inertias do not matter for the motion, but for what the motors bear.
TEST(JointTree, DrivenJointsFollowTheirMotors) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    RandomTree tree(seed, 6, true, true);
    const Eigen::VectorXd moves = tree.by_tree(), expected = tree.by_gauss();
    EXPECT_LT((moves - expected).cwiseAbs().maxCoeff(), 1e-10) << seed;
    for (size_t i = 0; i < tree.impulses().size(); ++i)
      EXPECT_NEAR(tree.impulses()[i], tree.expected_impulses()[i], 1e-9) << seed << i;
  }
}

}  // namespace
}  // namespace ruedo::physics
