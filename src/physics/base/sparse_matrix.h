// A symmetric positive definite matrix of blocks of 6 x 6, one for each pair of coupled bodies, and
// its sparse Cholesky factor. The next body in the order is always one that is coupled with the
// fewest of those to come, so that few blocks are added (A. George, J. Liu, "The evolution of the
// minimum degree ordering algorithm", 1989).
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "physics/base/newton_matrix.h"

namespace ruedo::physics {

class SparseMatrix final : public NewtonMatrix {
 public:
  SparseMatrix();

  // Orders bodies 0 .. takes_part.size() - 1, of which those that take part are coupled by pairs.
  // Returns the cost of a factorization, in multiplications.
  double prepare(const std::vector<char>& takes_part,
                 const std::vector<std::pair<int, int>>& pairs);

  PlaceIndex place(int body) const override { return places_[body]; }
  size_t size() const override { return order_.size(); }
  int body(size_t place) const override { return order_[place]; }
  void set_identity() override;
  Block& block(int row, int column) override;
  void factor() override;
  void solve(std::vector<Six>& x) override;
  void project(std::vector<Six>&) override {}  // all is allowed

 private:
  void couple(const std::vector<char>& takes_part, const std::vector<std::pair<int, int>>& pairs);
  void put_in_order();
  void eliminate(size_t body);

  std::vector<PlaceIndex> places_;
  std::vector<int> movable_, order_;  // bodies; order_: by place
  // Of movable_: a bit for each that it is coupled with, of those that have no place yet, and how
  // many these are; -1: it has a place.
  std::vector<uint64_t> coupled_;
  size_t words_ = 0;  // of coupled_, for each body
  std::vector<int> degree_;
  std::vector<size_t> first_;  // for each column its first block, which is on the diagonal
  std::vector<int> rows_;      // of each block, ascending in a column
  std::vector<Block> blocks_;
};

}  // namespace ruedo::physics
