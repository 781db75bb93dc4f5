#include "physics/base/envelope.h"

#include <algorithm>
#include <cmath>

namespace ruedo::physics {

namespace {

using Block = Envelope::Block;
using Six = Envelope::Six;

// In columns of fixed size, which compilers vectorize; Eigen's own products of this size do not
// pay. C -= A B^T
void subtract_product(Block& C, const Block& A, const Block& B) {
  for (int j = 0; j < 6; ++j) {
    Six column = C.col(j);
    for (int k = 0; k < 6; ++k) column -= B(j, k) * A.col(k);
    C.col(j) = column;
  }
}

// The Cholesky factor L of A, in its lower triangle.
void factor_in_place(Block& A) {
  for (int j = 0; j < 6; ++j) {
    Six column = A.col(j);
    for (int k = 0; k < j; ++k) column -= A(j, k) * A.col(k);
    A.col(j) = column / std::sqrt(column[j]);
  }
}

// X = X L^-T
void divide_by_transpose(Block& X, const Block& L) {
  for (int j = 0; j < 6; ++j) {
    Six column = X.col(j);
    for (int k = 0; k < j; ++k) column -= L(j, k) * X.col(k);
    X.col(j) = column / L(j, j);
  }
}

// x = L^-1 x
void divide(Six& x, const Block& L) {
  for (int j = 0; j < 6; ++j) {
    x[j] /= L(j, j);
    for (int i = j + 1; i < 6; ++i) x[i] -= x[j] * L(i, j);
  }
}

// x = L^-T x
void divide_transposed(Six& x, const Block& L) {
  for (int j = 6; j-- > 0;) {
    for (int i = j + 1; i < 6; ++i) x[j] -= x[i] * L(i, j);
    x[j] /= L(j, j);
  }
}

}  // namespace

// Capacity for usual islands is reserved: steady runs do not allocate.
Envelope::Envelope() {
  constexpr size_t kBodies = 8, kNeighbours = 64;
  places_.reserve(kBodies);
  movable_.reserve(kBodies);
  degree_.reserve(kBodies);
  order_.reserve(kBodies);
  first_neighbour_.reserve(kBodies + 1);
  neighbours_.reserve(kNeighbours);
  first_.reserve(kBodies);
  start_.reserve(kBodies);
  blocks_.reserve(kBodies * (kBodies + 1) / 2);
}

double Envelope::prepare(const std::vector<char>& takes_part,
                         const std::vector<std::pair<int, int>>& pairs) {
  put_in_order(takes_part, pairs);
  lay_out(pairs);
  double products = 0.0;
  for (size_t i = 0; i < first_.size(); ++i) {
    const double wide = static_cast<double>(static_cast<int>(i) - first_[i]) + 1.0;
    products += 216.0 * wide * wide;
  }
  return products;
}

void Envelope::list_neighbours(const std::vector<char>& takes_part,
                               const std::vector<std::pair<int, int>>& pairs) {
  const size_t bodies = takes_part.size();
  first_neighbour_.assign(bodies + 1, 0);
  for (const auto& [a, b] : pairs) {
    if (!takes_part[a] || !takes_part[b]) continue;
    ++first_neighbour_[static_cast<size_t>(a) + 1];
    ++first_neighbour_[static_cast<size_t>(b) + 1];
  }
  for (size_t i = 0; i < bodies; ++i) first_neighbour_[i + 1] += first_neighbour_[i];
  neighbours_.resize(first_neighbour_.back());
  degree_.assign(bodies, 0);
  for (const auto& [a, b] : pairs) {
    if (!takes_part[a] || !takes_part[b]) continue;
    for (const auto& [from, to] : {std::pair(a, b), std::pair(b, a)}) {
      const size_t i = static_cast<size_t>(from);
      neighbours_[first_neighbour_[i] + static_cast<size_t>(degree_[i]++)] = to;
    }
  }
}

// Breadth-first from a body with few neighbours; then reversed.
void Envelope::put_in_order(const std::vector<char>& takes_part,
                            const std::vector<std::pair<int, int>>& pairs) {
  list_neighbours(takes_part, pairs);
  places_.assign(takes_part.size(), {});
  movable_.clear();
  for (size_t i = 0; i < takes_part.size(); ++i)
    if (takes_part[i]) movable_.push_back(static_cast<int>(i));
  const auto fewer = [&](int a, int b) {
    return std::pair(degree_[a], a) < std::pair(degree_[b], b);
  };
  std::sort(movable_.begin(), movable_.end(), fewer);
  order_.clear();
  const auto visit = [&](int body) {
    PlaceIndex& place = places_[body];
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
  for (size_t i = 0; i < order_.size(); ++i) places_[order_[i]] = PlaceIndex(i);
}

void Envelope::lay_out(const std::vector<std::pair<int, int>>& pairs) {
  first_.resize(order_.size());
  for (size_t i = 0; i < first_.size(); ++i) first_[i] = static_cast<int>(i);
  for (const auto& [a, b] : pairs) {
    const PlaceIndex p = places_[a], q = places_[b];
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

void Envelope::set_identity() {
  for (int i = 0; i < static_cast<int>(first_.size()); ++i) {
    for (int j = first_[i]; j < i; ++j) block(i, j).setZero();
    block(i, i).setIdentity();
  }
}

void Envelope::factor() {
  for (int i = 0; i < static_cast<int>(first_.size()); ++i) {
    const int first = first_[i];
    Block& own = block(i, i);
    for (int j = first; j < i; ++j) {
      Block& of_j = block(i, j);
      for (int k = std::max(first, first_[j]); k < j; ++k)
        subtract_product(of_j, block(i, k), block(j, k));
      divide_by_transpose(of_j, block(j, j));
      subtract_product(own, of_j, of_j);
    }
    factor_in_place(own);
  }
}

void Envelope::solve(std::vector<Six>& x) {
  const int n = static_cast<int>(first_.size());
  for (int i = 0; i < n; ++i) {
    for (int j = first_[i]; j < i; ++j) x[i] -= block(i, j).lazyProduct(x[j]);
    divide(x[i], block(i, i));
  }
  for (int i = n; i-- > 0;) {
    divide_transposed(x[i], block(i, i));
    for (int j = first_[i]; j < i; ++j) x[j] -= block(i, j).transpose().lazyProduct(x[i]);
  }
}

}  // namespace ruedo::physics
