// What Newton's method needs of a matrix: six velocities for each body that can move, in a scale in
// which their masses are the identity, to which rows add blocks of 6 x 6.
#pragma once

#include <vector>

#include "physics/base/bullet.h"
#include "ruedo/index.h"

namespace ruedo::physics {

using PlaceIndex = Index<struct PlaceKind>;  // of a body in the elimination order

class NewtonMatrix {
 public:
  using Block = Eigen::Matrix<double, 6, 6>;
  using Six = Eigen::Matrix<double, 6, 1>;

  virtual ~NewtonMatrix() = default;
  virtual PlaceIndex place(int body) const = 0;  // none: it takes no part
  virtual size_t size() const = 0;
  virtual int body(size_t place) const = 0;

  virtual void set_identity() = 0;
  // row >= column, of bodies that are coupled.
  virtual Block& block(int row, int column) = 0;
  virtual void factor() = 0;  // in place
  // Divides by the matrix.
  virtual void solve(std::vector<Six>& x) = 0;
  // Divides by the identity: leaves what the joints allow.
  virtual void project(std::vector<Six>& x) = 0;
};

}  // namespace ruedo::physics
