// Sorts joints into mechanisms, and solves these one by one.
//
// For a row with bounds (a motor's maximum torque, a stop) it is not known in advance whether it is
// at one. All motors start among the rows that are solved directly; one that exceeds its bounds is
// relaxed iteratively with the others of that kind for the rest of the substep. In a tree such a
// motor gives its maximum, and holds again where that is too much; a stop holds while it is pushed
// (joint_stops.cpp).
#include "physics/joints/joint_block.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "physics/joints/joint_frames.h"

namespace ruedo::physics {

namespace {

bool moves(const SolverBody& body) { return body.inverse_mass != Vec3::Zero(); }

}  // namespace

void JointBlocks::clear() {
  rows_.clear();
  way_of_row_.clear();
  damper_of_row_.clear();
  thirds_.clear();
  third_of_row_.clear();
  joints_.clear();
  block_count_ = 0;
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
    int body = joint.a;
    for (const size_t j : block.joints) {
      for (const int one : {joints_[j].a, joints_[j].b})
        if (bodies[one].inverse_mass.z() == 0.0) body = one;  // upright: only a root can be
    }
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

size_t JointBlocks::ways(const SolverBodies& bodies) const {
  constexpr size_t kFree = 6;
  size_t ways = kFree * (bodies.size() - 1);
  for (size_t b = 0; b < block_count_; ++b)
    ways = ways + blocks_[b].tree.ways() - kFree * blocks_[b].bodies;
  return ways;
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

}  // namespace ruedo::physics
