// A substep of an island.
#include "physics/dynamics/solver.h"

#include <algorithm>
#include <cmath>

#include "physics/base/newton.h"
#include "physics/dynamics/friction_step.h"
#include "ruedo/quantity.h"

namespace ruedo::physics {

namespace {

// A slower rebound would lift a body by less than kRestingDepth_m: v^2 / 2 g = 5e-8 m.
constexpr double kSlowestBounce_m_s = 1e-3;
// Penetration up to this depth is not corrected: otherwise bodies at rest would be lifted a little,
// fall a little, and rock.
constexpr double kRestingDepth_m = 5e-5;
// A loaded contact keeps its load up to this gap, and nothing stands higher than the rest by more.
// Real surfaces yield by more.
constexpr double kTouching_m = 1e-5;
// A contact without a load that opens faster than this bears none: in a substep of 1 ms it opens by
// a tenth of kTouching_m.
constexpr double kStanding_m_s = 1e-3;
// Of the correction of penetration. The next substep corrects the rest, since it measures the depth
// again; the tolerance moves a body by 50 nm in a substep of 5 ms.
constexpr int kPushSweeps = 30;
constexpr double kPushTolerance_m_s = 1e-5;
// Sweeps before the first check, and between checks; a factorization may cost as much as that many
// sweeps.
// kNewtonSteps bounds the work where Newton's method does not converge: the sweeps go on from what
// it reached.
constexpr int kSweepsBeforeNewton = 1, kSweepsBetweenNewton = 40, kNewtonSteps = 30;
// With friction, sweeps do not converge while few contacts bear the whole load.
constexpr int kSweepsBeforeSharing = 10;
// Before Newton, of mechanisms: their joints are solved directly anyway. In reduced coordinates it
// is faster, up to that many degrees of freedom.
constexpr int kSweepsOfMechanisms = 20, kSweepsOfTrees = 3;
constexpr size_t kMostWays = 200;
constexpr int kSweepsBeforeJoined = 4,
              kSweepsBetweenJoined = 10;  // of mechanisms with few contacts
constexpr size_t kFewBodies = 2;          // something immovable and one body: sweeps are faster
// Piles in motion are solved to this part of the speed at which they meet and slip, and those that
// stand to this part of the tolerance: what is left moves them a little in each substep.
constexpr double kOfSpeed = 1e-3, kStanding = 0.1;
// Of Newton's method, so that the sweep that follows finds nothing left to do.
constexpr double kOfTolerance = 0.5, kOfToleranceReduced = 0.1;
// Newton's method pays where a factorization costs at most as much as kSweepsForAFactor sweeps, of
// kProductsOfARow products for each row; or where it is cheap in any case.
constexpr double kSweepsForAFactor = 30.0, kProductsOfARow = 40.0, kSmall = 20'000.0;
// Beyond this a joint did not come apart by its own motion: it was pushed, or placed so.
constexpr double kFastestClosing_m_s = 0.5;

Eigen::Matrix3d matrix(const btMatrix3x3& m) {
  Eigen::Matrix3d result;
  for (int i = 0; i < 3; ++i) result.row(i) = from_bt(m.getRow(i));
  return result;
}

// Two tangential directions for n; the same as long as n does not change.
void across(const Vec3& n, Vec3& first, Vec3& second) {
  const Vec3 off = std::abs(n.z()) < 0.7 ? Vec3::UnitZ() : Vec3::UnitX();
  first = (off - n * n.dot(off)).normalized();
  second = n.cross(first);
}

Row linear_row(int a, int b, const Vec3& direction, const Vec3& arm_a, const Vec3& arm_b) {
  Row row;
  row.a = a;
  row.b = b;
  row.linear_a = direction;
  row.angular_a = arm_a.cross(direction);
  row.linear_b = -direction;
  row.angular_b = -arm_b.cross(direction);
  return row;
}

// Before forces acted.
double velocity_before(const Row& row, const SolverBodies& bodies) {
  const SolverBody& A = bodies[row.a];
  const SolverBody& B = bodies[row.b];
  return row.linear_a.dot(A.v0) + row.angular_a.dot(A.w0) + row.linear_b.dot(B.v0) +
         row.angular_b.dot(B.w0);
}

Row angular_row(int a, int b, const Vec3& direction) {
  Row row;
  row.a = a;
  row.b = b;
  row.angular_a = direction;
  row.angular_b = -direction;
  return row;
}

Quat turned_by(const Quat& rotation, const Vec3& turn) {
  const double angle = turn.norm();
  return angle > 0.0 ? (Quat(Eigen::AngleAxisd(angle, turn / angle)) * rotation).normalized()
                     : rotation;
}

// Free rotation over h: conserves angular momentum. Fourth-order Runge-Kutta.
void turn_freely(const btRigidBody& body, Quat& rotation, Vec3& w, double h) {
  const Vec3 inverse = from_bt(body.getInvInertiaDiagLocal());
  const Vec3 momentum = rotation * (rotation.conjugate() * w).cwiseQuotient(inverse);
  const auto rate = [&](const Quat& q) {
    return Vec3(q * inverse.cwiseProduct(q.conjugate() * momentum));
  };
  const auto turned = [&](const Vec3& k, double t) {
    const Quat dq(0.0, k.x(), k.y(), k.z());
    Quat q = rotation;
    q.coeffs() += 0.5 * t * (dq * rotation).coeffs();
    return q.normalized();
  };
  const Vec3 k1 = rate(rotation), k2 = rate(turned(k1, 0.5 * h)), k3 = rate(turned(k2, 0.5 * h)),
             k4 = rate(turned(k3, h));
  const Vec3 mean = (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0;
  rotation = turned_by(rotation, h * mean);
  w = rate(rotation);
}

// N m s about the centre of mass, world, of a body that has that rotation.
Vec3 momentum_of(const btRigidBody& body, const Quat& rotation, const Vec3& w) {
  return rotation *
         (rotation.conjugate() * w).cwiseQuotient(from_bt(body.getInvInertiaDiagLocal()));
}

// By how much that changes while the body turns with w for a time.
Vec3 swing_of(const btRigidBody& body, const Quat& rotation, const Vec3& w, double time) {
  const Vec3 momentum = momentum_of(body, rotation, w);
  return turned_by(Quat::Identity(), time * w) * momentum - momentum;
}

// For bodies that differ by many orders of magnitude, each correction may increase a joint's error.
Vec3 bounded(const Vec3& velocity) {
  const double norm = velocity.norm();
  return norm > quantity::kSpeed.most ? Vec3(velocity * (quantity::kSpeed.most / norm)) : velocity;
}

}  // namespace

Solver::Solver(const ContactSurfaces& surfaces, const SolverSettings& settings)
    : surfaces_(surfaces), settings_(settings), newton_(std::make_unique<Newton>()) {
  bodies_.reserve(kUsually);
  contacts_.reserve(kUsually);
  pairs_.reserve(kUsually);
}

Solver::~Solver() = default;

int Solver::body_of(const btCollisionObject& object) {
  const int index = object.getCompanionId();
  return index > 0 && static_cast<size_t>(index) < bodies_.size() &&
                 bodies_[index].bullet == &object
             ? index
             : 0;
}

void Solver::add_body(btRigidBody& body, double substep_s) {
  body.setCompanionId(static_cast<int>(bodies_.size()));
  SolverBody& s = bodies_.emplace_back();
  s.bullet = &body;
  s.v = s.v0 = from_bt(body.getLinearVelocity());
  s.w = s.w0 = from_bt(body.getAngularVelocity());
  if (body.isStaticOrKinematicObject()) return;
  s.inverse_mass = body.getInvMass() * from_bt(body.getLinearFactor());
  const Eigen::DiagonalMatrix<double, 3> factor(from_bt(body.getAngularFactor()));
  s.inverse_inertia = factor * matrix(body.getInvInertiaTensorWorld()) * factor;
  s.v += substep_s * s.inverse_mass.cwiseProduct(from_bt(body.getTotalForce()));
  s.w += substep_s * (s.inverse_inertia * from_bt(body.getTotalTorque()));
}

// The velocities of a mechanism's bodies are those in the middle between two poses. Half a substep
// after a pose the angular momentum is I w + swing(w), and half a substep before it likewise;
// joints and forces give the difference: a leapfrog, which is of second order, keeps angular
// momentum, and lets no top's nutation grow. The swing depends on the result, and is found again
// until it fits (swing_again). Rows at stops of Bullet's own joints assume the other velocities:
// only for trees of joints.
void Solver::begin_to_swing(double substep_s) {
  constexpr double kMost = 0.3;  // to which that shrinks the error each time
  for (SolverBody& s : bodies_) {
    if (!s.held || s.inverse_mass == Vec3::Zero() ||
        s.bullet->getAngularFactor() != btVector3(1, 1, 1))
      continue;
    const Vec3 inverse = from_bt(s.bullet->getInvInertiaDiagLocal());
    const double most = inverse.maxCoeff(), least = inverse.minCoeff();
    if (!(least > 0.0) || most == least ||
        0.5 * substep_s * s.w0.norm() * (most / least - 1.0) > kMost)
      continue;
    s.swings = true;
    s.before = from_bt(s.bullet->getWorldTransform().getRotation());
    s.swing = swing_of(*s.bullet, s.before, s.w0, 0.5 * substep_s);
    s.w += s.inverse_inertia * (swing_of(*s.bullet, s.before, s.w0, -0.5 * substep_s) - s.swing);
  }
}

// Returns whether that changed a velocity.
bool Solver::swing_again(double substep_s) {
  double worst = 0.0;
  for (SolverBody& s : bodies_) {
    if (!s.swings) continue;
    s.next_swing = swing_of(*s.bullet, s.before, s.w, 0.5 * substep_s);
    worst = std::max(worst, (s.inverse_inertia * (s.swing - s.next_swing)).cwiseAbs().maxCoeff());
  }
  if (worst <= settings_.tolerance_m_s) return false;
  for (SolverBody& s : bodies_) {
    if (!s.swings) continue;
    s.w += s.inverse_inertia * (s.swing - s.next_swing);
    s.swing = s.next_swing;
  }
  return true;
}

// The velocity that has the body's momentum in its new pose, half a substep after it.
void Solver::end_swing(SolverBody& s, double substep_s) {
  constexpr int kTimes = 3;
  const Quat now = from_bt(s.bullet->getWorldTransform().getRotation());
  const Vec3 momentum = momentum_of(*s.bullet, s.before, s.w) + s.swing;
  const Vec3 inverse = from_bt(s.bullet->getInvInertiaDiagLocal());
  for (int i = 0; i < kTimes; ++i) {
    const Vec3 at_pose = momentum - swing_of(*s.bullet, now, s.w, -0.5 * substep_s);
    s.w = now * inverse.cwiseProduct(now.conjugate() * at_pose);
  }
}

void Solver::set_normal(ContactRows& contact, const ContactSurface& surface, double substep_s) {
  Row& row = contact.normal;
  const double gap = contact.gap;
  double reduction = settings_.error_reduction;
  contact.soft = surface.stiffness > 0.0;
  if (contact.soft) {  // implicit spring and damper
    const double hard = substep_s * surface.stiffness + surface.damping;
    row.softness = 1.0 / (substep_s * hard);
    reduction = substep_s * surface.stiffness / hard;
  }
  row.prepare(bodies_);
  row.lower = 0.0;
  row.upper = BT_LARGE_FLOAT;
  const bool bore = contact.point->m_appliedImpulse > 0.0 && gap <= kTouching_m && !contact.soft;
  row.target = bore           ? 0.0
               : gap > 0.0    ? -gap / substep_s
               : contact.soft ? -reduction * gap / substep_s
                              : 0.0;
  row.push_target = gap < -kRestingDepth_m && !contact.soft
                        ? -reduction * (gap + kRestingDepth_m) / substep_s
                        : 0.0;
  if (surface.restitution <= 0.0) return;
  // The velocity at the time of impact, somewhere within the substep: forces act until then only.
  const double before = -velocity_before(row, bodies_);
  const double acceleration = (-row.velocity(bodies_) - before) / substep_s;
  const double square = before * std::abs(before) + 2.0 * acceleration * std::max(gap, 0.0);
  const double rebound = square > 0.0 ? surface.restitution * std::sqrt(square) : 0.0;
  contact.rebound = rebound > kSlowestBounce_m_s ? rebound : 0.0;
}

void Solver::set_friction(ContactRows& contact, const ContactSurface& surface) {
  contact.along.softness = surface.slip;
  contact.across.softness = surface.slip2;
  contact.along.prepare(bodies_);
  contact.across.prepare(bodies_);
  contact.friction = surface.friction;
  contact.friction2 = surface.friction2;
  const double m1 = surface.friction, m2 = surface.friction2;
  const double k11 = m1 * m1 * (contact.along.response + surface.slip),
               k22 = m2 * m2 * (contact.across.response + surface.slip2);
  const double k12 = m1 * m2 * contact.along.coupling(contact.across);
  const double largest = 0.5 * (k11 + k22) + length_of(0.5 * (k11 - k22), k12);
  contact.step = largest > 1e-12 ? 1.0 / largest : 0.0;
}

void Solver::add_contact(btManifoldPoint& point, const ContactSurface& surface, int a, int b,
                         double substep_s) {
  if (contacts_.size() == contact_count_) contacts_.emplace_back();
  ContactRows& contact = contacts_[contact_count_++];
  contact = {};
  contact.point = &point;
  contact.gap = point.getDistance();
  const Vec3 normal = from_bt(point.m_normalWorldOnB);
  const auto arm = [&](int body, const btVector3& at) {
    const btRigidBody* bullet = bodies_[body].bullet;
    return bullet ? from_bt(at - bullet->getCenterOfMassPosition()) : Vec3(Vec3::Zero());
  };
  const Vec3 arm_a = arm(a, point.getPositionWorldOnA()),
             arm_b = arm(b, point.getPositionWorldOnB());
  contact.normal = linear_row(a, b, normal, arm_a, arm_b);
  set_normal(contact, surface, substep_s);

  Vec3 first, second;
  across(normal, first, second);
  if (surface.along != Vec3::Zero()) {
    const Vec3 along = surface.along - normal * normal.dot(surface.along);
    if (along.norm() > 1e-6 * surface.along.norm()) {
      first = along.normalized();
      second = normal.cross(first);
    }
  }
  contact.along = linear_row(a, b, first, arm_a, arm_b);
  contact.across = linear_row(a, b, second, arm_a, arm_b);
  ContactSurface of_rows = surface;
  of_rows.slip /= substep_s;
  of_rows.slip2 /= substep_s;
  set_friction(contact, of_rows);

  contact.spinning = surface.spinning;
  contact.rolling = surface.rolling;
  if (surface.spinning > 0.0) {
    contact.spin = angular_row(a, b, normal);
    contact.spin.prepare(bodies_);
  }
  if (surface.rolling > 0.0) {
    contact.roll[0] = angular_row(a, b, first);
    contact.roll[1] = angular_row(a, b, second);
    for (Row& row : contact.roll) row.prepare(bodies_);
  }
  start_from_last(contact, substep_s);
}

// Impulses of the previous substep. The directions of friction follow from the normal: those in the
// point are Bullet's own, once it has found the point again.
void Solver::start_from_last(ContactRows& contact, double substep_s) {
  const btManifoldPoint& point = *contact.point;
  if (!(substep_of(point) > 0.0) || !(point.m_appliedImpulse > 0.0)) return;
  const double scale = substep_s / substep_of(point);
  contact.normal.give(bodies_, scale * point.m_appliedImpulse);
  contact.along.give(bodies_, scale * point.m_appliedImpulseLateral1);
  contact.across.give(bodies_, scale * point.m_appliedImpulseLateral2);
}

void Solver::add_contacts(btPersistentManifold& manifold, double substep_s) {
  const btCollisionObject& a = *manifold.getBody0();
  const btCollisionObject& b = *manifold.getBody1();
  const int of_a = body_of(a), of_b = body_of(b);
  for (int i = 0; i < manifold.getNumContacts(); ++i) {
    btManifoldPoint& point = manifold.getContactPoint(i);
    add_contact(point, surfaces_.at(a, b, point), of_a, of_b, substep_s);
    contacts_[contact_count_ - 1].manifold = &manifold;
  }
}

double Solver::rub(ContactRows& contact) {
  Row& first = contact.along;
  Row& second = contact.across;
  const double load = std::max(contact.normal.impulse, 0.0);  // a conjugate step may have overshot
  if (load == 0.0 && first.impulse == 0.0 && second.impulse == 0.0) return 0.0;
  const auto rubbing = [this](const Row& row, double friction) {
    const double missing = -(row.velocity(bodies_) + row.softness * row.impulse);
    return Rubbing{friction, row.impulse, missing, row.impulse + missing * row.inverse};
  };
  const auto [p1, p2] = rubbed(rubbing(first, contact.friction), rubbing(second, contact.friction2),
                               load, contact.step);
  const double more1 = p1 - first.impulse, more2 = p2 - second.impulse;
  first.give(bodies_, more1);
  second.give(bodies_, more2);
  return std::max(std::abs(more1) * first.response, std::abs(more2) * second.response);
}

double Solver::sweep(int number) {
  double worst = blocks_.sweep(bodies_);
  // Alternating directions: a load passes through a whole stack in one sweep, however it is
  // numbered.
  const auto nth = [&](size_t c) -> ContactRows& {
    return contacts_[number % 2 == 0 ? c : contact_count_ - 1 - c];
  };
  for (size_t c = 0; c < contact_count_; ++c) {
    ContactRows& contact = nth(c);
    worst = std::max(worst, rub(contact));
    if (contact.spinning > 0.0) {
      contact.spin.upper = contact.spinning * std::max(contact.normal.impulse, 0.0);
      contact.spin.lower = -contact.spin.upper;
      worst = std::max(worst, contact.spin.relax(bodies_));
    }
    for (int k = 0; contact.rolling > 0.0 && k < 2; ++k) {
      contact.roll[k].upper = contact.rolling * std::max(contact.normal.impulse, 0.0);
      contact.roll[k].lower = -contact.roll[k].upper;
      worst = std::max(worst, contact.roll[k].relax(bodies_));
    }
  }
  for (size_t c = 0; c < contact_count_; ++c) worst = std::max(worst, nth(c).normal.relax(bodies_));
  return worst;
}

// The accuracy at which sweeps end. It follows the velocities of the last substep, which forces
// have not changed yet: standing bodies are solved more accurately than moving ones.
double Solver::tolerance() const {
  if ((!blocks_.empty() && !reduced_) || bodies_.size() <= kFewBodies + 1)
    return settings_.tolerance_m_s;
  double fastest = 0.0;
  for (size_t c = 0; c < contact_count_; ++c) {
    const ContactRows& contact = contacts_[c];
    for (const Row* row : {&contact.normal, &contact.along, &contact.across})
      fastest = std::max(fastest, std::abs(velocity_before(*row, bodies_)));
  }
  const double least = (reduced_ ? 1.0 : kStanding) * settings_.tolerance_m_s;
  return std::max(least, kOfSpeed * fastest);
}

// If that does not converge soon, all rows are solved at once; a solution that did not improve
// matters is discarded. Between sweeps, impulses continue along conjugate directions (M.
// Silcowitz-Hansen, S. Niebel, K. Erleben, "A nonsmooth nonlinear conjugate gradient method for
// interactive contact force problems", 2010): stacks and large mass ratios then take a fraction of
// the sweeps. The next sweep restores the bounds; the last one makes no such step.
void Solver::sweep_until_still() {
  const auto start_conjugates = [](Row& row) { row.before = row.impulse, row.heading = 0.0; };
  for_each_main_row(start_conjugates);
  tolerance_m_s_ = tolerance();
  double last_square = 0.0, before_newton = 0.0;
  bool after_newton = false, shared = false;
  bool join =
      !blocks_.empty() && contact_count_ > 0 && contact_count_ <= JoinedContacts::kMostContacts;
  const int first = blocks_.empty() ? kSweepsBeforeNewton
                    : reduced_      ? kSweepsOfTrees
                                    : kSweepsOfMechanisms;
  for (int i = 0; i < settings_.iterations; ++i) {
    const double worst = sweep(i);
    if (i + 1 == settings_.iterations || (contact_count_ == 0 && blocks_.exact())) break;
    const bool still = worst <= tolerance_m_s_;
    if (still && shared) break;
    if (still || i == kSweepsBeforeSharing) {
      shared = still;
      if (share_loads()) {
        after_newton = false;
        last_square = 0.0;
        for_each_main_row(start_conjugates);
        continue;
      }
      if (still) break;
    }
    if (after_newton && worst > before_newton) {
      for_each_main_row([this](Row& row) { row.give(bodies_, row.before - row.impulse); });
    }
    if (after_newton) for_each_main_row(start_conjugates);
    const bool joined = join && i % kSweepsBetweenJoined == kSweepsBeforeJoined;
    after_newton = joined || (i % kSweepsBetweenNewton == first && newton_pays());
    if (after_newton) {
      for_each_main_row(start_conjugates);
      if (joined)
        join = solve_joined();
      else
        solve_at_once();
      before_newton = worst;
      last_square = 0.0;
    } else {
      go_on_along_conjugates(last_square, i);
    }
  }
}

// Returns whether any load changed.
bool Solver::share_loads() {
  if (contact_count_ < 3) return false;
  shares_.begin();
  for (size_t c = 0; c < contact_count_; ++c) {
    ContactRows& contact = contacts_[c];
    Row& row = contact.normal;
    if (row.inverse == 0.0 || contact.soft || contact.gap > kTouching_m) continue;
    if (row.impulse <= 0.0 && row.velocity(bodies_) > kStanding_m_s) continue;
    Bearing bearing;
    bearing.normal = &row;
    bearing.manifold = contact.manifold;
    bearing.shape = contact.point->m_index0;
    bearing.other_shape = contact.point->m_index1;
    bearing.place = from_bt(contact.point->getPositionWorldOnB());
    bearing.on = blocks_.mechanism(row.a, bodies_);
    bearing.against = blocks_.mechanism(row.b, bodies_);
    if (bearing.on == bearing.against) continue;
    bearing.direction = row.linear_a;
    if (bearing.on < bearing.against) {
      std::swap(bearing.on, bearing.against);
      bearing.direction = row.linear_b;
    }
    shares_.add(bearing);
  }
  return shares_.spread(bodies_, blocks_, tolerance_m_s_);
}

void Solver::go_on_along_conjugates(double& last_square, int sweep) {
  double square = 0.0;
  for_each_main_row([&](const Row& row) {
    square += (row.impulse - row.before) * (row.impulse - row.before) * row.response;
  });
  const double further = sweep > 0 && last_square > 0.0 ? square / last_square : 0.0;
  const bool on = further < 1.0 && sweep + 2 < settings_.iterations;
  for_each_main_row([&](Row& row) {
    const double step = row.impulse - row.before;
    if (on && row.heading != 0.0) row.give(bodies_, further * row.heading);
    row.heading = (on ? further * row.heading : 0.0) + step;
    row.before = row.impulse;
  });
  last_square = square;
}

// Whether to use Newton's method for an island whose sweeps do not converge soon.
bool Solver::newton_pays() {
  if (newton_known_) return newton_pays_;
  newton_known_ = true;
  if (reduced_) {
    newton_->begin_trees(bodies_);
    blocks_.tell_trees(*newton_);
    newton_->end_trees();
    return newton_pays_ = true;
  }
  pairs_.clear();
  blocks_.tell_pairs(pairs_);
  for (size_t c = 0; c < contact_count_; ++c) {
    const std::pair pair(contacts_[c].normal.a, contacts_[c].normal.b);
    if (pairs_.empty() || pairs_.back() != pair) pairs_.push_back(pair);
  }
  const double rows = 3.0 * static_cast<double>(contact_count_);
  newton_pays_ =
      contact_count_ > 0 && !blocks_.has_gears() && bodies_.size() > kFewBodies &&
      newton_->prepare(bodies_, pairs_) < kSweepsForAFactor * kProductsOfARow * rows + kSmall;
  return newton_pays_;
}

// Returns whether it helps: otherwise it would not the next time.
bool Solver::solve_joined() {
  blocks_.sweep(bodies_);
  joined_.begin();
  for (size_t c = 0; c < contact_count_; ++c) {
    ContactRows& contact = contacts_[c];
    if (contact.normal.inverse == 0.0) continue;
    joined_.add(contact.normal, contact.along, contact.across, contact.friction, contact.friction2);
    if (contact.spinning > 0.0) joined_.add(contact.spin, contact.spinning);
    for (int k = 0; contact.rolling > 0.0 && k < 2; ++k)
      joined_.add(contact.roll[k], contact.rolling);
  }
  const bool solved = joined_.solve(bodies_, blocks_, tolerance_m_s_);
  blocks_.sweep(bodies_);
  return solved;
}

// In reduced coordinates the joints must hold before, and are to be swept again.
void Solver::solve_at_once() {
  newton_->begin();
  if (reduced_) {
    blocks_.sweep(bodies_);
    blocks_.tell_motors(*newton_);
  } else {
    blocks_.tell_rows(*newton_, bodies_);
  }
  for (size_t c = 0; c < contact_count_; ++c) {
    ContactRows& contact = contacts_[c];
    if (contact.normal.inverse == 0.0) continue;
    const size_t load = newton_->add(contact.normal, contact.along, contact.across,
                                     contact.friction, contact.friction2);
    if (contact.spinning > 0.0) newton_->add(contact.spin, load, contact.spinning);
    for (int k = 0; contact.rolling > 0.0 && k < 2; ++k)
      newton_->add(contact.roll[k], load, contact.rolling);
  }
  newton_->solve(bodies_, (reduced_ ? kOfToleranceReduced : kOfTolerance) * tolerance_m_s_,
                 kNewtonSteps);
  if (reduced_) blocks_.sweep(bodies_);
}

// Corrects penetration by velocities that move the bodies in this substep and are not kept.
void Solver::undo_penetration() {
  bool any = false;
  for (size_t c = 0; c < contact_count_; ++c) any |= contacts_[c].normal.push_target > 0.0;
  if (!any) return;
  for (int i = 0; i < kPushSweeps; ++i) {
    double worst = blocks_.sweep_push(bodies_, true);
    for (size_t c = 0; c < contact_count_; ++c) {
      Row& row = contacts_[c].normal;
      if (contacts_[c].gap > 0.0 || contacts_[c].soft) continue;
      const double wanted =
          std::max(0.0, row.push + (row.push_target - row.push_velocity(bodies_)) * row.inverse);
      if (wanted == row.push) continue;
      worst = std::max(worst, std::abs(wanted - row.push) * row.response);
      row.give_push(bodies_, wanted - row.push);
    }
    if (worst <= kPushTolerance_m_s) return;
  }
}

// The bodies of a mechanism moved along straight lines where its joints prescribe arcs. The
// correction is part of their motion, and so is its velocity (J.-P. Ryckaert et al., "Numerical
// integration of the cartesian equations of motion of a system with constraints", 1977: SHAKE): a
// pendulum keeps its energy. Errors that motion did not cause are corrected without changing
// velocities, and so is what went beyond a stop: it would rebound.
void Solver::close_joints(double substep_s) {
  if (blocks_.empty()) return;
  for (SolverBody& s : bodies_) s.push_v = s.push_w = Vec3::Zero();
  const double largest = blocks_.look_again(substep_s);
  if (largest <= 0.0) return;
  if (largest < kFastestClosing_m_s) {
    blocks_.sweep_push(bodies_, false);
    for (SolverBody& s : bodies_) {
      s.v += bounded(s.push_v);
      s.w += bounded(s.push_w);
    }
  }
  blocks_.sweep_push(bodies_, true);
  for (size_t i = 1; i < bodies_.size(); ++i) {
    SolverBody& s = bodies_[i];
    if (s.push_v == Vec3::Zero() && s.push_w == Vec3::Zero()) continue;
    s.push_v = bounded(s.push_v);
    s.push_w = bounded(s.push_w);
    btTransform X = s.bullet->getWorldTransform();
    X.setOrigin(X.getOrigin() + to_bt(Vec3(substep_s * s.push_v)));
    X.setRotation(to_bt(turned_by(from_bt(X.getRotation()), substep_s * s.push_w)));
    s.bullet->setWorldTransform(X);
    s.bullet->updateInertiaTensor();
  }
}

void Solver::advance(double substep_s) {
  for (size_t i = 1; i < bodies_.size(); ++i) {
    SolverBody& s = bodies_[i];
    if (s.inverse_mass == Vec3::Zero() && s.bullet->isStaticOrKinematicObject()) continue;
    const btTransform& X = s.bullet->getWorldTransform();
    Vec3 position = from_bt(X.getOrigin()) + substep_s * (s.v + s.push_v);
    // In free flight the mean velocity of the substep is exact.
    if (!s.held) position -= 0.5 * substep_s * (s.v - s.v0);
    Quat rotation = from_bt(X.getRotation());
    const Vec3 turn = s.w + s.push_w;
    const bool free_axes = s.bullet->getAngularFactor() == btVector3(1, 1, 1);
    if (free_axes && !s.swings && s.push_w == Vec3::Zero()) {
      turn_freely(*s.bullet, rotation, s.w, substep_s);
    } else {
      rotation = turned_by(rotation, substep_s * turn);
    }
    s.bullet->setWorldTransform(btTransform(to_bt(rotation), to_bt(position)));
    s.bullet->updateInertiaTensor();
  }
}

// Bodies have reached what they hit; now they rebound.
void Solver::bounce() {
  bool any = false;
  for (size_t c = 0; c < contact_count_; ++c) {
    ContactRows& contact = contacts_[c];
    if (contact.rebound <= 0.0 || contact.normal.impulse <= 0.0) continue;
    contact.normal.target = contact.rebound;
    any = true;
  }
  if (any) sweep_until_still();
}

void Solver::write_back(double substep_s) {
  for (size_t c = 0; c < contact_count_; ++c) {
    const ContactRows& contact = contacts_[c];
    btManifoldPoint& point = *contact.point;
    point.m_appliedImpulse = contact.normal.impulse;
    point.m_appliedImpulseLateral1 = contact.along.impulse;
    point.m_appliedImpulseLateral2 = contact.across.impulse;
    point.m_lateralFrictionDir1 = to_bt(contact.along.linear_a);
    point.m_lateralFrictionDir2 = to_bt(contact.across.linear_a);
    substep_of(point) = substep_s;
  }
  blocks_.write_back();
  for (size_t i = 1; i < bodies_.size(); ++i) {
    SolverBody& s = bodies_[i];
    if (s.swings) end_swing(s, substep_s);
    if (!s.bullet->isStaticOrKinematicObject()) {
      s.bullet->setLinearVelocity(to_bt(s.v));
      s.bullet->setAngularVelocity(to_bt(s.w));
    }
    s.bullet->setCompanionId(-1);
  }
}

void Solver::solve(const std::vector<btRigidBody*>& bodies,
                   const std::vector<btPersistentManifold*>& manifolds,
                   const std::vector<btTypedConstraint*>& joints, double substep_s) {
  newton_known_ = false;
  contact_count_ = 0;
  bodies_.clear();
  bodies_.emplace_back();
  blocks_.clear();
  for (btRigidBody* body : bodies) add_body(*body, substep_s);
  const auto tie = [this](btRigidBody& body) {
    const int index = body_of(body);
    if (index > 0) bodies_[index].held = true;
    return index;
  };
  for (btTypedConstraint* joint : joints) {
    const int a = tie(joint->getRigidBodyA()), b = tie(joint->getRigidBodyB());
    const auto* motors = static_cast<const JointMotors*>(joint->getUserConstraintPtr());
    btRigidBody* reference = motors ? motors->first.reference : nullptr;
    blocks_.add(*joint, a, b, reference ? tie(*reference) : 0);
  }
  blocks_.prepare(bodies_, substep_s);
  if (!blocks_.empty() && blocks_.only_trees()) begin_to_swing(substep_s);
  for (btPersistentManifold* manifold : manifolds) add_contacts(*manifold, substep_s);
  reduced_ = !blocks_.empty() && contact_count_ > JoinedContacts::kMostContacts &&
             blocks_.only_trees() && blocks_.ways(bodies_) <= kMostWays;
  if (contact_count_ > 0 || !blocks_.empty()) {
    constexpr int kMostSwings = 4;
    sweep_until_still();
    for (int i = 0; i < kMostSwings && swing_again(substep_s); ++i) sweep_until_still();
    undo_penetration();
  }
  for (size_t c = 0; c < contact_count_; ++c) {
    const ContactRows& contact = contacts_[c];
    if (contact.normal.impulse == 0.0 && contact.normal.push == 0.0) continue;
    bodies_[contact.normal.a].held = bodies_[contact.normal.b].held = true;
  }
  advance(substep_s);
  close_joints(substep_s);
  bounce();
  write_back(substep_s);
}

}  // namespace ruedo::physics
