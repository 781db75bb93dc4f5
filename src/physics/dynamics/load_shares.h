// Distributes a load over more contacts than rigid bodies need.
//
// A robot on two wheels and two casters, a table on four legs: for rigid bodies any distribution
// with the same total force and moment is valid, and a solver ends with one that depends on its
// order. Real ones yield a little and share the load like equal springs, one for each shape in
// contact: of all distributions the one with the least sum of squares. The contacts' total effect
// on the bodies does not change.
#pragma once

#include <vector>

#include "physics/base/rows.h"
#include "physics/joints/joint_block.h"

namespace ruedo::physics {

// A contact that bears a load, or could.
struct Bearing {
  Row* normal = nullptr;
  const void* manifold = nullptr;  // of its two shapes, whose contacts are numbered in it
  int shape = 0, other_shape = 0;
  Vec3 place = Vec3::Zero();      // world
  Vec3 direction = Vec3::Zero();  // of its force on the mechanism `on`
  size_t on = 0, against = 0;     // mechanisms; 0: immovable
  bool taken = false;
};

class LoadShares {
 public:
  LoadShares();
  void begin() { bearings_.clear(); }
  void add(const Bearing& bearing) { bearings_.push_back(bearing); }
  // Changes impulses where a share is off by more than `tolerance`, and the velocities of bodies
  // held by joints until these are solved again. Returns whether anything changed.
  bool spread(SolverBodies& bodies, JointBlocks& blocks, double tolerance);

 private:
  void gather(size_t first);
  void weigh();
  bool has_more_than_it_needs() const;
  bool share(SolverBodies& bodies, double tolerance);
  void least();
  double to_the_first_zero() const;
  double response(size_t i, size_t j) const { return responses_[i * rows_.size() + j]; }

  // The following are for rows_, in units in which all are equally stiff.

  std::vector<Bearing> bearings_;
  // contacts with about the same direction between the same two mechanisms
  std::vector<const Bearing*> group_;
  std::vector<Row*> rows_;         // its normals
  std::vector<double> units_;      // impulse per unit
  std::vector<double> responses_;  // velocity of each due to an impulse at each, with joints held
  std::vector<char> bears_;        // 0: the row's share is zero
  std::vector<double> loads_, least_, residual_, heading_, along_;
};

}  // namespace ruedo::physics
