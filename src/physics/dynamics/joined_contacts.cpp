#include "physics/dynamics/joined_contacts.h"

#include <algorithm>
#include <cmath>

#include "physics/dynamics/friction_step.h"

namespace ruedo::physics {

namespace {

constexpr int kMostSweeps = 200;
constexpr double kOfTolerance = 0.1;  // so that the sweep that follows finds nothing left to do
// A row that moves by less than this part of what its bodies would alone is held by the joints.
constexpr double kHeld = 1e-9;

}  // namespace

// Capacity for usual mechanisms is reserved: steady runs do not allocate.
JoinedContacts::JoinedContacts() {
  constexpr size_t kRows = 3 * kMostContacts;
  rows_.reserve(kRows);
  contacts_.reserve(kMostContacts);
  bounds_.reserve(kRows);
  responses_.reserve(kRows * kRows);
  for (auto* list : {&velocities_, &impulses_, &before_, &headings_}) list->reserve(kRows);
}

void JoinedContacts::begin() {
  rows_.clear();
  contacts_.clear();
  bounds_.clear();
}

void JoinedContacts::add(Row& normal, Row& along, Row& across, double friction, double friction2) {
  Contact& contact = contacts_.emplace_back();
  contact.normal = rows_.size();
  rows_.push_back(&normal);
  if (!(friction > 0.0 && friction2 > 0.0 && along.inverse > 0.0 && across.inverse > 0.0)) return;
  contact.along = rows_.size();
  rows_.push_back(&along);
  contact.across = rows_.size();
  rows_.push_back(&across);
  contact.friction = friction;
  contact.friction2 = friction2;
}

void JoinedContacts::add(Row& row, double lever) {
  if (row.inverse == 0.0) return;
  bounds_.push_back({rows_.size(), contacts_.back().normal, lever});
  rows_.push_back(&row);
}

void JoinedContacts::start(const SolverBodies& bodies) {
  const size_t n = rows_.size();
  velocities_.resize(n);
  impulses_.resize(n);
  for (size_t i = 0; i < n; ++i) {
    velocities_[i] = rows_[i]->velocity(bodies);
    impulses_[i] = rows_[i]->impulse;
  }
  before_ = impulses_;
  headings_.assign(n, 0.0);
  for (Contact& contact : contacts_) {
    if (contact.along == kNone) continue;
    const double m1 = contact.friction, m2 = contact.friction2;
    const double k11 = m1 * m1 * (response(contact.along) + rows_[contact.along]->softness),
                 k22 = m2 * m2 * (response(contact.across) + rows_[contact.across]->softness),
                 k12 = m1 * m2 * responses_[contact.along * n + contact.across];
    const double largest = 0.5 * (k11 + k22) + length_of(0.5 * (k11 - k22), k12);
    contact.step = largest > 1e-12 ? 1.0 / largest : 0.0;
  }
}

double JoinedContacts::missing(size_t i) const {
  return rows_[i]->target - velocities_[i] - rows_[i]->softness * impulses_[i];
}

double JoinedContacts::relaxed(size_t i) const {
  const double whole = response(i) + rows_[i]->softness;
  return whole > kHeld * rows_[i]->response ? impulses_[i] + missing(i) / whole : impulses_[i];
}

// Returns the change in velocity, m/s or rad/s.
double JoinedContacts::change(size_t i, double wanted) {
  const double more = wanted - impulses_[i];
  if (more == 0.0) return 0.0;
  impulses_[i] = wanted;
  const size_t n = rows_.size();
  const double* of_i = &responses_[i * n];
  for (size_t j = 0; j < n; ++j) velocities_[j] += of_i[j] * more;
  return std::abs(more) * of_i[i];
}

double JoinedContacts::rub(const Contact& contact) {
  if (contact.along == kNone) return 0.0;
  const auto rubbing = [this](size_t i, double friction) {
    return Rubbing{friction, impulses_[i], missing(i), relaxed(i)};
  };
  const auto [p1, p2] =
      rubbed(rubbing(contact.along, contact.friction), rubbing(contact.across, contact.friction2),
             std::max(impulses_[contact.normal], 0.0), contact.step);
  const double first = change(contact.along, p1);
  return std::max(first, change(contact.across, p2));
}

double JoinedContacts::sweep(bool backwards) {
  const size_t n = contacts_.size();
  double worst = 0.0;
  for (size_t c = 0; c < n; ++c) worst = std::max(worst, rub(contacts_[backwards ? n - 1 - c : c]));
  for (const Bound& bound : bounds_) {
    const double most = bound.lever * std::max(impulses_[bound.normal], 0.0);
    worst = std::max(worst, change(bound.row, std::clamp(relaxed(bound.row), -most, most)));
  }
  for (size_t c = 0; c < n; ++c) {
    const size_t i = contacts_[backwards ? n - 1 - c : c].normal;
    worst = std::max(worst, change(i, std::clamp(relaxed(i), rows_[i]->lower, rows_[i]->upper)));
  }
  return worst;
}

// As Solver::go_on_along_conjugates.
void JoinedContacts::go_on_along_conjugates(double& last_square) {
  const size_t n = rows_.size();
  double square = 0.0;
  for (size_t i = 0; i < n; ++i)
    square += (impulses_[i] - before_[i]) * (impulses_[i] - before_[i]) * response(i);
  const double further = last_square > 0.0 ? square / last_square : 0.0;
  for (size_t i = 0; i < n; ++i) {
    const double step = impulses_[i] - before_[i];
    if (further < 1.0 && headings_[i] != 0.0) change(i, impulses_[i] + further * headings_[i]);
    headings_[i] = (further < 1.0 ? further * headings_[i] : 0.0) + step;
    before_[i] = impulses_[i];
  }
  last_square = square;
}

bool JoinedContacts::solve(SolverBodies& bodies, JointBlocks& blocks, double tolerance) {
  blocks.tell_responses(rows_, responses_);
  start(bodies);
  double last_square = 0.0;
  bool still = false;
  for (int i = 0; i < kMostSweeps && !still; ++i) {
    if (i > 0) go_on_along_conjugates(last_square);
    still = sweep(i % 2 == 1) <= kOfTolerance * tolerance;
  }
  for (size_t i = 0; i < rows_.size(); ++i)
    rows_[i]->give(bodies, impulses_[i] - rows_[i]->impulse);
  return still;
}

}  // namespace ruedo::physics
