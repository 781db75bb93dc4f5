// Newton's method, the banded matrix and its Cholesky factor.
#include "physics/base/newton.h"

#include <algorithm>
#include <cmath>

#include "ruedo/math.h"

namespace ruedo::physics {

namespace {

// The softness of a row's spring relative to the row's response: the stiffer, the fewer multiplier
// updates, and the more Newton steps for each.
constexpr double kYields = 1e-3;
constexpr int kMostHalvings = 6;
// A line search may end at a slope of this fraction of the initial one.
constexpr double kSlopeLeft = 0.3;

bool can_move(const SolverBody& body) {
  return body.inverse_mass != Vec3::Zero() || !body.inverse_inertia.isZero(0.0);
}

// Cholesky factor of a semidefinite matrix: a body may be unable to rotate about an axis.
Eigen::Matrix3d root_of(const Eigen::Matrix3d& A) {
  Eigen::Matrix3d L = Eigen::Matrix3d::Zero();
  const double nothing = 1e-14 * A.trace();
  for (int j = 0; j < 3; ++j) {
    double square = A(j, j);
    for (int k = 0; k < j; ++k) square -= L(j, k) * L(j, k);
    if (square <= nothing) continue;
    L(j, j) = std::sqrt(square);
    for (int i = j + 1; i < 3; ++i) {
      double sum = A(i, j);
      for (int k = 0; k < j; ++k) sum -= L(i, k) * L(j, k);
      L(i, j) = sum / L(j, j);
    }
  }
  return L;
}

}  // namespace

// Capacity for usual islands is reserved: steady runs do not allocate.
Newton::Newton() {
  constexpr size_t kBodies = 8, kEntries = 64;
  bodies_.reserve(kBodies);
  movable_.reserve(kBodies);
  degree_.reserve(kBodies);
  order_.reserve(kBodies);
  first_neighbour_.reserve(kBodies + 1);
  neighbours_.reserve(kEntries);
  first_.reserve(kBodies);
  start_.reserve(kBodies);
  blocks_.reserve(kBodies * (kBodies + 1) / 2);
  y_.reserve(kBodies);
  trial_.reserve(kBodies);
  gradient_.reserve(kBodies);
  step_.reserve(kBodies);
  entries_.reserve(kEntries);
}

double Newton::prepare(const SolverBodies& bodies, const std::vector<std::pair<int, int>>& pairs) {
  bodies_.assign(bodies.size(), {});
  movable_.clear();
  for (size_t i = 1; i < bodies.size(); ++i) {
    if (!can_move(bodies[i])) continue;
    bodies_[i].root_mass = bodies[i].inverse_mass.cwiseSqrt();
    bodies_[i].root_inertia = root_of(bodies[i].inverse_inertia);
    movable_.push_back(static_cast<int>(i));
  }
  put_in_order(pairs);
  lay_out(pairs);
  double products = 0.0;
  for (size_t i = 0; i < first_.size(); ++i) {
    const double wide = static_cast<double>(static_cast<int>(i) - first_[i]) + 1.0;
    products += 216.0 * wide * wide;
  }
  return products;
}

// Breadth-first from a body with few neighbours; then reversed.
void Newton::put_in_order(const std::vector<std::pair<int, int>>& pairs) {
  const auto movable = [&](int body) {
    return body > 0 &&
           (bodies_[body].root_mass != Vec3::Zero() || !bodies_[body].root_inertia.isZero(0.0));
  };
  first_neighbour_.assign(bodies_.size() + 1, 0);
  for (const auto& [a, b] : pairs) {
    if (!movable(a) || !movable(b)) continue;
    ++first_neighbour_[static_cast<size_t>(a) + 1];
    ++first_neighbour_[static_cast<size_t>(b) + 1];
  }
  for (size_t i = 0; i < bodies_.size(); ++i) first_neighbour_[i + 1] += first_neighbour_[i];
  neighbours_.resize(first_neighbour_.back());
  degree_.assign(bodies_.size(), 0);
  for (const auto& [a, b] : pairs) {
    if (!movable(a) || !movable(b)) continue;
    for (const auto& [from, to] : {std::pair(a, b), std::pair(b, a)}) {
      const size_t i = static_cast<size_t>(from);
      neighbours_[first_neighbour_[i] + static_cast<size_t>(degree_[i]++)] = to;
    }
  }
  const auto fewer = [&](int a, int b) {
    return std::pair(degree_[a], a) < std::pair(degree_[b], b);
  };
  std::sort(movable_.begin(), movable_.end(), fewer);
  order_.clear();
  const auto visit = [&](int body) {
    PlaceIndex& place = bodies_[body].place;
    if (place.valid()) return;
    place = PlaceIndex(0);
    order_.push_back(body);
  };
  for (const int body : movable_) {
    size_t next = order_.size();
    visit(body);
    for (; next < order_.size(); ++next) {
      const size_t i = static_cast<size_t>(order_[next]);
      const auto begin = neighbours_.begin() + static_cast<std::ptrdiff_t>(first_neighbour_[i]),
                 end = begin + degree_[i];
      std::sort(begin, end, fewer);
      for (auto each = begin; each != end; ++each) visit(*each);
    }
  }
  std::reverse(order_.begin(), order_.end());
  for (size_t i = 0; i < order_.size(); ++i) bodies_[order_[i]].place = PlaceIndex(i);
}

void Newton::lay_out(const std::vector<std::pair<int, int>>& pairs) {
  first_.resize(order_.size());
  for (size_t i = 0; i < first_.size(); ++i) first_[i] = static_cast<int>(i);
  for (const auto& [a, b] : pairs) {
    const PlaceIndex p = bodies_[a].place, q = bodies_[b].place;
    if (!p.valid() || !q.valid()) continue;
    int& first = first_[std::max(p, q)];
    first = std::min<int>(first, std::min(p, q));
  }
  start_.resize(first_.size());
  size_t blocks = 0;
  for (size_t i = 0; i < first_.size(); ++i) {
    start_[i] = blocks;
    blocks += i + 1 - static_cast<size_t>(first_[i]);
  }
  blocks_.resize(blocks);
}

Newton::Entry& Newton::enter(Row& row, Kind kind, double scale, double response) {
  Entry& entry = entries_.emplace_back();
  entry.row = &row;
  entry.kind = kind;
  entry.scale = scale;
  entry.weight = 1.0 / (scale * scale * (row.softness + kYields * response));
  entry.begun = entry.held = row.impulse / scale;
  const auto scaled = [&](int body, const Vec3& linear, const Vec3& angular, PlaceIndex& place,
                          Six& J) {
    const Body& of = bodies_[body];
    place = of.place;
    if (!place.valid()) return;
    J.head<3>() = scale * linear.cwiseProduct(of.root_mass);
    J.tail<3>() = scale * (of.root_inertia.transpose() * angular);
  };
  scaled(row.a, row.linear_a, row.angular_a, entry.a, entry.J_a);
  scaled(row.b, row.linear_b, row.angular_b, entry.b, entry.J_b);
  return entry;
}

size_t Newton::add(Row& row) {
  Entry& entry = enter(row, Kind::bounded, 1.0, row.response);
  entry.lower = row.lower;
  entry.upper = row.upper;
  return entries_.size() - 1;
}

void Newton::add(Row& row, size_t load, double lever) {
  if (row.inverse == 0.0) return;
  enter(row, Kind::on_load, lever, row.response).load = load;
}

void Newton::add(Row& along, Row& across, double friction, double friction2, size_t load) {
  if (along.inverse == 0.0 && across.inverse == 0.0) return;
  const double weight =
      std::max(friction * friction * along.response, friction2 * friction2 * across.response);
  enter(along, Kind::along, friction, weight / (friction * friction)).load = load;
  enter(across, Kind::across, friction2, weight / (friction2 * friction2)).load = load;
  Entry &first = entries_[entries_.size() - 2], &second = entries_.back();
  first.weight = second.weight = std::min(first.weight, second.weight);
}

void Newton::set_bounds() {
  for (Entry& entry : entries_) {
    if (entry.kind == Kind::bounded) continue;
    entry.upper = std::max(entries_[entry.load].pulls, 0.0);
    entry.lower = -entry.upper;
  }
}

void Newton::pull(Entry& entry, double wanted) {
  entry.pulls = std::clamp(wanted, entry.lower, entry.upper);
  entry.active = entry.pulls == wanted;
  entry.stiffness = entry.active ? entry.weight : 0.0;
}

void Newton::rub(Entry& along, Entry& across, double first, double second) {
  const double size = math::hypot(first, second), load = along.upper;
  along.active = across.active = size <= load;
  const double part = along.active ? 1.0 : load / size;
  along.pulls = part * first;
  across.pulls = part * second;
  along.stiffness = across.stiffness = part * along.weight;
  if (along.active) return;
  along.turn = -second / size;
  across.turn = first / size;
}

double Newton::slope(const std::vector<Six>& y) {
  gradient_ = y;
  double first_of_pair = 0.0;
  for (size_t i = 0; i < entries_.size(); ++i) {
    Entry& entry = entries_[i];
    double missing = entry.missing;
    if (entry.a.valid()) missing -= entry.J_a.dot(y[entry.a]);
    if (entry.b.valid()) missing -= entry.J_b.dot(y[entry.b]);
    missing -= entry.scale * entry.scale * entry.row->softness * (entry.held - entry.begun);
    const double wanted = entry.held + entry.weight * missing;
    if (entry.kind == Kind::along) {
      first_of_pair = wanted;
      continue;
    }
    if (entry.kind == Kind::across) {
      rub(entries_[i - 1], entry, first_of_pair, wanted);
    } else {
      pull(entry, wanted);
    }
    for (size_t k = entry.kind == Kind::across ? i - 1 : i; k <= i; ++k) {
      const Entry& each = entries_[k];
      const double more = each.pulls - each.begun;
      if (each.a.valid()) gradient_[each.a] -= more * each.J_a;
      if (each.b.valid()) gradient_[each.b] -= more * each.J_b;
    }
  }
  double sum = 0.0;
  for (size_t i = 0; i < step_.size(); ++i) sum += gradient_[i].dot(step_[i]);
  return sum;
}

bool Newton::same_set() const {
  return std::all_of(entries_.begin(), entries_.end(), [](const Entry& entry) {
    const bool slips = !entry.active && entry.kind >= Kind::along && entry.upper > 0.0;
    return !slips && entry.active == entry.was_active;
  });
}

void Newton::add_row(const Entry& entry, const Six& J_a, const Six& J_b, double weight) {
  if (entry.a.valid()) block(entry.a, entry.a).noalias() += J_a * (weight * J_a).transpose();
  if (entry.b.valid()) block(entry.b, entry.b).noalias() += J_b * (weight * J_b).transpose();
  if (!entry.a.valid() || !entry.b.valid()) return;
  if (entry.a > entry.b) {
    block(entry.a, entry.b).noalias() += J_a * (weight * J_b).transpose();
  } else {
    block(entry.b, entry.a).noalias() += J_b * (weight * J_a).transpose();
  }
}

void Newton::assemble() {
  for (size_t i = 0; i < first_.size(); ++i) {
    for (int j = first_[i]; j < static_cast<int>(i); ++j) block(static_cast<int>(i), j).setZero();
    block(static_cast<int>(i), static_cast<int>(i)).setIdentity();
  }
  for (size_t i = 0; i < entries_.size(); ++i) {
    Entry& entry = entries_[i];
    entry.was_active = entry.active;
    if (entry.active) {
      add_row(entry, entry.J_a, entry.J_b, entry.stiffness);
    } else if (entry.kind == Kind::across && entry.stiffness > 0.0) {
      const Entry& along = entries_[i - 1];
      add_row(entry, along.turn * along.J_a + entry.turn * entry.J_a,
              along.turn * along.J_b + entry.turn * entry.J_b, entry.stiffness);
    }
  }
}

void Newton::factor() {
  for (int i = 0; i < static_cast<int>(first_.size()); ++i) {
    const int first = first_[i];
    Block& own = block(i, i);
    for (int j = first; j < i; ++j) {
      Block& of_j = block(i, j);
      for (int k = std::max(first, first_[j]); k < j; ++k)
        of_j.noalias() -= block(i, k) * block(j, k).transpose();
      block(j, j).triangularView<Eigen::Lower>().transpose().solveInPlace<Eigen::OnTheRight>(of_j);
      own.noalias() -= of_j * of_j.transpose();
    }
    Eigen::LLT<Eigen::Ref<Block>> in_place(own);
  }
}

void Newton::substitute() {
  const int n = static_cast<int>(first_.size());
  for (int i = 0; i < n; ++i) {
    Six& x = step_[i];
    for (int j = first_[i]; j < i; ++j) x.noalias() -= block(i, j) * step_[j];
    block(i, i).triangularView<Eigen::Lower>().solveInPlace(x);
  }
  for (int i = n; i-- > 0;) {
    Six& x = step_[i];
    block(i, i).triangularView<Eigen::Lower>().transpose().solveInPlace(x);
    for (int j = first_[i]; j < i; ++j) step_[j].noalias() -= block(i, j).transpose() * x;
  }
}

// Updates the multipliers by the rows' current impulses. Returns the largest change, as a velocity.
double Newton::take_multipliers() {
  double change = 0.0;
  for (Entry& entry : entries_) {
    change =
        std::max(change, std::abs(entry.pulls - entry.held) * entry.scale * entry.row->response);
    entry.held = entry.pulls;
  }
  return change;
}

// m/s
double Newton::furthest(const std::vector<Six>& step) const {
  double most = 0.0;
  for (size_t i = 0; i < step.size(); ++i) {
    const Body& body = bodies_[order_[i]];
    most = std::max(most, step[i].norm() * body.root_mass.maxCoeff());
  }
  return most;
}

void Newton::solve(SolverBodies& bodies, double tolerance, int most_steps) {
  for (Entry& entry : entries_) {
    const Row& row = *entry.row;
    entry.missing = entry.scale * (row.target - row.velocity(bodies) - row.softness * row.impulse);
  }
  y_.assign(first_.size(), Six::Zero());
  step_ = y_;
  for (Entry& entry : entries_) entry.pulls = entry.held;
  set_bounds();
  slope(y_);
  bool factored = false;
  for (int i = 0; i < most_steps; ++i) {
    const bool same = factored && same_set();
    if (!same) {
      assemble();
      factor();
      factored = true;
    }
    for (size_t k = 0; k < step_.size(); ++k) step_[k] = -gradient_[k];
    double begin = 0.0;
    substitute();
    for (size_t k = 0; k < step_.size(); ++k) begin += gradient_[k].dot(step_[k]);
    double part = 1.0, low = 0.0, high = 1.0;
    for (int k = 0;; ++k) {
      trial_.resize(y_.size());
      for (size_t j = 0; j < y_.size(); ++j) trial_[j] = y_[j] + part * step_[j];
      const double end = slope(trial_);
      if (k == kMostHalvings || std::abs(end) <= kSlopeLeft * std::abs(begin)) break;
      if (end < 0.0 && part == 1.0) break;
      (end > 0.0 ? high : low) = part;
      part = 0.5 * (low + high);
    }
    y_.swap(trial_);
    const bool settled = part == 1.0 && (same_set() || furthest(step_) <= tolerance);
    if (!settled) {
      set_bounds();
      slope(y_);
      continue;
    }
    if (take_multipliers() <= tolerance) break;
    set_bounds();
    slope(y_);
  }
  for (Entry& entry : entries_) entry.row->give(bodies, entry.scale * (entry.pulls - entry.begun));
}

}  // namespace ruedo::physics
