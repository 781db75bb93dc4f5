// The joints of mechanisms. Those of one mechanism form a block that is solved directly: as a tree
// (joint_tree.h), or as rows if joints close a loop or are of other kinds. joint_block.cpp sorts
// joints into blocks, joint_rows.cpp makes their rows, joint_matrix.cpp factors those of loops, and
// joint_stops.cpp finds which motors and stops of a tree hold.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "physics/base/rows.h"
#include "physics/joints/joint_tree.h"

namespace ruedo::physics {

class Newton;

// Of a mechanism with loops; its other rows are relaxed.
inline constexpr size_t kMostRowsAtOnce = 256;

class JointBlocks {
 public:
  void clear();
  // Adds an enabled constraint between two bodies of the solver, with its motors (Bullet's user
  // pointer). reference: the third body of a gearbox; 0: none, or immovable.
  void add(btTypedConstraint& constraint, int a, int b, int reference);
  // To be called after all are added: sorts them into blocks.
  void prepare(const SolverBodies& bodies, double substep_s);
  bool empty() const { return joints_.empty(); }
  // Whether the last sweep brought all rows to their targets, so that another one would change
  // nothing.
  bool exact() const;
  // Whether each mechanism is solved in reduced coordinates: all joints are of JointTree's kinds,
  // and none closes a loop.
  bool only_trees() const;
  // Degrees of freedom of trees and of all other bodies.
  size_t ways(const SolverBodies& bodies) const;
  bool has_gears() const { return !thirds_.empty(); }  // the rows of a gearbox couple three bodies

  // Brings all rows to their targets as far as their bounds allow. Returns the largest error
  // before, m/s or rad/s.
  double sweep(SolverBodies& bodies);
  // The same for positions; stops: also those of joints beyond their stops.
  double sweep_push(SolverBodies& bodies, bool stops);
  // To be called after the bodies have moved. Sets the rows' push targets to the velocities that
  // correct the joints' errors within a substep; returns the largest.
  double look_again(double substep_s);
  void write_back() const;  // to the motors

  // The mechanism of a body, named by its first body; 0: immovable. The joints must be prepared.
  size_t mechanism(int body, const SolverBodies& bodies);
  // For contacts: the change in each one's velocity due to an impulse at each, while the directly
  // solved rows hold; a square matrix by rows. A sweep must have been made.
  void tell_responses(const std::vector<Row*>& contacts, std::vector<double>& responses);

  // Which bodies are coupled, and by which rows.
  void tell_pairs(std::vector<std::pair<int, int>>& pairs) const;
  void tell_rows(Newton& newton, const SolverBodies& bodies);
  // Where only_trees(): their bodies; and the rows of motors, dampers and stops.
  void tell_trees(Newton& newton) const;
  void tell_motors(Newton& newton);

 private:
  struct Joint {
    size_t first = 0, count = 0;  // rows
    btTypedConstraint* constraint = nullptr;
    JointMotor* motors[4] = {};  // of the last rows, in that order
    size_t motor_count = 0;
    bool errors_only = true;  // without error reduction, no row has a target
    bool hinge = false;       // not at a stop: we compute its five rows, not Bullet
    int a = 0, b = 0, reference = 0;
    JointWays ways;
    std::optional<int> stop;  // Bullet's row for the stop that the joint is at
    size_t block = 0;
    size_t way = JointTree::kNone;  // its degree of freedom in the block's tree, if it has just one
    size_t next_of_a = JointTree::kNone, next_of_b = JointTree::kNone;  // of the body's joints
  };
  struct Spent {
    size_t row = 0;
    bool upper = false;
  };
  // Of a joint of a tree that is at its stop. A stop that holds prescribes the rate, and takes what
  // the motor beside it cannot.
  struct Stop {
    size_t row = 0, way = 0;
    size_t motor = JointTree::kNone;  // row; only while the stop does not hold among free and spent
    double sign = 1.0;                // of its row, relative to the way
    bool holds = true;
  };
  struct Block {
    std::vector<size_t> joints;
    size_t bodies = 0, hung = 0;  // movable ones; joints to immovable ones
    bool is_tree = false;         // its rows are motors and stops only
    JointTree tree;
    std::vector<size_t> free;     // rows that are solved directly: none is at a bound
    std::vector<size_t> bounded;  // rows at a bound, relaxed iteratively
    std::vector<Spent> spent;     // in a tree: motors at a bound
    std::vector<Stop> stops;      // in a tree
    // L D L^T of the free rows: D L^T, upper, by rows; 1 / D; and for each row the first column
    // below the diagonal that is not 0, and the last one above it.
    std::vector<double> factor, inverse;
    std::vector<size_t> begin, end;
    bool factored = false;
    bool exact = false;  // no row is redundant: one solution suffices
  };

  // The effect of a gearbox's row on its reference.
  struct Third {
    size_t row = 0;
    int body = 0;
    Vec3 angular = Vec3::Zero(), turns = Vec3::Zero();  // J and M^-1 J^T
  };
  const Third* third_of(size_t row) const;
  double coupling(size_t i, size_t j) const;
  double coupling(size_t i, const Row& other) const;
  double velocity(size_t i, const SolverBodies& bodies) const;
  double push_velocity(size_t i, const SolverBodies& bodies) const;
  void give(size_t i, SolverBodies& bodies, double more);
  void give_push(size_t i, SolverBodies& bodies, double more);
  double relax(size_t i, SolverBodies& bodies);
  template <class Do>
  void for_each_body(size_t i, Do&& act) const {
    act(rows_[i].a);
    act(rows_[i].b);
    if (const Third* third = third_of(i)) act(third->body);
  }

  void unite(const SolverBodies& bodies);
  void find_blocks(const SolverBodies& bodies);
  bool make_tree(Block& block, const SolverBodies& bodies);
  bool grow(Block& block, int root, const SolverBodies& bodies);
  void add_rows(Joint& joint, const SolverBodies& bodies, double substep_s);
  bool add_hinge(btTypedConstraint& constraint, Joint& joint, const SolverBodies& bodies);
  void add_asked(btTypedConstraint& constraint, Joint& joint, const SolverBodies& bodies,
                 double substep_s);
  void add_locked_rows(const Joint& joint, const SolverBodies& bodies);
  Row& add_row(const Joint& joint);
  struct Values;
  int ask(btTypedConstraint& constraint, double reduction, double substep_s, Values& values);
  void add_motor(JointMotor& motor, Joint& joint, int reference, const SolverBodies& bodies);
  void add_third(const JointMotor& motor, int reference, const SolverBodies& bodies);
  size_t root(size_t body);
  double sweep_tree(Block& block, SolverBodies& bodies);
  double aim_motors(Block& block);
  double missing(const Block& block, size_t motor) const;
  double damper_gives(const Block& block, size_t motor) const;
  const Row* damper_of(size_t motor) const {
    return motor < damper_of_row_.size() && damper_of_row_[motor] > 0
               ? &rows_[damper_of_row_[motor]]
               : nullptr;
  }
  double softness_of(size_t motor) const;
  static bool is_stop(const Row& row) { return row.lower == 0.0 || row.upper == 0.0; }
  double bound_of(const Spent& spent) const {
    return spent.upper ? rows_[spent.row].upper : rows_[spent.row].lower;
  }
  struct Shares {
    double stop = 0.0, motor = 0.0, damper = 0.0;  // impulses
  };
  Shares shares_of(const Block& block, const Stop& stop) const;
  void aim_stops(Block& block, double& worst) const;
  size_t choose_stops(Block& block, size_t most);
  void give_shares(Block& block);
  void hold_push(Block& block) const;
  size_t choose_spent(Block& block, size_t most);
  double aim(Block& block, const SolverBodies& bodies);
  double aim_push(Block& block, const SolverBodies& bodies, bool stops);
  void find_envelope(Block& block);
  void write_matrix(Block& block);
  void factor(Block& block);
  void factor_matrix(Block& block);
  void solve(Block& block, std::vector<double>& x) const;
  void solve_lower(const Block& block, double* x) const;  // L
  void take_off_held(const Block& block, const std::vector<Row*>& contacts,
                     std::vector<double>& responses);
  void add_those_of_tree(Block& block, const std::vector<Row*>& contacts,
                         std::vector<double>& responses);

  std::vector<Row> rows_;
  std::vector<size_t> way_of_row_;  // in its block's tree; kNone: in none
  // In a tree, of a motor's row: that of the damper beside it, which is not 0; shorter where none
  // follows. The two act on the same degree of freedom, and are solved as one.
  std::vector<size_t> damper_of_row_;
  std::vector<Row> locked_;  // of trees, for Newton's method
  std::vector<Third> thirds_;
  static constexpr size_t kNoThird = SIZE_MAX;
  std::vector<size_t> third_of_row_;  // looked up for each pair of rows; shorter where none follows
  std::vector<Joint> joints_;
  std::vector<size_t> parents_;  // union-find over bodies
  std::vector<Block> blocks_;
  size_t block_count_ = 0;
  std::vector<size_t> block_of_root_;
  std::vector<double> x_;              // scratch
  std::vector<size_t> first_of_body_;  // scratch: a block's first row at each body
  std::vector<size_t> joint_of_body_;  // the first joint of each body
  std::vector<int> grown_;             // scratch: bodies of a tree
  double closing_per_s_ = 0.0;
  std::vector<double> held_;  // scratch: for contacts
};

}  // namespace ruedo::physics
