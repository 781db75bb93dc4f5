#include "physics/base/reduced_matrix.h"

#include <algorithm>

namespace ruedo::physics {

namespace {

using Block = NewtonMatrix::Block;
using Six = NewtonMatrix::Six;

// In columns of fixed size, which compilers vectorize.
Six product(const Block& A, const Six& x) {
  Six sum = x[0] * A.col(0);
  for (int k = 1; k < 6; ++k) sum += x[k] * A.col(k);
  return sum;
}

Six transposed_product(const Block& A, const Six& x) {
  Six result;
  for (int k = 0; k < 6; ++k) result[k] = A.col(k).dot(x);
  return result;
}

}  // namespace

// Capacity for usual mechanisms is reserved: steady runs do not allocate.
ReducedMatrix::ReducedMatrix() {
  constexpr size_t kBodies = 8, kWays = 16;
  places_.reserve(kBodies);
  members_.reserve(kBodies);
  sums_.reserve(kBodies);
  blocks_.reserve(spot(kBodies, 0));
  used_.reserve(spot(kBodies, 0));
  along_.reserve(kWays);
  live_.reserve(kBodies);
  blocks_of_member_.reserve(kBodies);
  stiffness_.reserve(kWays);
  rates_.reserve(kWays);
  inverses_.reserve(kWays);
  reaches_.reserve(kWays);
  matrix_.reserve(spot(kWays, 0));
  masses_.reserve(spot(kWays, 0));
}

void ReducedMatrix::begin(size_t bodies) {
  places_.assign(bodies, {});
  members_.clear();
  along_.clear();
}

void ReducedMatrix::add(int body, int on, const Block& scale) {
  places_[body] = PlaceIndex(members_.size());
  Member& m = members_.emplace_back();
  m.body = body;
  m.parent = places_[on].valid() ? static_cast<size_t>(places_[on]) : kNone;
  m.first = along_.size();
  m.scale = scale;
  m.inertia = scale.transpose().lazyProduct(scale);
}

void ReducedMatrix::add_way(const Six& along) { along_.push_back(along); }

void ReducedMatrix::prepare() {
  blocks_.resize(spot(members_.size(), 0));
  used_.resize(blocks_.size());
  set_identity();
  factor();
  masses_ = matrix_;
  find_responses();
}

// Articulated inertias from the leaves, and their responses from the roots (R. Featherstone,
// chapter 7).
void ReducedMatrix::find_responses() {
  blocks_of_member_.assign(members_.size(), Block::Zero());  // twist to momentum
  reaches_.resize(along_.size());
  inverses_.resize(along_.size());
  for (size_t i = members_.size(); i-- > 0;) {
    const Member& m = members_[i];
    Block left = blocks_of_member_[i];
    left += m.inertia;
    for (size_t k = m.first; k < end_of(i); ++k) {
      reaches_[k] = product(left, along_[k]);
      inverses_[k] = 1.0 / along_[k].dot(reaches_[k]);
      left -= (inverses_[k] * reaches_[k]) * reaches_[k].transpose();
    }
    if (m.parent != kNone) blocks_of_member_[m.parent] += left;
  }
  for (size_t i = 0; i < members_.size(); ++i) {
    Member& m = members_[i];
    Block yields = Block::Zero(), follows = Block::Zero();
    if (m.parent != kNone) yields = follows = blocks_of_member_[m.parent];
    for (size_t k = end_of(i); k-- > m.first;) {
      const Six part = inverses_[k] * reaches_[k];
      follows -= along_[k] * transposed_product(follows, part).transpose();
      yields -= along_[k] * transposed_product(yields, part).transpose();
      yields -= product(yields, part) * along_[k].transpose();
      yields += inverses_[k] * along_[k] * along_[k].transpose();
    }
    blocks_of_member_[i] = yields;
    m.yields = m.scale.lazyProduct(yields.lazyProduct(m.scale.transpose()).eval());
    if (m.parent != kNone)
      m.follows =
          m.scale.lazyProduct(follows.lazyProduct(members_[m.parent].scale.transpose()).eval());
  }
}

// Of bodies of one tree that are not neighbours, the sum of both: it is at least half of the right
// response.
double ReducedMatrix::response(PlaceIndex a, const Six& J_a, PlaceIndex b, const Six& J_b) const {
  double sum = 0.0;
  if (a.valid()) sum += J_a.dot(product(members_[a].yields, J_a));
  if (b.valid()) sum += J_b.dot(product(members_[b].yields, J_b));
  if (!a.valid() || !b.valid()) return sum;
  const size_t place_a = static_cast<size_t>(a), place_b = static_cast<size_t>(b);
  if (members_[a].parent == place_b) sum += 2.0 * J_a.dot(product(members_[a].follows, J_b));
  if (members_[b].parent == place_a) sum += 2.0 * J_b.dot(product(members_[b].follows, J_a));
  return sum;
}

void ReducedMatrix::set_identity() {
  std::fill(used_.begin(), used_.end(), 0);
  for (size_t i = 0; i < members_.size(); ++i) {
    used_[spot(i, i)] = 1;
    blocks_[spot(i, i)] = members_[i].inertia;
  }
  stiffness_.assign(along_.size(), 0.0);
}

size_t ReducedMatrix::way_between(PlaceIndex a, PlaceIndex b) const {
  for (const auto& [child, other] : {std::pair(a, b), std::pair(b, a)}) {
    if (!child.valid()) continue;
    const size_t i = static_cast<size_t>(child), parent = members_[i].parent;
    const bool hangs = other.valid() ? parent == static_cast<size_t>(other) : parent == kNone;
    if (hangs) return end_of(i) == members_[i].first + 1 ? members_[i].first : kNone;
  }
  return kNone;
}

double ReducedMatrix::along(size_t way, PlaceIndex body, const Six& J) const {
  return J.dot(product(members_[body].scale, along_[way]));
}

Block& ReducedMatrix::block(int row, int column) {
  const size_t i = spot(static_cast<size_t>(row), static_cast<size_t>(column));
  if (!used_[i]) {
    used_[i] = 1;
    blocks_[i].setZero();
  }
  return blocks_[i];
}

// The entries of a way in the matrix, with all ways before it.
void ReducedMatrix::write_way(size_t member, size_t way) {
  const size_t first = spot(member, 0);
  std::copy_n(&used_[first], member + 1, live_.begin());
  for (size_t j = 0; j <= member; ++j)
    if (live_[j]) sums_[j] = transposed_product(blocks_[first + j], along_[way]);
  double* row = &matrix_[spot(way, 0)];
  std::fill_n(row, way + 1, 0.0);
  for (size_t j = member + 1; j-- > 0;) {
    if (!live_[j]) continue;
    const size_t end = std::min(end_of(j), way + 1), parent = members_[j].parent;
    for (size_t k = members_[j].first; k < end; ++k) row[k] = sums_[j].dot(along_[k]);
    if (parent == kNone) continue;
    sums_[parent] = live_[parent] ? Six(sums_[parent] + sums_[j]) : sums_[j];
    live_[parent] = 1;
  }
  row[way] += stiffness_[way];
}

// Adds the last member to that on which it hangs.
void ReducedMatrix::fold(size_t member) {
  const size_t parent = members_[member].parent;
  if (parent == kNone) return;
  for (size_t j = 0; j <= member; ++j) {
    if (!used_[spot(member, j)]) continue;
    const Block& of = blocks_[spot(member, j)];
    const int p = static_cast<int>(parent), c = static_cast<int>(j);
    if (j == member)
      block(p, p) += of;
    else if (j == parent)
      block(p, p) += of + of.transpose();
    else if (j < parent)
      block(p, c) += of;
    else
      block(c, p) += of.transpose();
  }
}

void ReducedMatrix::factor() {
  live_.resize(members_.size());
  matrix_.resize(spot(along_.size(), 0));
  sums_.resize(members_.size());
  for (size_t i = members_.size(); i-- > 0;) {
    for (size_t k = members_[i].first; k < end_of(i); ++k) write_way(i, k);
    fold(i);
  }
  factor(matrix_);
}

// From the last way to the first. Below the diagonal are then the rows of L times D.
void ReducedMatrix::factor(std::vector<double>& matrix) const {
  for (size_t k = along_.size(); k-- > 0;) {
    const double* of_k = &matrix[spot(k, 0)];
    const double inverse = 1.0 / of_k[k];
    for (size_t i = 0; i < k; ++i) {
      if (of_k[i] == 0.0) continue;
      const double part = of_k[i] * inverse;
      double* of_i = &matrix[spot(i, 0)];
      for (size_t j = 0; j <= i; ++j) of_i[j] -= part * of_k[j];
    }
  }
}

void ReducedMatrix::solve(const std::vector<double>& matrix, std::vector<Six>& x) {
  const size_t n = along_.size();
  rates_.resize(n);
  for (size_t i = 0; i < members_.size(); ++i)
    sums_[i] = transposed_product(members_[i].scale, x[i]);
  for (size_t i = members_.size(); i-- > 0;) {
    for (size_t k = members_[i].first; k < end_of(i); ++k) rates_[k] = along_[k].dot(sums_[i]);
    if (members_[i].parent != kNone) sums_[members_[i].parent] += sums_[i];
  }
  for (size_t k = n; k-- > 0;) {
    const double* of_k = &matrix[spot(k, 0)];
    rates_[k] /= of_k[k];
    for (size_t i = 0; i < k; ++i) rates_[i] -= of_k[i] * rates_[k];
  }
  for (size_t k = 0; k < n; ++k) {
    const double* of_k = &matrix[spot(k, 0)];
    double sum = 0.0;
    for (size_t i = 0; i < k; ++i) sum += of_k[i] * rates_[i];
    rates_[k] -= sum / of_k[k];
  }
  for (size_t i = 0; i < members_.size(); ++i) {
    const Member& m = members_[i];
    sums_[i] = m.parent != kNone ? sums_[m.parent] : Six(Six::Zero());
    for (size_t k = m.first; k < end_of(i); ++k) sums_[i] += rates_[k] * along_[k];
    x[i] = product(m.scale, sums_[i]);
  }
}

}  // namespace ruedo::physics
