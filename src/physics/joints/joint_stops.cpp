// The motors and stops of a tree of joints, which are solved with it.
//
// It is not known in advance which motors are at their bounds, and which stops hold. Motors and
// stops are exchanged between the sets of those that hold and the others until none is wrong
// (principal pivoting; K. Murty, "Note on a Bard-type scheme for solving the complementarity
// problem", 1974).
#include <algorithm>
#include <cmath>
#include <utility>

#include "physics/joints/joint_block.h"

namespace ruedo::physics {

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

// Motors that hold get their rate error; those at a bound get their maximum, and their dampers
// the impulse that follows from the rate.
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

// After a solution, of a stop that holds: the motor's impulse at that rate; the stop gives the
// rest. A motor that moves against the stop gives its maximum, or as much as needed if it has none.
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

// The impulses of stops, and of the motors and dampers beside stops that hold.
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
  for (const Stop& stop : block.stops) {  // stop and motor divide the impulse again
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

}  // namespace ruedo::physics
