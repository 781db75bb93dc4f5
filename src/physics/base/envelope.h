// A symmetric positive definite matrix of blocks of 6 x 6, one for each pair of coupled bodies, and
// its Cholesky factor. Bodies are ordered by the Cuthill-McKee algorithm, so that the matrix has a
// narrow band for stacks, walls and chains; its envelope is factored (A. George, J. Liu, "Computer
// Solution of Large Sparse Positive Definite Systems", 1981, chapter 4).
#pragma once

#include <utility>
#include <vector>

#include "physics/base/newton_matrix.h"

namespace ruedo::physics {

class Envelope final : public NewtonMatrix {
 public:
  Envelope();

  // Orders bodies 0 .. takes_part.size() - 1, of which those that take part are coupled by pairs.
  // Returns the cost of a factorization, in multiplications.
  double prepare(const std::vector<char>& takes_part,
                 const std::vector<std::pair<int, int>>& pairs);

  PlaceIndex place(int body) const override { return places_[body]; }
  size_t size() const override { return order_.size(); }
  int body(size_t place) const override { return order_[place]; }
  void set_identity() override;
  Block& block(int row, int column) override {
    return blocks_[start_[row] + static_cast<size_t>(column - first_[row])];
  }
  void factor() override;
  void solve(std::vector<Six>& x) override;
  void project(std::vector<Six>&) override {}  // all is allowed

 private:
  void put_in_order(const std::vector<char>& takes_part,
                    const std::vector<std::pair<int, int>>& pairs);
  void list_neighbours(const std::vector<char>& takes_part,
                       const std::vector<std::pair<int, int>>& pairs);
  void lay_out(const std::vector<std::pair<int, int>>& pairs);

  std::vector<PlaceIndex> places_;
  std::vector<int> movable_, degree_, order_;  // bodies; order_: by place
  std::vector<size_t> first_neighbour_;
  std::vector<int> neighbours_;
  std::vector<int> first_;     // for each place, the first one that its blocks reach
  std::vector<size_t> start_;  // for each place, its blocks in blocks_
  std::vector<Block> blocks_;
};

}  // namespace ruedo::physics
