#include "physics/base/sparse_matrix.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace ruedo::physics {

namespace {

using Block = SparseMatrix::Block;
using Six = SparseMatrix::Six;

constexpr size_t kBits = 64;  // of a word

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
SparseMatrix::SparseMatrix() {
  constexpr size_t kBodies = 8, kBlocks = kBodies * (kBodies + 1) / 2;
  places_.reserve(kBodies);
  movable_.reserve(kBodies);
  order_.reserve(kBodies);
  coupled_.reserve(kBodies);
  degree_.reserve(kBodies);
  first_.reserve(kBodies + 1);
  rows_.reserve(kBlocks);
  blocks_.reserve(kBlocks);
}

double SparseMatrix::prepare(const std::vector<char>& takes_part,
                             const std::vector<std::pair<int, int>>& pairs) {
  couple(takes_part, pairs);
  put_in_order();
  double products = 0.0;
  for (size_t j = 0; j < order_.size(); ++j) {
    const double blocks = static_cast<double>(first_[j + 1] - first_[j]);
    products += 216.0 * blocks * blocks;
  }
  return products;
}

void SparseMatrix::couple(const std::vector<char>& takes_part,
                          const std::vector<std::pair<int, int>>& pairs) {
  places_.assign(takes_part.size(), {});
  movable_.clear();
  for (size_t i = 0; i < takes_part.size(); ++i) {
    if (!takes_part[i]) continue;
    places_[static_cast<int>(i)] = PlaceIndex(movable_.size());  // its number in movable_, for now
    movable_.push_back(static_cast<int>(i));
  }
  words_ = (movable_.size() + kBits - 1) / kBits;
  coupled_.assign(movable_.size() * words_, 0);
  for (const auto& [a, b] : pairs) {
    const PlaceIndex p = places_[a], q = places_[b];
    if (!p.valid() || !q.valid() || p == q) continue;
    for (const auto& [from, to] : {std::pair<size_t, size_t>(p, q), {q, p}})
      coupled_[from * words_ + to / kBits] |= uint64_t{1} << to % kBits;
  }
  degree_.assign(movable_.size(), 0);
  for (size_t i = 0; i < coupled_.size(); ++i) degree_[i / words_] += std::popcount(coupled_[i]);
}

void SparseMatrix::put_in_order() {
  order_.clear();
  rows_.clear();
  first_.clear();
  for (size_t place = 0; place < movable_.size(); ++place) {
    size_t next = movable_.size();
    for (size_t i = 0; i < movable_.size(); ++i)
      if (degree_[i] >= 0 && (next == movable_.size() || degree_[i] < degree_[next])) next = i;
    first_.push_back(rows_.size());
    rows_.push_back(static_cast<int>(next));
    eliminate(next);
    order_.push_back(movable_[next]);
  }
  first_.push_back(rows_.size());
  for (size_t place = 0; place < order_.size(); ++place) places_[order_[place]] = PlaceIndex(place);
  for (int& row : rows_) row = places_[movable_[static_cast<size_t>(row)]];
  for (size_t j = 0; j < order_.size(); ++j)
    std::sort(rows_.begin() + static_cast<std::ptrdiff_t>(first_[j]),
              rows_.begin() + static_cast<std::ptrdiff_t>(first_[j + 1]));
  blocks_.resize(rows_.size());
}

// Adds its rows to the last column; they are coupled with each other from then on.
void SparseMatrix::eliminate(size_t body) {
  const auto of_body = coupled_.begin() + static_cast<std::ptrdiff_t>(body * words_);
  for (size_t word = 0; word < words_; ++word) {
    for (uint64_t bits = of_body[static_cast<std::ptrdiff_t>(word)]; bits != 0; bits &= bits - 1) {
      const size_t other = word * kBits + static_cast<size_t>(std::countr_zero(bits));
      rows_.push_back(static_cast<int>(other));
      uint64_t* const of_other = &coupled_[other * words_];
      int degree = 0;
      for (size_t i = 0; i < words_; ++i) {
        of_other[i] |= of_body[static_cast<std::ptrdiff_t>(i)];
        if (i == body / kBits) of_other[i] &= ~(uint64_t{1} << body % kBits);
        if (i == other / kBits) of_other[i] &= ~(uint64_t{1} << other % kBits);
        degree += std::popcount(of_other[i]);
      }
      degree_[other] = degree;
    }
  }
  degree_[body] = -1;
}

void SparseMatrix::set_identity() {
  for (Block& block : blocks_) block.setZero();
  for (size_t j = 0; j < order_.size(); ++j) blocks_[first_[j]].setIdentity();
}

SparseMatrix::Block& SparseMatrix::block(int row, int column) {
  if (row == column) return blocks_[first_[column]];
  const auto begin = rows_.begin() + static_cast<std::ptrdiff_t>(first_[column]),
             end = rows_.begin() + static_cast<std::ptrdiff_t>(first_[column + 1]);
  return blocks_[static_cast<size_t>(std::lower_bound(begin, end, row) - rows_.begin())];
}

void SparseMatrix::factor() {
  for (size_t j = 0; j < order_.size(); ++j) {
    const size_t begin = first_[j], end = first_[j + 1];
    factor_in_place(blocks_[begin]);
    for (size_t p = begin + 1; p < end; ++p) divide_by_transpose(blocks_[p], blocks_[begin]);
    for (size_t p = begin + 1; p < end; ++p) {
      size_t at = first_[rows_[p]];  // its column has all of these rows
      for (size_t q = p; q < end; ++q) {
        while (rows_[at] != rows_[q]) ++at;
        subtract_product(blocks_[at], blocks_[q], blocks_[p]);
      }
    }
  }
}

void SparseMatrix::solve(std::vector<Six>& x) {
  for (size_t j = 0; j < order_.size(); ++j) {
    divide(x[j], blocks_[first_[j]]);
    for (size_t p = first_[j] + 1; p < first_[j + 1]; ++p)
      x[rows_[p]] -= blocks_[p].lazyProduct(x[j]);
  }
  for (size_t j = order_.size(); j-- > 0;) {
    for (size_t p = first_[j] + 1; p < first_[j + 1]; ++p)
      x[j] -= blocks_[p].transpose().lazyProduct(x[rows_[p]]);
    divide_transposed(x[j], blocks_[first_[j]]);
  }
}

}  // namespace ruedo::physics
