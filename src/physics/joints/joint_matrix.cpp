// Mechanisms whose joints close loops: the matrix of their rows' responses, and its factor.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "physics/joints/joint_block.h"

namespace ruedo::physics {

namespace {

// relative to the diagonal: loops of joints contain redundant rows
constexpr double kRegular = 1e-10;
constexpr double kIndependent = 1e-6;  // part of a row's response that is independent of the others

}  // namespace

// The joints of a chain are consecutive, and each is coupled to its neighbours only: the matrix is
// banded, and so is its Cholesky factor.
void JointBlocks::find_envelope(Block& block) {
  constexpr size_t kNone = static_cast<size_t>(-1);
  const size_t n = block.free.size();
  block.begin.resize(n);
  for (const size_t i : block.free) {
    for_each_body(i, [&](int body) {
      if (first_of_body_.size() <= static_cast<size_t>(body))
        first_of_body_.resize(static_cast<size_t>(body) + 1);
      first_of_body_[body] = kNone;
    });
  }
  for (size_t i = 0; i < n; ++i) {
    block.begin[i] = i;
    for_each_body(block.free[i], [&](int body) {
      if (body == 0) return;  // immovable
      size_t& first = first_of_body_[body];
      if (first == kNone) first = i;
      block.begin[i] = std::min(block.begin[i], first);
    });
  }
  block.end.resize(n);
  std::iota(block.end.begin(), block.end.end(), size_t{0});
  for (size_t i = 0; i < n; ++i) block.end[block.begin[i]] = i;
  for (size_t j = 1; j < n; ++j) block.end[j] = std::max(block.end[j], block.end[j - 1]);
}

void JointBlocks::write_matrix(Block& block) {
  const size_t n = block.free.size();
  block.factor.resize(n * n);
  for (size_t j = 0; j < n; ++j) {
    double* of_j = &block.factor[j * n];
    const Row& row = rows_[block.free[j]];
    of_j[j] = row.response * (1.0 + kRegular) + row.softness;
    for (size_t i = j + 1; i <= block.end[j]; ++i)
      of_j[i] = block.begin[i] > j ? 0.0
                : thirds_.empty()  ? row.coupling(rows_[block.free[i]])
                                   : coupling(block.free[i], block.free[j]);
  }
}

// Right-looking: each pivot is subtracted at once from the rows it reaches, so that no sum waits
// for another.
void JointBlocks::factor_matrix(Block& block) {
  find_envelope(block);
  write_matrix(block);
  const size_t n = block.free.size();
  block.inverse.resize(n);
  block.exact = true;
  for (size_t j = 0; j < n; ++j) {
    double* of_j = &block.factor[j * n];
    const double response = rows_[block.free[j]].response;
    block.exact = block.exact && of_j[j] > kIndependent * response;
    of_j[j] = std::max(of_j[j], 1e-300 + kRegular * response);
    block.inverse[j] = 1.0 / of_j[j];
    const size_t end = block.end[j];
    for (size_t i = j + 1; i <= end; ++i) {
      if (of_j[i] == 0.0) continue;
      const double part = of_j[i] * block.inverse[j];
      double* of_i = &block.factor[i * n];
      for (size_t k = i; k <= end; ++k) of_i[k] -= part * of_j[k];
    }
  }
}

void JointBlocks::solve_lower(const Block& block, double* x) const {
  const size_t n = block.free.size();
  for (size_t j = 0; j < n; ++j) {
    const double* of_j = &block.factor[j * n];
    const double part = x[j] * block.inverse[j];
    for (size_t i = j + 1; i <= block.end[j]; ++i) x[i] -= part * of_j[i];
  }
}

// C^T K^-1 C, where K = L D L^T is the response of the rows and C their coupling to the contacts.
void JointBlocks::take_off_held(const Block& block, const std::vector<Row*>& contacts,
                                std::vector<double>& responses) {
  const size_t n = contacts.size(), m = block.free.size();
  held_.resize(n * m);
  bool any = false;
  for (size_t i = 0; i < n; ++i) {
    double* of_i = &held_[i * m];
    for (size_t k = 0; k < m; ++k) {
      of_i[k] = coupling(block.free[k], *contacts[i]);
      any |= of_i[k] != 0.0;
    }
  }
  if (!any) return;
  for (size_t i = 0; i < n; ++i) {
    solve_lower(block, &held_[i * m]);
    for (size_t j = 0; j <= i; ++j) {
      for (size_t k = 0; k < m; ++k)
        responses[i * n + j] -= held_[i * m + k] * held_[j * m + k] * block.inverse[k];
    }
  }
}

}  // namespace ruedo::physics
