// Solves all rows of an island at once, where sweeps would carry a load from box to box: the method
// of multipliers, with Newton's method for its steps (as in X. Li, D. Sun, K.-C. Toh, "A highly
// efficient semismooth Newton augmented Lagrangian method", 2018).
//
// Each row acts like a stiff spring within its bounds, in addition to its previous impulse: a
// convex problem in the bodies' velocities: six unknowns per body, or, in trees of joints, one for
// each degree of freedom. The springs of a contact pull to the nearest point of Coulomb's cone (A.
// Castro, F. Permenter, X. Han, "An unconstrained convex formulation of compliant contact", 2022).
// By that alone a contact that slips would also open, as fast as it slips times the friction; so
// its normal velocity is aimed lower by that much (V. Acary, F. Cadoux, "Applications of an
// existence result for the Coulomb friction problem", 2013). The solution gives the next impulses
// and aims, and stiffer springs, until nothing changes.
#pragma once

#include <utility>
#include <vector>

#include "physics/base/reduced_matrix.h"
#include "physics/base/rows.h"
#include "physics/base/sparse_matrix.h"

namespace ruedo::physics {

class Newton {
 public:
  Newton();
  Newton(const Newton&) = delete;  // matrix_ points into it
  Newton& operator=(const Newton&) = delete;

  // Sets up a new island: which of its bodies are coupled by rows. Returns the cost of a
  // factorization, in multiplications.
  double prepare(const SolverBodies& bodies, const std::vector<std::pair<int, int>>& pairs);

  // The same for an island of trees of joints, whose joints hold exactly: between begin_trees and
  // end_trees all of their bodies are added, each after that on which it hangs, with its ways: the
  // twists (angular, linear) that its joint allows, about a point of the tree, from which `arm`
  // leads to the centre of mass.
  void begin_trees(const SolverBodies& bodies);
  void add_body(int body, int on, const Vec3& arm);
  void add_way(const Eigen::Matrix<double, 6, 1>& along) { reduced_.add_way(along); }
  void end_trees();

  void begin();
  // Adds a row with fixed bounds. Here and below, rows that can move nothing are left out: their
  // springs would be infinitely stiff.
  void add(Row& row);
  // Adds a contact, with friction within an ellipse with these coefficients. Returns its number.
  size_t add(Row& normal, Row& along, Row& across, double friction, double friction2);
  // Adds a row bounded by multiples of the normal impulse of a contact.
  void add(Row& row, size_t contact, double lever);

  // Changes impulses and velocities until the next step would change no velocity by more than
  // `tolerance`, or for at most that many steps. Returns whether it came to that.
  bool solve(SolverBodies& bodies, double tolerance, int most_steps);

 private:
  using Six = SparseMatrix::Six;
  using Block = SparseMatrix::Block;
  using Reach = Eigen::Matrix<double, 3, 6>;
  static constexpr size_t kNone = static_cast<size_t>(-1);
  struct Body {
    Vec3 root_mass = Vec3::Zero();                           // M^-1 = L L^T
    Eigen::Matrix3d root_inertia = Eigen::Matrix3d::Zero();  // lower triangle
  };
  struct Bound {
    Row* row = nullptr;
    PlaceIndex a, b;      // of the bodies
    size_t load = kNone;  // the contact that bounds it
    double lever = 1.0;   // times this
    double response = 0.0;
    double weight = 0.0;             // stiffness of the spring
    double missing = 0.0;            // velocity error at the start of the solution
    double begun = 0.0, held = 0.0;  // impulse at the start, and at the last multiplier update
    double lower = 0.0, upper = 0.0;
    double moves = 0.0, turns = 0.0;  // J y, J step
    double pulls = 0.0;               // current impulse
    bool active = false, was_active = false;
    Six J_a = Six::Zero(), J_b = Six::Zero();  // J L
    size_t way = kNone;                        // in trees of joints, that which alone it drives,
    double along = 0.0;                        // and by how much for a unit of impulse
  };
  enum class Zone : uint8_t { open, sticks, slips };
  // Normal, along, across; the last two in units in which the cone is round and of slope 1.
  struct Contact {
    Row* rows[3] = {};
    PlaceIndex a, b;
    double friction[2] = {};
    double response = 0.0, response_t = 0.0;  // of the tangential rows, the larger one
    double weight = 0.0, weight_t = 0.0;      // stiffness of the springs
    Vec3 softness = Vec3::Zero(), missing = Vec3::Zero(), begun = Vec3::Zero(), held = Vec3::Zero();
    double slip = 0.0;  // speed that the aim assumes, times the friction
    double slip_error = 0.0, last_slip = 0.0, last_error = 0.0;  // of the aim's slip
    bool bears = false;                                          // or would, if it did not slip
    Vec3 moves = Vec3::Zero(), turns = Vec3::Zero(), pulls = Vec3::Zero();
    Zone zone = Zone::open, was = Zone::open;
    double sine = 0.0, cosine = 1.0;         // of the impulse's direction in the plane
    double stiffness = 0.0, sideways = 0.0;  // that of slipping friction: radial, and across
    Reach J_a = Reach::Zero(), J_b = Reach::Zero();
  };

  Six scaled(int body, const Vec3& linear, const Vec3& angular) const;
  double response_of(const Row& row, const Six& J_a, const Six& J_b) const;
  void set_bodies(const SolverBodies& bodies);
  Block scale_of(int body, const Vec3& arm) const;
  void start(const SolverBodies& bodies);
  void leave_out_far();
  bool look_at_far();
  void set_weights(double yields);
  void set_bounds();
  static double wanted(const Bound& bound, double part);
  static Vec3 wanted(const Contact& contact, double part);
  void pull(Bound& bound, double part);
  void pull(Contact& contact, double part);
  void pull_in_zones();
  Vec3 stiffness_times(const Contact& contact, const Vec3& u) const;
  double slope(double part);
  double curvature() const;
  double search();
  void go_on(double part);
  void find_gradient();
  bool same_zones() const;
  bool any_slips() const;
  void assemble();
  template <class Rows>
  Rows unscaled(PlaceIndex place, const Rows& J) const;
  void add_block(PlaceIndex a, PlaceIndex b, const auto& scaled_a, const auto& scaled_b);
  void find_step();
  // The most that springs yielded, and that slips differ from what was assumed: m/s.
  struct Errors {
    double yielded = 0.0, slipped = 0.0;
  };
  Errors take_multipliers(bool first);
  double furthest(const std::vector<Six>& change);
  void give(SolverBodies& bodies) const;

  std::vector<Body> bodies_;  // as the solver's
  std::vector<char> movable_;
  SparseMatrix sparse_;
  ReducedMatrix reduced_;
  NewtonMatrix* matrix_ = &sparse_;
  std::vector<Six> y_, gradient_, step_, allowed_;  // by place, as L^-1 v
  std::vector<Bound> bounds_;
  std::vector<Contact> contacts_;
  std::vector<Contact*> near_, far_;  // those that are solved for, and the others
  double yields_ = 0.0;               // softness of the springs, relative to the rows' responses
  double slope_of_step_ = 0.0, square_of_step_ = 0.0;  // y step, step step
  double first_slope_ = 0.0;                           // gradient step
  double pulled_at_ = 0.0;  // the part of the step at which slope() was last
  bool in_zones_ = false;   // whether the gradient is that of pull_in_zones()
};

}  // namespace ruedo::physics
