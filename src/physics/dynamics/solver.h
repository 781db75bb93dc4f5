// The constraint solver: computes velocities from the contacts and joints of an island, a set of
// bodies that touch or are connected.
//
// Projected Gauss-Seidel on impulses, warm-started with those of the last substep, like Bullet's
// own sequential impulses (E. Catto, "Iterative dynamics with temporal coherence", 2005), with five
// differences that were measured to matter:
// - Sweeps are accelerated by conjugate directions, and continue until no row changes a velocity by
// more than a tolerance, up to a limit: a lone robot takes a few, a stack or a large mass ratio
// more.
// - The joints of a mechanism are one block, solved directly in each sweep: a tree of joints in
// reduced coordinates (joints/joint_tree.h), others by Cholesky factorization, so that long chains
// of joints hold.
// - Friction is Coulomb's cone, not a pyramid; an ellipse where a file gives two coefficients. Its
// force opposes the slip by maximum dissipation, whatever the heading.
// - Penetration and joint errors are corrected by pseudo-velocities, which are discarded: they add
// no energy.
// - A load on more contacts than necessary is distributed as by equal springs (load_shares.h).
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "physics/base/bullet.h"
#include "physics/base/rows.h"
#include "physics/dynamics/joined_contacts.h"
#include "physics/dynamics/load_shares.h"
#include "physics/joints/joint_block.h"

namespace ruedo::physics {

class Newton;

// The combined properties of two surfaces in contact.
struct ContactSurface {
  double friction = 1.0, friction2 = 1.0;  // in the direction `along` and across it
  Vec3 along = Vec3::Zero();       // m/s, world, need not be unit; zero: the same in all directions
  double slip = 0.0, slip2 = 0.0;  // m/s per N, along and across
  double spinning = 0.0,
         rolling = 0.0;  // m: largest moment about the normal, and across it, per newton of load
  double restitution = 0.0;
  double stiffness = 0.0, damping = 0.0;  // N/m, N s/m; 0: rigid
};

// Gives the combined properties at a contact point.
class ContactSurfaces {
 public:
  virtual ~ContactSurfaces() = default;
  virtual ContactSurface at(const btCollisionObject& a, const btCollisionObject& b,
                            const btManifoldPoint& point) const = 0;
};

struct SolverSettings {
  int iterations = 500;          // maximum number of sweeps
  double tolerance_m_s = 1e-5;   // stops when a sweep changes no velocity by more
  double error_reduction = 0.2;  // fraction of a penetration or joint error that a substep corrects
};

class Solver {
 public:
  Solver(const ContactSurfaces& surfaces, const SolverSettings& settings);
  ~Solver();
  Solver(const Solver&) = delete;
  Solver& operator=(const Solver&) = delete;

  // Solves one island for a substep: applies the bodies' forces and gravity, and advances
  // velocities and poses. The order of the arguments affects the last bits.
  void solve(const std::vector<btRigidBody*>& bodies,
             const std::vector<btPersistentManifold*>& manifolds,
             const std::vector<btTypedConstraint*>& joints, double substep_s);

 private:
  struct ContactRows {
    btManifoldPoint* point = nullptr;
    const btPersistentManifold* manifold = nullptr;
    Row normal, along, across, spin, roll[2];
    double friction = 0.0, friction2 = 0.0, spinning = 0.0, rolling = 0.0;
    double step = 0.0;     // of the projected gradient, for both friction directions
    double gap = 0.0;      // m, negative: overlap
    double rebound = 0.0;  // m/s, normal velocity after a bounce
    bool soft = false;
    std::array<Row*, 3> main_rows() { return {&normal, &along, &across}; }
  };

  static constexpr size_t kUsually = 64;  // expected bodies, and contacts, of an island

  int body_of(const btCollisionObject& object);
  void add_body(btRigidBody& body, double substep_s);
  void begin_to_swing(double substep_s);
  bool swing_again(double substep_s);
  static void end_swing(SolverBody& s, double substep_s);
  void add_contacts(btPersistentManifold& manifold, double substep_s);
  void add_contact(btManifoldPoint& point, const ContactSurface& surface, int a, int b,
                   double substep_s);
  void set_normal(ContactRows& contact, const ContactSurface& surface, double substep_s);
  void set_friction(ContactRows& contact, const ContactSurface& surface);
  void start_from_last(ContactRows& contact, double substep_s);
  double rub(ContactRows& contact);
  double sweep(int number);
  double tolerance() const;
  void sweep_until_still();
  bool share_loads();
  void go_on_along_conjugates(double& last_square, int sweep);
  bool newton_pays();
  void solve_at_once();
  bool solve_joined();
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
  SolverBodies bodies_;
  std::vector<ContactRows> contacts_;
  size_t contact_count_ = 0;
  JointBlocks blocks_;
  LoadShares shares_;
  double tolerance_m_s_ = 0.0;  // of this island
  std::unique_ptr<Newton> newton_;
  JoinedContacts joined_;
  bool newton_known_ = false, newton_pays_ = false;  // for this island
  bool reduced_ = false;  // Newton's method, for this island, in reduced coordinates
  std::vector<std::pair<int, int>> pairs_;  // bodies coupled by rows
};

}  // namespace ruedo::physics
