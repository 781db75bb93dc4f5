// Solves the contacts of mechanisms with what hangs on them.
//
// A sweep sees of a caster its own mass; only from sweep to sweep it learns that the caster carries
// a robot, and where their masses differ much it does not end. Here a contact's response is that of
// the whole mechanism, whose joints and motors hold: a dense matrix, one solution of the mechanism
// for each row. Its Gauss-Seidel sweeps cost no more than its size.
#pragma once

#include <vector>

#include "physics/base/rows.h"
#include "physics/joints/joint_block.h"

namespace ruedo::physics {

class JoinedContacts {
 public:
  static constexpr size_t kMostContacts = 32;  // beyond that Newton's method is faster

  JoinedContacts();
  void begin();
  // Rows that can move nothing are left out.
  void add(Row& normal, Row& along, Row& across, double friction, double friction2);
  // A row bounded by a multiple of the impulse of the last contact.
  void add(Row& row, double lever);

  // Changes impulses, and the velocities of the bodies on which the rows act: the joints, which
  // must have been swept, are to be swept again. Returns whether the sweeps converged.
  bool solve(SolverBodies& bodies, JointBlocks& blocks, double tolerance);

 private:
  static constexpr size_t kNone = static_cast<size_t>(-1);
  struct Contact {
    size_t normal = 0, along = kNone, across = kNone;  // rows; none: without friction
    double friction = 0.0, friction2 = 0.0;
    double step = 0.0;  // of the projected gradient, for both friction directions
  };
  struct Bound {
    size_t row = 0, normal = 0;
    double lever = 0.0;
  };

  double response(size_t i) const { return responses_[i * rows_.size() + i]; }
  double missing(size_t i) const;
  double relaxed(size_t i) const;  // the impulse with which the row reaches its target
  void start(const SolverBodies& bodies);
  double change(size_t i, double wanted);
  double rub(const Contact& contact);
  double sweep(bool backwards);
  void go_on_along_conjugates(double& last_square);

  std::vector<Row*> rows_;
  std::vector<Contact> contacts_;
  std::vector<Bound> bounds_;
  std::vector<double> responses_;  // square
  // For each row: its velocity, its impulse, that before the sweep, and the search direction.
  std::vector<double> velocities_, impulses_, before_, headings_;
};

}  // namespace ruedo::physics
