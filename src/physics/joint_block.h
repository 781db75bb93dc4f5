// The joints of mechanisms as rows of the solver: those of one mechanism are a block that is solved
// directly.
#pragma once

#include <vector>

#include "physics/newton.h"
#include "physics/rows.h"

namespace ruedo::physics {

class JointBlocks {
 public:
  void clear();
  // Adds the rows of an enabled constraint between two bodies of the solver, with its motors
  // (Bullet's user pointer). reference: the third body of a gearbox; 0: none, or what never moves.
  void add(btTypedConstraint& constraint, int a, int b, int reference, const SolverBodies& bodies,
           double substep_s);
  // All are added: sorts the rows into blocks.
  void prepare(const SolverBodies& bodies);
  bool empty() const { return rows_.empty(); }
  // A sweep has brought all rows to their targets; another one would find them there.
  bool exact() const;
  bool has_gears() const { return !thirds_.empty(); }  // their rows have three bodies

  // Brings all rows to their targets, as far as their bounds allow. Returns how far off the worst
  // was, m/s or rad/s.
  double sweep(SolverBodies& bodies);
  double sweep_push(SolverBodies& bodies);
  // The bodies have moved. Sets the rows' push targets to the velocities that bring the joints back
  // together within a substep; returns the largest.
  double look_again(double substep_s);
  void write_back() const;  // to the motors

  // The mechanism of a body, as the number of its first body; 0: what nothing moves. Joints are
  // prepared.
  size_t mechanism(int body, const SolverBodies& bodies);
  // Of contacts: what an impulse of each changes in the velocity of each while the rows that are
  // solved directly hold, by rows of a square matrix. A sweep was made.
  void tell_responses(const std::vector<Row*>& contacts, std::vector<double>& responses);

  // Which bodies are tied together, and by which rows.
  void tell_pairs(std::vector<std::pair<int, int>>& pairs) const;
  void tell_rows(Newton& newton);

 private:
  struct Joint {
    size_t first = 0, count = 0;  // rows
    btTypedConstraint* constraint = nullptr;
    JointMotor* motors[2] = {};  // of the last rows, in that order
    bool errors_only = true;     // without reduction, no row has a target
    bool hinge = false;          // not at a stop: its five rows are ours, not Bullet's
    int a = 0, b = 0;
    size_t block = 0;
  };
  struct Block {
    std::vector<size_t> free;     // rows that are solved directly: none of them is at a bound
    std::vector<size_t> bounded;  // rows at a bound, relaxed one by one
    // L D L^T of the free ones: D L^T, upper, by rows; 1 / D; of each row the first column that is
    // not 0 below the diagonal, and the last one beyond it.
    std::vector<double> factor, inverse;
    std::vector<size_t> begin, end;
    bool factored = false;
    bool exact = false;  // no row says what others say already: solving once is enough
  };

  // What a gearbox's row does to its reference.
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

  bool add_hinge(btTypedConstraint& constraint, Joint& joint, const SolverBodies& bodies);
  void add_asked(btTypedConstraint& constraint, Joint& joint, const SolverBodies& bodies,
                 double substep_s);
  Row& add_row(const Joint& joint);
  struct Values;
  int ask(btTypedConstraint& constraint, double reduction, double substep_s, Values& values);
  void add_motor(JointMotor& motor, Joint& joint, int reference, const SolverBodies& bodies);
  void add_third(const JointMotor& motor, int reference, const SolverBodies& bodies);
  size_t root(size_t body);
  void find_envelope(Block& block);
  void write_matrix(Block& block);
  void factor(Block& block);
  void solve(const Block& block, std::vector<double>& x) const;
  void solve_lower(const Block& block, double* x) const;  // L
  void take_off_held(const Block& block, const std::vector<Row*>& contacts,
                     std::vector<double>& responses);

  std::vector<Row> rows_;
  std::vector<Third> thirds_;
  std::vector<Joint> joints_;
  std::vector<size_t> parents_;  // union-find over bodies
  std::vector<Block> blocks_;
  size_t block_count_ = 0;
  std::vector<size_t> block_of_root_;
  std::vector<double> x_;              // scratch
  std::vector<size_t> first_of_body_;  // scratch: a block's first row at each body
  std::vector<double> held_;           // scratch: of contacts
};

}  // namespace ruedo::physics
