// All rows of an island at once, where sweeps would carry a load from box to box: the method of
// multipliers, its steps found by Newton's method (as in X. Li, D. Sun, K.-C. Toh, "A highly
// efficient semismooth Newton augmented Lagrangian method", 2018; here for contacts with friction).
//
// Each row pulls as a stiff spring does, within its bounds, on top of the impulse that it had: a
// convex problem in the velocities of the bodies, six unknowns a body. Its solution gives the next
// impulses and limits of friction, until nothing changes. Bodies are ordered by Cuthill and McKee,
// so that the matrix is a narrow band for stacks, walls and chains; its envelope is factored by
// Cholesky in blocks of a body.
#pragma once

#include <utility>
#include <vector>

#include "physics/rows.h"

namespace ruedo::physics {

class Newton {
 public:
  Newton();

  // Of a new island: which of its bodies rows tie together. Returns what a factorization costs, in
  // products of numbers.
  double prepare(const SolverBodies& bodies, const std::vector<std::pair<int, int>>& pairs);

  void begin() { entries_.clear(); }
  // A row with bounds of its own. Returns its number.
  size_t add(Row& row);
  // A row whose bounds are so much of the impulse of the row `load`.
  void add(Row& row, size_t load, double lever);
  // Friction along two rows: within an ellipse of these coefficients, not 0, times that impulse.
  void add(Row& along, Row& across, double friction, double friction2, size_t load);

  // Changes impulses and velocities, until the next step would change no velocity by more than
  // `tolerance`, or for so many steps.
  void solve(SolverBodies& bodies, double tolerance, int most_steps);

 private:
  using Block = Eigen::Matrix<double, 6, 6>;
  using Six = Eigen::Matrix<double, 6, 1>;
  struct Body {
    int place = -1;                                          // in the order; -1: nothing moves it
    Vec3 root_mass = Vec3::Zero();                           // M^-1 = L L^T
    Eigen::Matrix3d root_inertia = Eigen::Matrix3d::Zero();  // lower triangle
  };
  enum class Kind : uint8_t { bounded, on_load, along, across };
  struct Entry {
    Row* row = nullptr;
    Kind kind = Kind::bounded;
    int a = -1, b = -1;               // places
    size_t load = 0;                  // entry whose impulse bounds this one
    double scale = 1.0;               // the entry's impulse is the row's, divided by this
    double weight = 0.0;              // of the spring
    double lower = 0.0, upper = 0.0;  // of the impulse; friction: upper is the radius
    double missing = 0.0;             // of the velocity where the solution began
    double begun = 0.0, held = 0.0;   // impulse there, and that of the last multipliers
    double pulls = 0.0;               // impulse now
    double stiffness = 0.0;           // its derivative, along `turn` where friction slips
    double turn = 0.0;                // of the combination of both rows of friction
    bool active = false, was_active = false;
    Six J_a = Six::Zero(), J_b = Six::Zero();  // scale J L
  };

  void put_in_order(const std::vector<std::pair<int, int>>& pairs);
  void lay_out(const std::vector<std::pair<int, int>>& pairs);
  Block& block(int row, int column) {
    return blocks_[start_[row] + static_cast<size_t>(column - first_[row])];
  }
  Entry& enter(Row& row, Kind kind, double scale, double response);
  void set_bounds();
  double slope(const std::vector<Six>& y);  // pulls and gradient at y; its product with the step
  void pull(Entry& entry, double wanted);
  void rub(Entry& along, Entry& across, double first, double second);
  bool same_set() const;
  void assemble();
  void add_row(const Entry& entry, const Six& J_a, const Six& J_b, double weight);
  void factor();
  void substitute();
  double take_multipliers();
  double furthest(const std::vector<Six>& step) const;

  std::vector<Body> bodies_;                   // as the solver's
  std::vector<int> movable_, degree_, order_;  // bodies; order_: by place
  std::vector<size_t> first_neighbour_;
  std::vector<int> neighbours_;
  std::vector<int> first_;     // of each place: the first one that its blocks reach
  std::vector<size_t> start_;  // of each place: its blocks in blocks_
  std::vector<Block> blocks_;
  std::vector<Six> y_, trial_, gradient_, step_;  // of places, L^-1 v
  std::vector<Entry> entries_;
};

}  // namespace ruedo::physics
