// Solves all rows of an island at once, where sweeps would carry a load from box to box: the method
// of multipliers, with Newton's method for its steps (as in X. Li, D. Sun, K.-C. Toh, "A highly
// efficient semismooth Newton augmented Lagrangian method", 2018; here for contacts with friction).
//
// Each row acts like a stiff spring within its bounds, in addition to its previous impulse: a
// convex problem in the bodies' velocities, six unknowns per body. Its solution gives the next
// impulses and friction bounds, until nothing changes. Bodies are ordered by the Cuthill-McKee
// algorithm, so that the matrix has a narrow band for stacks, walls and chains; its envelope is
// factored by a Cholesky method in blocks of one body.
#pragma once

#include <utility>
#include <vector>

#include "physics/base/rows.h"
#include "ruedo/index.h"

namespace ruedo::physics {

class Newton {
 public:
  Newton();

  // Sets up a new island: which of its bodies are coupled by rows. Returns the cost of a
  // factorization, in multiplications.
  double prepare(const SolverBodies& bodies, const std::vector<std::pair<int, int>>& pairs);

  void begin() { entries_.clear(); }
  // Adds a row with fixed bounds. Returns its number.
  size_t add(Row& row);
  // Adds a row bounded by multiples of the impulse of the row `load`. Here and below, rows that can
  // move nothing are left out: their springs would be infinitely stiff.
  void add(Row& row, size_t load, double lever);
  // Adds friction along two rows: within an ellipse with these coefficients, not 0, times that
  // impulse.
  void add(Row& along, Row& across, double friction, double friction2, size_t load);

  // Changes impulses and velocities until the next step would change no velocity by more than
  // `tolerance`, or for at most that many steps.
  void solve(SolverBodies& bodies, double tolerance, int most_steps);

 private:
  using Block = Eigen::Matrix<double, 6, 6>;
  using Six = Eigen::Matrix<double, 6, 1>;
  using PlaceIndex = Index<struct PlaceKind>;  // in the elimination order
  struct Body {
    PlaceIndex place;                                        // none: immovable
    Vec3 root_mass = Vec3::Zero();                           // M^-1 = L L^T
    Eigen::Matrix3d root_inertia = Eigen::Matrix3d::Zero();  // lower triangle
  };
  enum class Kind : uint8_t { bounded, on_load, along, across };
  struct Entry {
    Row* row = nullptr;
    Kind kind = Kind::bounded;
    PlaceIndex a, b;                  // of the bodies
    size_t load = 0;                  // the entry whose impulse bounds this one
    double scale = 1.0;               // the entry's impulse is the row's divided by this
    double weight = 0.0;              // of the spring
    double lower = 0.0, upper = 0.0;  // of the impulse; friction: upper is the radius
    double missing = 0.0;             // velocity error at the start of the solution
    double begun = 0.0, held = 0.0;   // impulse at the start, and at the last multiplier update
    double pulls = 0.0;               // current impulse
    double stiffness = 0.0;           // its derivative; along `turn` for slipping friction
    double turn = 0.0;                // angle of the combination of both friction rows
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
  // Computes `pulls` and the gradient at y; returns its product with the step.
  double slope(const std::vector<Six>& y);
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
  std::vector<int> first_;     // for each place, the first one that its blocks reach
  std::vector<size_t> start_;  // for each place, its blocks in blocks_
  std::vector<Block> blocks_;
  std::vector<Six> y_, trial_, gradient_, step_;  // by place, as L^-1 v
  std::vector<Entry> entries_;
};

}  // namespace ruedo::physics
