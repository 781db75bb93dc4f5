// The matrix of Newton's method for bodies of which joints allow only some velocities: those of
// trees of joints, in reduced coordinates. A body's velocity is the sum of the rates of the ways
// from the root to it, each times the twist that it makes; the matrix has a row for each way.
//
// Blocks are added as if all bodies were free, and summed up from the leaves to the root like
// composite inertias (R. Featherstone, "Rigid Body Dynamics Algorithms", 2008, chapter 6); where
// branches do not touch, the factor keeps the zeros between them (chapter 6.5: elimination from the
// leaves).
#pragma once

#include <vector>

#include "physics/base/newton_matrix.h"

namespace ruedo::physics {

class ReducedMatrix final : public NewtonMatrix {
 public:
  ReducedMatrix();

  void begin(size_t bodies);
  // Adds a body, after that on which it hangs (one that is not added: it hangs on none). Its twist
  // is the twist of that body, plus those of its own ways. scale: from the twist to the body's six
  // velocities of the matrix.
  void add(int body, int on, const Block& scale);
  void add_way(const Six& along);
  // To be called after all are added.
  void prepare();
  size_t ways() const { return along_.size(); }

  PlaceIndex place(int body) const override { return places_[body]; }
  size_t size() const override { return members_.size(); }
  int body(size_t place) const override { return members_[place].body; }
  void set_identity() override;
  Block& block(int row, int column) override;
  void factor() override;
  void solve(std::vector<Six>& x) override { solve(matrix_, x); }
  void project(std::vector<Six>& x) override { solve(masses_, x); }

 private:
  static constexpr size_t kNone = static_cast<size_t>(-1);
  struct Member {
    int body = 0;
    size_t parent = kNone;  // place
    size_t first = 0;       // way
    Block scale;
  };
  size_t end_of(size_t member) const {
    return member + 1 < members_.size() ? members_[member + 1].first : along_.size();
  }
  static size_t spot(size_t row, size_t column) { return row * (row + 1) / 2 + column; }
  void unscale();
  void write_way(size_t member, size_t way);
  void fold(size_t member);
  void factor(std::vector<double>& matrix) const;
  void solve(const std::vector<double>& matrix, std::vector<Six>& x);

  std::vector<PlaceIndex> places_;
  std::vector<Member> members_;
  std::vector<Six> along_;
  std::vector<Block> blocks_;  // lower triangle, by rows
  std::vector<char> used_;     // of them; others are not set
  // By ways, lower triangle: L^T D L.
  std::vector<double> matrix_, masses_;
  std::vector<Six> sums_;      // scratch: by place
  std::vector<double> rates_;  // scratch: by way
};

}  // namespace ruedo::physics
