#include "physics/base/newton.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ruedo::physics {

namespace {

// The softness of a row's spring relative to the row's response: soft springs take few Newton
// steps, stiff ones few multiplier updates. They begin soft, and become stiff; beyond that only
// where what they bear is so much heavier than what they act on that updates hardly help.
constexpr double kYieldsFirst = 0.1, kYieldsStiff = 1e-3, kYieldsLeast = 1e-8, kStiffer = 0.1;
// A line search ends at a slope of this fraction of the initial one.
constexpr double kSlopeLeft = 0.05;
constexpr int kMostTrials = 12;
// Newton's method has done its part for these multipliers once its error is this part of theirs.
constexpr double kErrorLeft = 0.3;
// Updates of the multipliers that do not shrink their error to this part need stiffer springs.
constexpr double kFalls = 0.7;
// The secant method goes further by at most three times an error, and back by at most this part.
constexpr double kLeastBack = -3.0, kMostBack = 0.75;

constexpr double kHuge = std::numeric_limits<double>::infinity();

bool can_move(const SolverBody& body) {
  return body.inverse_mass != Vec3::Zero() || !body.inverse_inertia.isZero(0.0);
}

// Cholesky factor of a semidefinite matrix: a body may be unable to rotate about an axis.
Eigen::Matrix3d root_of(const Eigen::Matrix3d& A) {
  Eigen::Matrix3d L = Eigen::Matrix3d::Zero();
  const double nothing = 1e-14 * A.trace();
  for (int j = 0; j < 3; ++j) {
    double square = A(j, j);
    for (int k = 0; k < j; ++k) square -= L(j, k) * L(j, k);
    if (square <= nothing) continue;
    L(j, j) = std::sqrt(square);
    for (int i = j + 1; i < 3; ++i) {
      double sum = A(i, j);
      for (int k = 0; k < j; ++k) sum -= L(i, k) * L(j, k);
      L(i, j) = sum / L(j, j);
    }
  }
  return L;
}

}  // namespace

// Capacity for usual islands is reserved: steady runs do not allocate.
Newton::Newton() {
  constexpr size_t kBodies = 8, kRows = 64;
  bodies_.reserve(kBodies);
  movable_.reserve(kBodies);
  y_.reserve(kBodies);
  gradient_.reserve(kBodies);
  step_.reserve(kBodies);
  bounds_.reserve(kRows);
  contacts_.reserve(kRows);
  near_.reserve(kRows);
  far_.reserve(kRows);
}

void Newton::set_bodies(const SolverBodies& bodies) {
  bodies_.assign(bodies.size(), {});
  movable_.assign(bodies.size(), 0);
  for (size_t i = 1; i < bodies.size(); ++i) {
    if (!can_move(bodies[i])) continue;
    movable_[i] = 1;
    bodies_[i].root_mass = bodies[i].inverse_mass.cwiseSqrt();
    bodies_[i].root_inertia = root_of(bodies[i].inverse_inertia);
  }
}

double Newton::prepare(const SolverBodies& bodies, const std::vector<std::pair<int, int>>& pairs) {
  set_bodies(bodies);
  matrix_ = &sparse_;
  return sparse_.prepare(movable_, pairs);
}

void Newton::begin_trees(const SolverBodies& bodies) {
  set_bodies(bodies);
  matrix_ = &reduced_;
  reduced_.begin(bodies.size());
}

// From a twist about the point that is `arm` before the centre of mass.
Newton::Block Newton::scale_of(int body, const Vec3& arm) const {
  const Body& of = bodies_[body];
  Block scale = Block::Zero();
  for (int i = 0; i < 3; ++i) {
    if (of.root_mass[i] == 0.0) continue;
    scale(i, 3 + i) = 1.0 / of.root_mass[i];
    const Vec3 turned = arm.cross(Vec3::Unit(i));  // w x arm, component i
    for (int k = 0; k < 3; ++k) scale(i, k) = turned[k] / of.root_mass[i];
  }
  for (int i = 0; i < 3; ++i) {
    if (of.root_inertia(i, i) == 0.0) continue;
    Vec3 rest = Vec3::Unit(i);
    for (int k = 0; k < i; ++k)
      rest -= of.root_inertia(i, k) * Vec3(scale.block<1, 3>(3 + k, 0).transpose());
    scale.block<1, 3>(3 + i, 0) = rest.transpose() / of.root_inertia(i, i);
  }
  return scale;
}

void Newton::add_body(int body, int on, const Vec3& arm) {
  reduced_.add(body, on, scale_of(body, arm));
}

// Bodies without joints follow.
void Newton::end_trees() {
  for (size_t i = 1; i < bodies_.size(); ++i) {
    const int body = static_cast<int>(i);
    if (!movable_[i] || reduced_.place(body).valid()) continue;
    add_body(body, 0, Vec3::Zero());
    for (int k = 0; k < 3; ++k) {
      Six along = Six::Zero();
      along[3 + k] = bodies_[i].root_mass[k];
      if (along[3 + k] != 0.0) reduced_.add_way(along);
    }
    for (int k = 0; k < 3; ++k) {
      Six along = Six::Zero();
      along.head<3>() = bodies_[i].root_inertia.col(k);
      if (along[k] != 0.0) reduced_.add_way(along);
    }
  }
  reduced_.prepare();
}

void Newton::begin() {
  bounds_.clear();
  contacts_.clear();
}

Newton::Six Newton::scaled(int body, const Vec3& linear, const Vec3& angular) const {
  const Body& of = bodies_[body];
  Six J;
  J.head<3>() = linear.cwiseProduct(of.root_mass);
  J.tail<3>() = of.root_inertia.transpose() * angular;
  return J;
}

// In trees of joints, with all that hangs on the two bodies; of bodies that joints hold still,
// small.
double Newton::response_of(const Row& row, const Six& J_a, const Six& J_b) const {
  constexpr double kLeast = 1e-6;
  if (matrix_ != &reduced_) return row.response;
  const double reduced = reduced_.response(reduced_.place(row.a), J_a, reduced_.place(row.b), J_b);
  return std::max(reduced, kLeast * row.response);
}

void Newton::add(Row& row) {
  Bound& bound = bounds_.emplace_back();
  bound.row = &row;
  bound.a = matrix_->place(row.a);
  bound.b = matrix_->place(row.b);
  bound.lower = row.lower;
  bound.upper = row.upper;
  bound.J_a = scaled(row.a, row.linear_a, row.angular_a);
  bound.J_b = scaled(row.b, row.linear_b, row.angular_b);
  bound.response = response_of(row, bound.J_a, bound.J_b);
  bound.way = kNone;
  if (matrix_ != &reduced_) return;
  bound.way = reduced_.way_between(bound.a, bound.b);
  if (bound.way == kNone) return;
  const bool of_a = reduced_.moves(bound.way, bound.a);
  bound.along = reduced_.along(bound.way, of_a ? bound.a : bound.b, of_a ? bound.J_a : bound.J_b);
}

void Newton::add(Row& row, size_t contact, double lever) {
  if (row.inverse == 0.0) return;
  add(row);
  bounds_.back().load = contact;
  bounds_.back().lever = lever;
}

size_t Newton::add(Row& normal, Row& along, Row& across, double friction, double friction2) {
  Contact& contact = contacts_.emplace_back();
  contact.a = matrix_->place(normal.a);
  contact.b = matrix_->place(normal.b);
  const bool rubs =
      friction > 0.0 && friction2 > 0.0 && along.inverse > 0.0 && across.inverse > 0.0;
  contact.friction[0] = friction;
  contact.friction[1] = friction2;
  const double scales[3] = {1.0, friction, friction2};
  Row* rows[3] = {&normal, &along, &across};
  for (int k = 0; k < (rubs ? 3 : 1); ++k) {
    Row& row = *rows[k];
    contact.rows[k] = &row;
    contact.softness[k] = scales[k] * scales[k] * row.softness;
    contact.begun[k] = contact.held[k] = row.impulse / scales[k];
    const Six J_a = scaled(row.a, row.linear_a, row.angular_a),
              J_b = scaled(row.b, row.linear_b, row.angular_b);
    contact.J_a.row(k) = scales[k] * J_a;
    contact.J_b.row(k) = scales[k] * J_b;
    const double response = scales[k] * scales[k] * response_of(row, J_a, J_b);
    if (k == 0)
      contact.response = response;
    else
      contact.response_t = std::max(contact.response_t, response);
  }
  return contacts_.size() - 1;
}

void Newton::start(const SolverBodies& bodies) {
  const auto missing = [&](const Row& row) {
    return row.target - row.velocity(bodies) - row.softness * row.impulse;
  };
  for (Bound& bound : bounds_) {
    bound.missing = missing(*bound.row);
    bound.begun = bound.held = bound.row->impulse;
    bound.moves = 0.0;
  }
  for (Contact& contact : contacts_) {
    contact.moves = Vec3::Zero();
    contact.missing = Vec3::Zero();
    for (int k = 0; k < 3 && contact.rows[k]; ++k)
      contact.missing[k] = (k == 0 ? 1.0 : contact.friction[k - 1]) * missing(*contact.rows[k]);
    contact.slip = length_of(contact.missing[1], contact.missing[2]);
  }
  y_.assign(matrix_->size(), Six::Zero());
  step_ = y_;
  leave_out_far();
  set_weights(kYieldsFirst);
  set_bounds();
}

// Contacts that would open by more than others lack, and bear nothing, hardly matter: they cost
// time only where they turn out to.
void Newton::leave_out_far() {
  double most = 0.0;
  for (const Contact& contact : contacts_) most = std::max(most, contact.missing[0]);
  near_.clear();
  far_.clear();
  for (Contact& contact : contacts_) {
    const bool far = contact.held == Vec3::Zero() && contact.missing[0] < -most;
    (far ? far_ : near_).push_back(&contact);
  }
}

// Adds those that would close at the present velocities.
bool Newton::look_at_far() {
  const size_t before = near_.size();
  std::erase_if(far_, [this](Contact* contact) {
    contact->moves.setZero();
    if (contact->a.valid()) contact->moves.noalias() += contact->J_a * y_[contact->a];
    if (contact->b.valid()) contact->moves.noalias() += contact->J_b * y_[contact->b];
    if (contact->missing[0] <= contact->moves[0]) return false;
    near_.push_back(contact);
    pull(*contact, 0.0);
    return true;
  });
  return near_.size() > before;
}

void Newton::set_weights(double yields) {
  yields_ = yields;
  for (Bound& bound : bounds_) bound.weight = 1.0 / (bound.row->softness + yields * bound.response);
  for (Contact& contact : contacts_) {
    contact.weight = 1.0 / (contact.softness[0] + yields * contact.response);
    const double softness_t = std::max(contact.softness[1], contact.softness[2]);
    if (contact.rows[1]) contact.weight_t = 1.0 / (softness_t + yields * contact.response_t);
  }
}

void Newton::set_bounds() {
  for (Bound& bound : bounds_) {
    if (bound.load == kNone) continue;
    bound.upper = bound.lever * std::max(contacts_[bound.load].held[0], 0.0);
    bound.lower = -bound.upper;
  }
}

double Newton::wanted(const Bound& bound, double part) {
  const double missing = bound.missing - bound.moves - part * bound.turns -
                         bound.row->softness * (bound.held - bound.begun);
  return bound.held + bound.weight * missing;
}

void Newton::pull(Bound& bound, double part) {
  const double wanted = Newton::wanted(bound, part);
  bound.pulls = std::clamp(wanted, bound.lower, bound.upper);
  bound.active = bound.pulls == wanted;
}

Vec3 Newton::wanted(const Contact& contact, double part) {
  const Vec3 missing = contact.missing - contact.moves - part * contact.turns -
                       contact.softness.cwiseProduct(contact.held - contact.begun);
  return contact.held + Vec3(contact.weight * (missing[0] - contact.slip),
                             contact.weight_t * missing[1], contact.weight_t * missing[2]);
}

// The point of the cone that is nearest to the wanted impulses, each measured by its softness.
void Newton::pull(Contact& contact, double part) {
  const Vec3 wanted = Newton::wanted(contact, part);
  const double load = wanted[0];
  if (!contact.rows[1]) {
    contact.zone = load > 0.0 ? Zone::sticks : Zone::open;
    contact.pulls = Vec3(std::max(load, 0.0), 0.0, 0.0);
    return;
  }
  const double first = wanted[1], second = wanted[2];
  const double size = length_of(first, second), ratio = contact.weight / contact.weight_t;
  if (size <= load) {
    contact.zone = Zone::sticks;
    contact.pulls = Vec3(load, first, second);
  } else if (load > -ratio * size) {
    contact.zone = Zone::slips;
    contact.cosine = first / size;
    contact.sine = second / size;
    const double held = (load + ratio * size) / (1.0 + ratio);
    contact.pulls = held * Vec3(1.0, contact.cosine, contact.sine);
    contact.stiffness = contact.weight / (1.0 + ratio);
    contact.sideways = contact.weight_t * held / size;
  } else {
    contact.zone = Zone::open;
    contact.pulls = Vec3::Zero();
  }
}

// As pull() if each row remained in its zone. New multipliers, aims and weights change little; but
// they act on stiff springs, which would leave their zones, and return by the next step.
void Newton::pull_in_zones() {
  for (Bound& bound : bounds_) {
    const double wanted = Newton::wanted(bound, 0.0);
    bound.pulls = bound.active ? wanted : std::clamp(wanted, bound.lower, bound.upper);
  }
  for (Contact* of : near_) {
    Contact& contact = *of;
    const Vec3 wanted = Newton::wanted(contact, 0.0);
    if (contact.zone == Zone::open) {
      contact.pulls = Vec3::Zero();
    } else if (contact.zone == Zone::sticks) {
      contact.pulls = contact.rows[1] ? wanted : Vec3(wanted[0], 0.0, 0.0);
    } else {
      const double c = contact.cosine, s = contact.sine, ratio = contact.weight / contact.weight_t;
      const double held = (wanted[0] + ratio * (c * wanted[1] + s * wanted[2])) / (1.0 + ratio),
                   across = contact.sideways / contact.weight_t * (c * wanted[2] - s * wanted[1]);
      contact.pulls = Vec3(held, c * held - s * across, s * held + c * across);
      contact.stiffness = contact.weight / (1.0 + ratio);
    }
  }
  in_zones_ = true;
  find_gradient();
}

Vec3 Newton::stiffness_times(const Contact& contact, const Vec3& u) const {
  if (contact.zone == Zone::open) return Vec3::Zero();
  if (contact.zone == Zone::sticks)
    return Vec3(contact.weight * u[0], contact.weight_t * u[1], contact.weight_t * u[2]);
  const double radial = contact.stiffness * (u[0] + contact.cosine * u[1] + contact.sine * u[2]),
               across = contact.sideways * (contact.cosine * u[2] - contact.sine * u[1]);
  return Vec3(radial, contact.cosine * radial - contact.sine * across,
              contact.sine * radial + contact.cosine * across);
}

// The derivative of the convex function along the step, that part of it on; also the impulses
// there.
double Newton::slope(double part) {
  pulled_at_ = part;
  double sum = slope_of_step_ + part * square_of_step_;
  for (Bound& bound : bounds_) {
    pull(bound, part);
    sum -= (bound.pulls - bound.begun) * bound.turns;
  }
  for (Contact* of : near_) {
    Contact& contact = *of;
    pull(contact, part);
    sum -= (contact.pulls - contact.begun).dot(contact.turns);
  }
  return sum;
}

// The second derivative along the step, where slope() was last.
double Newton::curvature() const {
  double sum = square_of_step_;
  for (const Bound& bound : bounds_)
    if (bound.active) sum += bound.weight * bound.turns * bound.turns;
  for (const Contact* of : near_) sum += of->turns.dot(stiffness_times(*of, of->turns));
  return sum;
}

// How far to go along the step: to where the function is least, found by Newton's method in a
// bracket. 0: the step, which assumed that zones last, leads up.
double Newton::search() {
  const double begin = in_zones_ ? slope(0.0) : first_slope_;
  double part = 1.0, low = 0.0, high = 1.0;
  for (int k = 0; k < kMostTrials; ++k) {
    const double here = slope(part);
    if (std::abs(here) <= kSlopeLeft * std::abs(begin) || (here < 0.0 && part >= 1.0)) break;
    if (begin >= 0.0) return 0.0;
    (here > 0.0 ? high : low) = part;
    part -= here / curvature();
    if (!(part > low && part < high)) part = 0.5 * (low + high);
  }
  return part;
}

void Newton::find_gradient() {
  gradient_ = y_;
  for (const Bound& bound : bounds_) {
    const double more = bound.pulls - bound.begun;
    if (bound.a.valid()) gradient_[bound.a] -= more * bound.J_a;
    if (bound.b.valid()) gradient_[bound.b] -= more * bound.J_b;
  }
  for (const Contact* of : near_) {
    const Contact& contact = *of;
    const Vec3 more = contact.pulls - contact.begun;
    if (contact.a.valid()) gradient_[contact.a].noalias() -= contact.J_a.transpose() * more;
    if (contact.b.valid()) gradient_[contact.b].noalias() -= contact.J_b.transpose() * more;
  }
}

bool Newton::same_zones() const {
  return std::all_of(bounds_.begin(), bounds_.end(),
                     [](const Bound& bound) { return bound.active == bound.was_active; }) &&
         std::all_of(near_.begin(), near_.end(),
                     [](const Contact* contact) { return contact->zone == contact->was; });
}

bool Newton::any_slips() const {
  return std::any_of(near_.begin(), near_.end(),
                     [](const Contact* contact) { return contact->zone == Zone::slips; });
}

// As the matrix has them: in trees of joints, in twists.
template <class Rows>
Rows Newton::unscaled(PlaceIndex place, const Rows& J) const {
  if (matrix_ != &reduced_ || !place.valid()) return J;
  return J.lazyProduct(reduced_.scale(place));
}

void Newton::add_block(PlaceIndex a, PlaceIndex b, const auto& scaled_a, const auto& scaled_b) {
  const auto of_a = unscaled(a, scaled_a), of_b = unscaled(b, scaled_b);
  if (a.valid()) matrix_->block(a, a) += of_a.transpose().lazyProduct(of_a);
  if (b.valid()) matrix_->block(b, b) += of_b.transpose().lazyProduct(of_b);
  if (!a.valid() || !b.valid()) return;
  if (a > b) {
    matrix_->block(a, b) += of_a.transpose().lazyProduct(of_b);
  } else {
    matrix_->block(b, a) += of_b.transpose().lazyProduct(of_a);
  }
}

void Newton::assemble() {
  matrix_->set_identity();
  for (Bound& bound : bounds_) {
    bound.was_active = bound.active;
    if (!bound.active) continue;
    const double root = std::sqrt(bound.weight);
    using Line = Eigen::Matrix<double, 1, 6>;
    if (bound.way != kNone)
      reduced_.stiffen(bound.way, bound.weight * bound.along * bound.along);
    else
      add_block(bound.a, bound.b, Line(root * bound.J_a.transpose()),
                Line(root * bound.J_b.transpose()));
  }
  for (Contact* of : near_) {
    Contact& contact = *of;
    contact.was = contact.zone;
    if (contact.zone == Zone::open) continue;
    Eigen::Matrix3d root = Eigen::Matrix3d::Zero();
    if (contact.zone == Zone::sticks) {
      root.diagonal() << std::sqrt(contact.weight), std::sqrt(contact.weight_t),
          std::sqrt(contact.weight_t);
    } else {
      const double radial = std::sqrt(contact.stiffness), across = std::sqrt(contact.sideways);
      root.row(0) << radial, radial * contact.cosine, radial * contact.sine;
      root.row(1) << 0.0, -across * contact.sine, across * contact.cosine;
    }
    add_block(contact.a, contact.b, Reach(root * contact.J_a), Reach(root * contact.J_b));
  }
}

void Newton::find_step() {
  for (size_t i = 0; i < step_.size(); ++i) step_[i] = -gradient_[i];
  matrix_->solve(step_);
  slope_of_step_ = square_of_step_ = first_slope_ = 0.0;
  for (size_t i = 0; i < step_.size(); ++i) {
    first_slope_ += gradient_[i].dot(step_[i]);
    slope_of_step_ += y_[i].dot(step_[i]);
    square_of_step_ += step_[i].squaredNorm();
  }
  for (Bound& bound : bounds_) {
    bound.turns = 0.0;
    if (bound.a.valid()) bound.turns += bound.J_a.dot(step_[bound.a]);
    if (bound.b.valid()) bound.turns += bound.J_b.dot(step_[bound.b]);
  }
  for (Contact* of : near_) {
    Contact& contact = *of;
    contact.turns.setZero();
    if (contact.a.valid()) contact.turns.noalias() += contact.J_a * step_[contact.a];
    if (contact.b.valid()) contact.turns.noalias() += contact.J_b * step_[contact.b];
  }
}

// Updates the multipliers by the current impulses, and the slips that the aims assume. These change
// each other: the secant method for the slips of all contacts (D. Anderson, "Iterative procedures
// for nonlinear integral equations", 1965, with one step of memory).
Newton::Errors Newton::take_multipliers(bool first) {
  Errors most;
  const auto take = [&](double& held, double pulls, double response) {
    most.yielded = std::max(most.yielded, yields_ * std::abs(pulls - held) * response);
    held = pulls;
  };
  for (Bound& bound : bounds_) take(bound.held, bound.pulls, bound.response);
  double product = 0.0, square = 0.0;
  for (Contact* of : near_) {
    Contact& contact = *of;
    take(contact.held[0], contact.pulls[0], contact.response);
    if (!contact.rows[1]) continue;
    contact.held.tail<2>() = contact.pulls.tail<2>();
    const Vec3 missing = contact.missing - contact.moves;
    const double slip = length_of(missing[1], missing[2]);
    contact.slip_error = slip - contact.slip;
    contact.bears = contact.pulls[0] > 0.0 || missing[0] > slip;
    if (!contact.bears) continue;
    most.slipped = std::max(most.slipped, std::abs(contact.slip_error));
    const double change = contact.slip_error - contact.last_error;
    product += contact.slip_error * change;
    square += change * change;
  }
  const double back =
      first || square == 0.0 ? 0.0 : std::clamp(product / square, kLeastBack, kMostBack);
  for (Contact* of : near_) {
    Contact& contact = *of;
    const double on = contact.slip + contact.slip_error;
    const double before = contact.last_slip + contact.last_error;
    const double next = contact.bears ? on - back * (on - before) : on;
    contact.last_slip = contact.slip;
    contact.last_error = contact.slip_error;
    contact.slip = std::max(next, 0.0);
  }
  set_bounds();
  return most;
}

// m/s
double Newton::furthest(const std::vector<Six>& change) {
  allowed_ = change;
  matrix_->project(allowed_);
  double most = 0.0;
  for (size_t i = 0; i < allowed_.size(); ++i) {
    const Body& body = bodies_[matrix_->body(i)];
    most = std::max(most, allowed_[i].norm() * body.root_mass.maxCoeff());
  }
  return most;
}

void Newton::give(SolverBodies& bodies) const {
  for (const Bound& bound : bounds_) bound.row->give(bodies, bound.pulls - bound.begun);
  for (const Contact* of : near_) {
    const Contact& contact = *of;
    const Vec3 more = contact.pulls - contact.begun;
    for (int k = 0; k < 3 && contact.rows[k]; ++k)
      contact.rows[k]->give(bodies, (k == 0 ? 1.0 : contact.friction[k - 1]) * more[k]);
  }
}

void Newton::go_on(double part) {
  for (size_t k = 0; k < y_.size(); ++k) y_[k] += part * step_[k];
  for (Bound& bound : bounds_) {
    bound.moves += part * bound.turns;
    bound.turns = 0.0;
  }
  for (Contact* of : near_) {
    Contact& contact = *of;
    contact.moves += part * contact.turns;
    contact.turns.setZero();
  }
  if (pulled_at_ != part) slope(0.0);
  in_zones_ = false;
  find_gradient();
}

bool Newton::solve(SolverBodies& bodies, double tolerance, int most_steps) {
  start(bodies);
  slope(0.0);
  go_on(0.0);
  double small = tolerance;  // error that ends Newton's method for these multipliers
  Errors last = {kHuge, kHuge};
  bool factored = false, done = false;
  for (int i = 0; i < most_steps; ++i) {
    if (furthest(gradient_) <= small) {
      const Errors errors = take_multipliers(last.slipped == kHuge);
      const bool more = look_at_far();
      done = !more && std::max(errors.yielded, errors.slipped) <= tolerance;
      if (done) break;
      const double least = errors.yielded > kFalls * last.yielded ? kYieldsLeast : kYieldsStiff;
      small = std::max(tolerance, kErrorLeft * std::max(errors.yielded, errors.slipped));
      if (errors.yielded > tolerance && yields_ > least) {
        set_weights(std::max(least, kStiffer * yields_));
        factored = false;
      }
      last = errors;
      pull_in_zones();
    }
    if (!factored || any_slips() || !same_zones()) {
      assemble();
      matrix_->factor();
      factored = true;
    }
    find_step();
    go_on(search());
  }
  give(bodies);
  return done;
}

}  // namespace ruedo::physics
