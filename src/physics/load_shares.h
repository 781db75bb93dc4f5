// How a load is shared where more contacts bear it than rigid bodies need.
//
// A robot on two wheels and two casters, a table on four legs: of rigid bodies any share is right
// that adds up to the same force and moment, and a solver ends with one that its order made. Real
// ones yield a little, all alike, and share the load as equal springs do, one for each shape that
// touches: of all shares the one with the least sum of squares. What the contacts do to the bodies
// together stays as it is.
#pragma once

#include <vector>

#include "physics/joint_block.h"
#include "physics/rows.h"

namespace ruedo::physics {

// A contact that bears a load, or could.
struct Bearing {
  Row* normal = nullptr;
  const void* manifold = nullptr;  // of its two shapes, with their numbers in it
  int shape = 0, other_shape = 0;
  Vec3 place = Vec3::Zero();      // world
  Vec3 direction = Vec3::Zero();  // of its force on the mechanism `on`
  size_t on = 0, against = 0;     // mechanisms; 0: what never moves
  bool taken = false;
};

class LoadShares {
 public:
  LoadShares();
  void begin() { bearings_.clear(); }
  void add(const Bearing& bearing) { bearings_.push_back(bearing); }
  // Changes impulses, and velocities of the bodies that joints hold until those are solved again,
  // where a share is off by more than `tolerance`. Returns whether it did.
  bool spread(SolverBodies& bodies, JointBlocks& blocks, double tolerance);

 private:
  void gather(size_t first);
  void weigh();
  bool has_more_than_it_needs() const;
  bool share(SolverBodies& bodies, double tolerance);
  void least();
  double to_the_first_zero() const;
  double response(size_t i, size_t j) const { return responses_[i * rows_.size() + j]; }

  // What follows is of rows_, in units in which each is as stiff as the others.

  std::vector<Bearing> bearings_;
  std::vector<const Bearing*> group_;  // that press in about the same direction on the same two
  std::vector<Row*> rows_;             // its normals
  std::vector<double> units_;          // impulse of a unit
  std::vector<double> responses_;      // velocity of each for an impulse of each, joints held
  std::vector<char> bears_;            // of the rows: 0 where the share came out as nothing
  std::vector<double> loads_, least_, residual_, heading_, along_;
};

}  // namespace ruedo::physics
