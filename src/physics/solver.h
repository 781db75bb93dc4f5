// Contacts and joints to velocities: the constraint solver of an island, the bodies that touch or
// are tied to each other.
//
// Projected Gauss-Seidel on impulses, started with those of the last substep, as in Bullet's own
// sequential impulses (E. Catto, "Iterative dynamics with temporal coherence", 2005), with five
// differences that were measured to matter:
// - Sweeps are accelerated by conjugate directions, and go on until no row changes a velocity by
// more than a tolerance, up to
//   a limit: a lone robot takes a few, a stack or a large ratio of masses takes more.
// - The joints of a mechanism are one block, solved directly in each sweep: a tree of joints in
// reduced coordinates (joint_tree.h), others by Cholesky: a chain of joints holds.
// - Friction is Coulomb's cone, not a pyramid: an ellipse where a file gives two coefficients. Its
// force points against
//   the slip of greatest dissipation, whatever the heading.
// - Penetration and joint errors are undone by velocities of their own, which are forgotten: they
// add no energy.
// - A load that more contacts bear than need to is shared as equal springs share it
// (load_shares.h).
#pragma once

#include <array>
#include <vector>

#include "physics/bullet.h"
#include "physics/joint_block.h"
#include "physics/load_shares.h"
#include "physics/newton.h"
#include "physics/rows.h"

namespace ruedo::physics {

// What acts between two shapes, of both together.
struct ContactSurface {
  double friction = 1.0, friction2 = 1.0;  // along `along` and across it
  Vec3 along = Vec3::Zero();       // m/s, world, need not be unit; zero: the same in all directions
  double slip = 0.0, slip2 = 0.0;  // m/s per N, along and across
  double spinning = 0.0,
         rolling = 0.0;  // m: largest moment about the normal, and across it, for a newton of load
  double restitution = 0.0;
  double stiffness = 0.0, damping = 0.0;  // N/m, N s/m; 0: rigid
};

// Says what acts at a contact point.
class ContactSurfaces {
 public:
  virtual ~ContactSurfaces() = default;
  virtual ContactSurface at(const btCollisionObject& a, const btCollisionObject& b,
                            const btManifoldPoint& point) const = 0;
};

struct SolverSettings {
  int iterations = 500;          // at most
  double tolerance_m_s = 1e-5;   // a sweep that changes no velocity by more is the last one
  double error_reduction = 0.2;  // part of a penetration or joint error that a substep undoes
};

class Solver {
 public:
  Solver(const ContactSurfaces& surfaces, const SolverSettings& settings)
      : surfaces_(surfaces), settings_(settings) {
    bodies_.reserve(kUsually);
    contacts_.reserve(kUsually);
    pairs_.reserve(kUsually);
  }

  // Solves one island for a substep: forces and gravity, which the bodies hold, are added;
  // velocities and poses are advanced. The order of the arguments decides the last bits.
  void solve(const std::vector<btRigidBody*>& bodies,
             const std::vector<btPersistentManifold*>& manifolds,
             const std::vector<btTypedConstraint*>& joints, double substep_s);

  int sweeps() const { return sweeps_; }  // of the last call

 private:
  struct ContactRows {
    btManifoldPoint* point = nullptr;
    const btPersistentManifold* manifold = nullptr;
    Row normal, along, across, spin, roll[2];
    double friction = 0.0, friction2 = 0.0, spinning = 0.0, rolling = 0.0;
    double step = 0.0;     // of the projected gradient for both directions of friction
    double gap = 0.0;      // m, negative: overlap
    double rebound = 0.0;  // m/s that a bounce leaves with
    bool soft = false;
    std::array<Row*, 3> main_rows() { return {&normal, &along, &across}; }
  };

  static constexpr size_t kUsually = 64;  // bodies, and contacts, of an island

  int body_of(const btCollisionObject& object);
  void add_body(btRigidBody& body, double substep_s);
  void add_contacts(btPersistentManifold& manifold, double substep_s);
  void add_contact(btManifoldPoint& point, const ContactSurface& surface, int a, int b,
                   double substep_s);
  void set_normal(ContactRows& contact, const ContactSurface& surface, double substep_s);
  void set_friction(ContactRows& contact, const ContactSurface& surface);
  void start_from_last(ContactRows& contact, double substep_s);
  double rub(ContactRows& contact);
  double sweep(int number);
  void sweep_until_still();
  bool share_loads();
  void go_on_along_conjugates(double& last_square, int sweep);
  bool newton_pays();
  void solve_at_once();
  template <class Do>
  void for_each_main_row(Do&& act) {
    for (size_t c = 0; c < contact_count_; ++c) {
      for (Row* row : contacts_[c].main_rows()) act(*row);
    }
  }
  void undo_penetration();
  void close_joints(double substep_s);
  void advance(double substep_s);
  void bounce();
  void write_back(double substep_s);

  const ContactSurfaces& surfaces_;
  const SolverSettings settings_;
  int sweeps_ = 0;
  SolverBodies bodies_;
  std::vector<ContactRows> contacts_;
  size_t contact_count_ = 0;
  JointBlocks blocks_;
  LoadShares shares_;
  Newton newton_;
  bool newton_known_ = false, newton_pays_ = false;  // of this island
  std::vector<std::pair<int, int>> pairs_;           // of bodies that rows tie together
};

}  // namespace ruedo::physics
