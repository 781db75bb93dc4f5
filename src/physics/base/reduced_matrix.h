// The matrix of Newton's method for bodies of which joints allow only some velocities: those of
// trees of joints, in reduced coordinates. A body's velocity is the sum of the rates of the ways
// from the root to it, each times the twist that it makes; the matrix has a row for each way.
//
// Blocks, of twists, are added as if all bodies were free, and summed up from the leaves to the
// root like composite inertias (R. Featherstone, "Rigid Body Dynamics Algorithms", 2008, chapter
// 6); where branches do not touch, the factor keeps the zeros between them (chapter 6.5:
// elimination from the leaves).
#pragma once

#include <vector>

#include "physics/base/newton_matrix.h"

namespace ruedo::physics {

class ReducedMatrix final : public NewtonMatrix {
 public:
  static constexpr size_t kNone = static_cast<size_t>(-1);

  ReducedMatrix();

  void begin(size_t bodies);
  // Adds a body, after that on which it hangs (one that is not added: it hangs on none). Its twist
  // is the twist of that body, plus those of its own ways. scale: from the twist to the body's six
  // velocities of the matrix.
  void add(int body, int on, const Block& scale);
  void add_way(const Six& along);
  // To be called after all are added.
  void prepare();
  // The change of a row's velocity for a unit of its impulse, with all that hangs on its bodies.
  double response(PlaceIndex a, const Six& J_a, PlaceIndex b, const Six& J_b) const;
  size_t ways() const { return along_.size(); }
  const Block& scale(PlaceIndex place) const { return members_[place].scale; }
  // The only way in which one of two bodies moves relative to the other; kNone: there is none, or
  // several.
  size_t way_between(PlaceIndex a, PlaceIndex b) const;
  // Whether it is one of that body's own.
  bool moves(size_t way, PlaceIndex body) const {
    return body.valid() && members_[body].first <= way && way < end_of(static_cast<size_t>(body));
  }
  // The force along a way that a row has on a body, for a unit of impulse.
  double along(size_t way, PlaceIndex body, const Six& J) const;
  // Adds to the matrix, for one way.
  void stiffen(size_t way, double by) { stiffness_[way] += by; }

  PlaceIndex place(int body) const override { return places_[body]; }
  size_t size() const override { return members_.size(); }
  int body(size_t place) const override { return members_[place].body; }
  void set_identity() override;
  Block& block(int row, int column) override;
  void factor() override;
  void solve(std::vector<Six>& x) override { solve(matrix_, x); }
  void project(std::vector<Six>& x) override { solve(masses_, x); }

 private:
  struct Member {
    int body = 0;
    size_t parent = kNone;  // place
    size_t first = 0;       // way
    Block scale, inertia;   // of the twist
    // Without blocks, in the scale of the matrix: the inverse inertia of the body, with all that
    // hangs on it and on which it hangs; and the velocity of the body for an impulse on its parent.
    Block yields, follows;
  };
  size_t end_of(size_t member) const {
    return member + 1 < members_.size() ? members_[member + 1].first : along_.size();
  }
  static size_t spot(size_t row, size_t column) { return row * (row + 1) / 2 + column; }
  void find_responses();
  void write_way(size_t member, size_t way);
  void fold(size_t member);
  void factor(std::vector<double>& matrix) const;
  void solve(const std::vector<double>& matrix, std::vector<Six>& x);

  std::vector<PlaceIndex> places_;
  std::vector<Member> members_;
  std::vector<Six> along_;
  std::vector<double> stiffness_;  // by way
  std::vector<Block> blocks_;      // lower triangle, by rows
  std::vector<char> used_;         // of them; others are not set
  // By ways, lower triangle: L^T D L.
  std::vector<double> matrix_, masses_;
  std::vector<Six> sums_;                 // scratch: by place
  std::vector<char> live_;                // scratch: whether sums_ has it
  std::vector<double> rates_, inverses_;  // scratch: by way
  std::vector<Six> reaches_;
  std::vector<Block> blocks_of_member_;  // scratch: by place
};

}  // namespace ruedo::physics
