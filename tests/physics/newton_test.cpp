// Newton's method over all rows of an island, beside closed forms and dense algebra.
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "physics/base/newton.h"
#include "physics/base/reduced_matrix.h"
#include "physics/base/sparse_matrix.h"

namespace ruedo::physics {
namespace {

// bodies: all but the first take part.
void expect_like_dense(int bodies, const std::vector<std::pair<int, int>>& pairs) {
  using Block = SparseMatrix::Block;
  std::vector<char> takes_part(static_cast<size_t>(bodies), 1);
  takes_part[0] = 0;
  SparseMatrix matrix;
  matrix.prepare(takes_part, pairs);
  const int n = bodies - 1;
  ASSERT_EQ(matrix.size(), static_cast<size_t>(n));
  std::mt19937 random(1);
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  Eigen::MatrixXd dense = Eigen::MatrixXd::Identity(6 * n, 6 * n);
  matrix.set_identity();
  for (const auto& [a, b] : pairs) {
    const PlaceIndex p = matrix.place(a), q = matrix.place(b);
    if (!p.valid() || !q.valid()) continue;
    const Block A = Block::NullaryExpr([&] { return any(random); }),
                B = Block::NullaryExpr([&] { return any(random); });
    matrix.block(p, p) += A * A.transpose();
    matrix.block(q, q) += B * B.transpose();
    matrix.block(std::max(p, q), std::min(p, q)) +=
        p > q ? Block(A * B.transpose()) : Block(B * A.transpose());
    dense.block<6, 6>(6 * p, 6 * p) += A * A.transpose();
    dense.block<6, 6>(6 * q, 6 * q) += B * B.transpose();
    dense.block<6, 6>(6 * p, 6 * q) += A * B.transpose();
    dense.block<6, 6>(6 * q, 6 * p) += B * A.transpose();
  }
  std::vector<SparseMatrix::Six> x(static_cast<size_t>(n));
  Eigen::VectorXd right(6 * n);
  for (int i = 0; i < n; ++i) {
    x[i] = SparseMatrix::Six::NullaryExpr([&] { return any(random); });
    right.segment<6>(6 * i) = x[i];
  }
  matrix.factor();
  matrix.solve(x);
  const Eigen::VectorXd expected = dense.llt().solve(right);
  for (int i = 0; i < n; ++i) EXPECT_LT((x[i] - expected.segment<6>(6 * i)).norm(), 1e-11);
}

TEST(SparseMatrix, SolvesLikeADenseFactor) {
  expect_like_dense(7, {{1, 2}, {2, 5}, {5, 3}, {3, 6}, {6, 1}, {0, 4}});
  std::mt19937 random(2);
  for (const int bodies : {2, 64, 65, 66, 150}) {
    std::vector<std::pair<int, int>> pairs;
    for (int i = 0; i < 2 * bodies; ++i) {
      const int a = static_cast<int>(random() % bodies), b = static_cast<int>(random() % bodies);
      if (a != b) pairs.emplace_back(a, b);
    }
    expect_like_dense(bodies, pairs);
  }
}

// Two trees of bodies and a free one, with random ways and blocks between any two of them.
TEST(ReducedMatrix, SolvesLikeADenseFactor) {
  constexpr int kBodies = 10;  // the first one takes no part
  constexpr int kOn[kBodies] = {0, 0, 1, 2, 1, 4, 0, 6, 6, 0};
  constexpr int kWays[kBodies] = {0, 6, 1, 1, 3, 0, 3, 1, 1, 6};
  using Six = NewtonMatrix::Six;
  using Block = NewtonMatrix::Block;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  const auto number = [&] { return any(random); };
  ReducedMatrix reduced;
  reduced.begin(kBodies);
  // Six velocities of each body are ways times rates.
  Eigen::MatrixXd twists = Eigen::MatrixXd::Zero(6 * kBodies, 22), scaled = twists;
  int way = 0;
  for (int body = 1; body < kBodies; ++body) {
    const Block scale = Block::NullaryExpr(number);
    reduced.add(body, kOn[body], scale);
    twists.middleRows<6>(6 * body) = twists.middleRows<6>(6 * kOn[body]);
    for (int k = 0; k < kWays[body]; ++k) {
      const Six along = Six::NullaryExpr(number);
      reduced.add_way(along);
      twists.block<6, 1>(6 * body, way++) = along;
    }
    scaled.middleRows<6>(6 * body) = scale * twists.middleRows<6>(6 * body);
  }
  ASSERT_EQ(way, 22);
  const Eigen::MatrixXd S = scaled.bottomRows(6 * kBodies - 6);
  reduced.prepare();
  ASSERT_EQ(reduced.size(), kBodies - 1u);
  ASSERT_EQ(reduced.ways(), 22u);

  // The blocks are of twists.
  const Eigen::MatrixXd T = twists.bottomRows(6 * kBodies - 6);
  const std::vector<std::pair<int, int>> pairs = {{1, 3}, {3, 5}, {5, 7}, {7, 9}, {8, 7}, {2, 4}};
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(S.rows(), S.rows());
  reduced.set_identity();
  for (const auto& [a, b] : pairs) {
    const int p = reduced.place(a), q = reduced.place(b);
    const Block A = Block::NullaryExpr(number), B = Block::NullaryExpr(number);
    reduced.block(p, p) += A * A.transpose();
    reduced.block(q, q) += B * B.transpose();
    reduced.block(std::max(p, q), std::min(p, q)) +=
        p > q ? Block(A * B.transpose()) : Block(B * A.transpose());
    Eigen::MatrixXd both = Eigen::MatrixXd::Zero(S.rows(), 6);
    both.middleRows<6>(6 * p) = A;
    both.middleRows<6>(6 * q) = B;
    dense += both * both.transpose();
  }
  const size_t bent = reduced.way_between(reduced.place(3), reduced.place(2));
  ASSERT_EQ(bent, 7u);  // way 0 to 5: of body 1, 6: of body 2
  EXPECT_EQ(reduced.way_between(reduced.place(1), reduced.place(4)), ReducedMatrix::kNone);
  EXPECT_EQ(reduced.way_between(reduced.place(3), reduced.place(1)), ReducedMatrix::kNone);
  reduced.stiffen(bent, 5.0);
  reduced.factor();
  for (const bool all : {true, false}) {  // with the blocks, and without
    Eigen::VectorXd right(S.rows());
    std::vector<Six> x(kBodies - 1);
    for (int i = 0; i < kBodies - 1; ++i) x[i] = right.segment<6>(6 * i) = Six::NullaryExpr(number);
    all ? reduced.solve(x) : reduced.project(x);
    Eigen::MatrixXd H = S.transpose() * S;
    if (all) {
      H += T.transpose() * dense * T;
      H(7, 7) += 5.0;
    }
    const Eigen::VectorXd expected = S * H.llt().solve(S.transpose() * right);
    for (int i = 0; i < kBodies - 1; ++i)
      EXPECT_LT((x[i] - expected.segment<6>(6 * i)).norm(), 1e-9 * expected.norm()) << i;
  }

  // Of rows on one body, between neighbours, and between two trees.
  const Eigen::MatrixXd yields = S * (S.transpose() * S).llt().solve(S.transpose());
  for (const auto& [a, b] : std::vector<std::pair<int, int>>{{3, 0}, {2, 3}, {5, 4}, {3, 8}}) {
    const PlaceIndex p = reduced.place(a), q = b > 0 ? reduced.place(b) : PlaceIndex();
    Eigen::VectorXd row = Eigen::VectorXd::Zero(S.rows());
    const Six J_a = Six::NullaryExpr(number), J_b = Six::NullaryExpr(number);
    row.segment<6>(6 * p) = J_a;
    if (q.valid()) row.segment<6>(6 * q) = J_b;
    const double expected = row.dot(yields * row);
    EXPECT_NEAR(reduced.response(p, J_a, q, J_b), expected, 1e-9 * expected) << a << " " << b;
  }
}

// A tower of points: each stands on the one below, the first one on something immovable.
class Tower {
 public:
  Tower(const std::vector<double>& masses, const Vec3& velocity) : bodies_(1) {
    for (const double mass : masses) {
      SolverBody& body = bodies_.emplace_back();
      body.v = velocity;
      body.inverse_mass = Vec3::Constant(1.0 / mass);
      const int a = static_cast<int>(bodies_.size()) - 1;
      pairs_.emplace_back(a, a - 1);
      for (int k = 0; k < 3; ++k) {
        Row row;
        row.a = a;
        row.b = a - 1;
        row.linear_a = Vec3::Unit((k + 2) % 3);  // up, along, across
        row.linear_b = -row.linear_a;
        if (k == 0) row.upper = 1e30;
        rows_.push_back(row);
      }
    }
    for (Row& row : rows_) row.prepare(bodies_);
  }

  bool solve(double friction, double friction2, double tolerance = 1e-9) {
    Newton newton;
    newton.prepare(bodies_, pairs_);
    newton.begin();
    for (size_t i = 0; i < rows_.size(); i += 3)
      newton.add(rows_[i], rows_[i + 1], rows_[i + 2], friction, friction2);
    return newton.solve(bodies_, tolerance, 200);
  }

  const SolverBody& body(size_t i) const { return bodies_[i]; }
  const Row& row(size_t i) const { return rows_[i]; }

 private:
  SolverBodies bodies_;
  std::vector<std::pair<int, int>> pairs_;
  std::vector<Row> rows_;
};

// It loses its fall, and of its slip the friction times that: m v = mu m 2 m/s. It does not rise.
TEST(Newton, ASlippingBodyKeepsItsContact) {
  Tower tower({3.0}, {5.0, 0.0, -2.0});
  EXPECT_TRUE(tower.solve(0.4, 0.4));
  EXPECT_LT((tower.body(1).v - Vec3(5.0 - 0.4 * 2.0, 0.0, 0.0)).norm(), 1e-7);
  EXPECT_NEAR(tower.row(0).impulse, 3.0 * 2.0, 1e-6);
}

TEST(Newton, AStickingBodyStops) {
  Tower tower({3.0}, {0.6, -0.4, -2.0});
  EXPECT_TRUE(tower.solve(0.4, 0.4));
  EXPECT_LT(tower.body(1).v.norm(), 1e-7);
}

// Friction in the ellipse (x / mu)^2 + (y / mu2)^2 <= load^2 opposes the slip by maximum
// dissipation: its direction is (mu^2 v_x, mu2^2 v_y), for the velocity after it.
TEST(Newton, FrictionOfTwoCoefficientsDissipatesTheMost) {
  const double mu = 0.6, mu2 = 0.2;
  Tower tower({1.0}, {3.0, 4.0, -2.0});
  EXPECT_TRUE(tower.solve(mu, mu2));
  const Vec3 v = tower.body(1).v, p = v - Vec3(3.0, 4.0, -2.0);
  EXPECT_NEAR(v.z(), 0.0, 1e-7);
  EXPECT_NEAR(std::hypot(p.x() / mu, p.y() / mu2), 2.0, 1e-6);
  EXPECT_NEAR(p.x() / p.y(), mu * mu * v.x() / (mu2 * mu2 * v.y()), 1e-6);
}

// A ton on a tower of light bodies: all stop, and each contact bears what is above it.
TEST(Newton, ATowerOfAnyMassesStops) {
  const std::vector<double> masses = {1.0, 0.01, 1.0, 0.5, 1000.0};
  Tower tower(masses, {0.0, 0.1, -0.05});
  EXPECT_TRUE(tower.solve(0.8, 0.8));
  double above = 0.0;
  for (size_t i = masses.size(); i-- > 0;) {
    above += masses[i];
    EXPECT_LT(std::abs(tower.body(i + 1).v.z()), 1e-6);
    EXPECT_NEAR(tower.row(3 * i).impulse, 0.05 * above, 1e-6 * above);
  }
}

// Light blocks on rails of a heavy body, across which each of them hits a wall: all stop, and the
// walls bear the momentum of all. A block yields a tiny part of what it would by itself.
TEST(Newton, WallsThatLightPartsHitStopAHeavyBody) {
  constexpr int kBlocks = 40;
  constexpr double kHeavy = 1000.0, kLight = 0.05, kSpeed = 2.0;
  SolverBodies bodies(2 + kBlocks);
  for (size_t i = 1; i < bodies.size(); ++i) {
    bodies[i].inverse_mass = Vec3::Constant(1.0 / (i == 1 ? kHeavy : kLight));
    bodies[i].v = Vec3(kSpeed, 0.0, 0.0);
  }
  Newton newton;
  newton.begin_trees(bodies);
  const auto along = [](int axis) {
    Eigen::Matrix<double, 6, 1> way = Eigen::Matrix<double, 6, 1>::Zero();
    way[3 + axis] = 1.0;
    return way;
  };
  newton.add_body(1, 0, Vec3::Zero());
  for (int axis = 0; axis < 3; ++axis) newton.add_way(along(axis));
  std::vector<Row> rows;
  for (int body = 2; body < 2 + kBlocks; ++body) {
    newton.add_body(body, 1, Vec3::Zero());
    newton.add_way(along(2));
    for (int k = 0; k < 3; ++k) {
      Row row;
      row.a = body;
      row.linear_a = k == 0 ? Vec3(-1.0, 0.0, 0.0) : Vec3(Vec3::Unit(k));
      if (k == 0) row.upper = 1e30;
      row.prepare(bodies);
      rows.push_back(row);
    }
  }
  newton.end_trees();
  newton.begin();
  for (size_t i = 0; i < rows.size(); i += 3)
    newton.add(rows[i], rows[i + 1], rows[i + 2], 0.5, 0.5);
  EXPECT_TRUE(newton.solve(bodies, 1e-6, 8));
  double borne = 0.0;
  for (size_t i = 0; i < rows.size(); i += 3) borne += rows[i].impulse;
  EXPECT_NEAR(borne, (kHeavy + kBlocks * kLight) * kSpeed, 1e-2);
}

// A contact near the middle of a falling rod turns it, and its far end, which was to stay clear of
// the ground, comes down on that, too.
TEST(Newton, AContactThatTurnsABodyBringsOthersAbout) {
  SolverBodies bodies(2);
  bodies[1].inverse_mass = Vec3::Ones();
  bodies[1].inverse_inertia = 100.0 * Eigen::Matrix3d::Identity();
  bodies[1].v = Vec3(0.0, 0.0, -2.0);
  Row rows[2][3];
  const double at[2] = {0.1, -1.0}, target[2] = {0.0, -5.0};
  for (int i = 0; i < 2; ++i) {
    for (int k = 0; k < 3; ++k) {
      Row& row = rows[i][k];
      row.a = 1;
      row.linear_a = Vec3::Unit((k + 2) % 3);
      row.angular_a = Vec3(at[i], 0.0, 0.0).cross(row.linear_a);
      row.target = k == 0 ? target[i] : 0.0;
      if (k == 0) row.upper = 1e30;
      row.prepare(bodies);
    }
  }
  Newton newton;
  newton.prepare(bodies, {{1, 0}});
  newton.begin();
  for (auto& [normal, along, across] : rows) newton.add(normal, along, across, 0.0, 0.0);
  EXPECT_TRUE(newton.solve(bodies, 1e-9, 50));
  // Both ends reach their targets: 1.1 m times the rate is 5 m/s.
  EXPECT_NEAR(bodies[1].w.y(), -5.0 / 1.1, 1e-6);
  EXPECT_NEAR(bodies[1].v.z(), -0.5 / 1.1, 1e-6);
  EXPECT_NEAR(rows[0][0].impulse + rows[1][0].impulse, 2.0 - 0.5 / 1.1, 1e-6);
}

TEST(Newton, SeparatingBodiesGetNoImpulse) {
  const Vec3 up(1.0, 0.0, 0.5);
  Tower rising({1.0}, up);
  EXPECT_TRUE(rising.solve(0.8, 0.8));
  EXPECT_EQ(rising.body(1).v, up);
}

}  // namespace
}  // namespace ruedo::physics
