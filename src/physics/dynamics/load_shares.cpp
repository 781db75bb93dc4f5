// Conjugate gradients from zero: they converge to the least impulses with the same effect on the
// bodies.
#include "physics/dynamics/load_shares.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace ruedo::physics {

namespace {

// Between unit normals: contacts in other directions press against each other, and do not share a
// load.
constexpr double kSameDirection = 0.7;
// Three contacts in a triangle have a unique solution; below this fraction of its longest side its
// height counts as none.
constexpr double kInLine = 1e-3;
constexpr size_t kUsually = 16;  // contacts of a group
// More are not shared out: the work grows with the third power of their number, and rigid bodies
// are content with any distribution.
constexpr size_t kMost = 256;

}  // namespace

LoadShares::LoadShares() {
  bearings_.reserve(4 * kUsually);
  group_.reserve(kUsually);
  rows_.reserve(kUsually);
  responses_.reserve(kUsually * kUsually);
  bears_.reserve(kUsually);
  for (auto* list : {&units_, &loads_, &least_, &residual_, &heading_, &along_})
    list->reserve(kUsually);
}

void LoadShares::gather(size_t first) {
  group_.clear();
  rows_.clear();
  const Bearing& like = bearings_[first];
  for (size_t i = first; i < bearings_.size(); ++i) {
    Bearing& each = bearings_[i];
    if (each.taken || each.on != like.on || each.against != like.against ||
        each.direction.dot(like.direction) < kSameDirection)
      continue;
    each.taken = true;
    group_.push_back(&each);
    rows_.push_back(each.normal);
  }
}

// A wheel in contact along a line of two points is as stiff as one with a single point.
void LoadShares::weigh() {
  const size_t n = rows_.size();
  units_.resize(n);
  for (size_t i = 0; i < n; ++i) {
    const auto of_same_shapes = [&](const Bearing* other) {
      return other->manifold == group_[i]->manifold && other->shape == group_[i]->shape &&
             other->other_shape == group_[i]->other_shape;
    };
    const auto points = std::count_if(group_.begin(), group_.end(), of_same_shapes);
    units_[i] = 1.0 / std::sqrt(static_cast<double>(points));
  }
  for (size_t i = 0; i < n; ++i) {
    for (size_t j = 0; j < n; ++j) responses_[i * n + j] *= units_[i] * units_[j];
  }
}

bool LoadShares::has_more_than_it_needs() const {
  if (group_.size() != 3) return group_.size() > 3;
  const Vec3 one = group_[1]->place - group_[0]->place, other = group_[2]->place - group_[0]->place;
  const double longest = std::max({one.norm(), other.norm(), (one - other).norm()});
  return one.cross(other).norm() <= kInLine * longest * longest;
}

bool LoadShares::spread(SolverBodies& bodies, JointBlocks& blocks, double tolerance) {
  bool any = false;
  for (size_t i = 0; i + 2 < bearings_.size(); ++i) {
    if (bearings_[i].taken) continue;
    gather(i);
    if (!has_more_than_it_needs() || group_.size() > kMost) continue;
    blocks.tell_responses(rows_, responses_);
    weigh();
    any |= share(bodies, tolerance);
  }
  return any;
}

// least_: the smallest loads that move the bodies like loads_. Contacts without load are excluded.
void LoadShares::least() {
  const size_t n = rows_.size();
  const auto times = [&](const std::vector<double>& x, size_t i) {
    double sum = 0.0;
    for (size_t j = 0; j < n; ++j) sum += response(i, j) * x[j];
    return bears_[i] ? sum : 0.0;
  };
  const auto square = [&](const std::vector<double>& x) {
    double sum = 0.0;
    for (size_t i = 0; i < n; ++i) sum += x[i] * x[i];
    return sum;
  };
  least_.assign(n, 0.0);
  residual_.resize(n);
  along_.resize(n);
  for (size_t i = 0; i < n; ++i) residual_[i] = times(loads_, i);
  heading_ = residual_;
  const double start = square(residual_);
  double left = start;
  constexpr double kNothing = 1e-24;  // for a squared quantity
  for (size_t k = 0; k < 2 * n && left > kNothing * start; ++k) {
    double curvature = 0.0;
    for (size_t i = 0; i < n; ++i) {
      along_[i] = times(heading_, i);
      curvature += heading_[i] * along_[i];
    }
    if (!(curvature > 0.0)) return;
    const double step = left / curvature;
    for (size_t i = 0; i < n; ++i) {
      least_[i] += step * heading_[i];
      residual_[i] -= step * along_[i];
    }
    const double before = std::exchange(left, square(residual_));
    for (size_t i = 0; i < n; ++i) heading_[i] = residual_[i] + left / before * heading_[i];
  }
}

// How far loads_ can move towards least_ until a contact would pull.
double LoadShares::to_the_first_zero() const {
  double part = 1.0;
  for (size_t i = 0; i < loads_.size(); ++i)
    if (bears_[i] && least_[i] < 0.0) part = std::min(part, loads_[i] / (loads_[i] - least_[i]));
  return part;
}

bool LoadShares::share(SolverBodies& bodies, double tolerance) {
  const size_t n = rows_.size();
  loads_.resize(n);
  bears_.assign(n, 1);
  for (size_t i = 0; i < n; ++i) loads_[i] = std::max(rows_[i]->impulse, 0.0) / units_[i];
  for (size_t round = 0; round < n; ++round) {
    least();
    const double part = to_the_first_zero();
    for (size_t i = 0; i < n; ++i) {
      if (!bears_[i]) continue;
      const bool ends = least_[i] < 0.0 && loads_[i] <= part * (loads_[i] - least_[i]);
      loads_[i] = ends ? 0.0 : loads_[i] + part * (least_[i] - loads_[i]);
      bears_[i] = !ends;
    }
    if (part == 1.0) break;
  }
  double change = 0.0;
  for (size_t i = 0; i < n; ++i) {
    const double more = loads_[i] - rows_[i]->impulse / units_[i];
    change = std::max(change, std::abs(more) * response(i, i) / units_[i]);
  }
  if (change <= tolerance) return false;
  for (size_t i = 0; i < n; ++i) {
    rows_[i]->give(bodies, units_[i] * loads_[i] - rows_[i]->impulse);
    rows_[i]->target = std::max(rows_[i]->target, 0.0);
  }
  return true;
}

}  // namespace ruedo::physics
