// Converts manifolds to contacts. Their order is by links and then by position, independent of
// Bullet's.
#include "physics/bodies/contact_book.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "physics/bodies/rigid_bodies.h"

namespace ruedo::physics {

namespace {

// Contacts of several substeps within this distance are merged.
constexpr double kSamePlace_m = 5e-3;
// Reserved capacity: a face has four points, and most bodies touch at most two others.
constexpr size_t kRoom = 64, kRoomPerBody = 8;

// The entry of a child shape in one of ObjectInfo's lists; Bullet gives no child index for a single
// shape.
bool earlier(const Contact& a, const Contact& b) {
  const auto key = [](const Contact& c) {
    return std::tuple(c.body_a, c.link_a, c.body_b, c.link_b, c.position.x(), c.position.y(),
                      c.position.z(), c.depth);
  };
  return key(a) < key(b);
}

Contact swapped(const Contact& contact) {
  Contact other = contact;
  std::swap(other.link_a, other.link_b);
  std::swap(other.shape_a, other.shape_b);
  std::swap(other.body_a, other.body_b);
  other.normal = -contact.normal;
  other.friction = -contact.friction;
  return other;
}

}  // namespace

void ContactBook::ByBody::clear() {
  for (const BodyIndex body : bodies_) ranges_[body] = {0, 0};
  bodies_.clear();
}

void ContactBook::ByBody::group(const std::vector<Contact>& contacts) {
  const auto count = [this](BodyIndex body) {
    if (body.valid() && ranges_[body].second++ == 0) bodies_.push_back(body);
  };
  for (const Contact& contact : contacts) {
    count(contact.body_a);
    count(contact.body_b);
  }
  size_t first = 0;
  for (const BodyIndex body : bodies_) {
    auto& range = ranges_[body];
    range.first = std::exchange(first, first + range.second);
    range.second = 0;
  }
  entries_.resize(first);
  const auto place = [this](const Contact& contact) {
    auto& range = ranges_[contact.body_a];
    entries_[range.first + range.second++] = contact;
  };
  for (const Contact& contact : contacts) {
    if (contact.body_a.valid()) place(contact);
    if (contact.body_b.valid()) place(swapped(contact));
  }
  for (const BodyIndex body : bodies_) {
    const auto begin = entries_.begin() + static_cast<std::ptrdiff_t>(ranges_[body].first);
    std::sort(begin, begin + static_cast<std::ptrdiff_t>(ranges_[body].second), earlier);
  }
}

void ContactBook::make_room(size_t bodies) {
  const size_t contacts = kRoom + kRoomPerBody * bodies;
  for (auto* list : {&contacts_, &near_only_, &merged_}) list->reserve(contacts);
  touching_.reserve(2 * contacts);
  near_.reserve(2 * contacts);
}

void ContactBook::resize(size_t bodies) {
  for (ByBody* each : {&touching_, &near_, &resting_touching_, &resting_near_})
    each->resize(bodies);
  rests_.resize(bodies);
  make_room(bodies);
}

void ContactBook::sort(std::vector<Contact>& contacts) {
  std::sort(contacts.begin(), contacts.end(), earlier);
}

// After the contacts at rest have changed. Bodies that touch are near, too.
void ContactBook::note_resting() {
  resting_touching_.clear();
  resting_near_.clear();
  std::fill(rests_.begin(), rests_.end(), 0);
  for (const Contact& contact : *near_at_rest_) {
    for (const BodyIndex body : {contact.body_a, contact.body_b})
      if (body.valid()) rests_[body] = 1;
  }
}

std::span<const Contact> ContactBook::of(BodyIndex body, ByBody& moving,
                                         const std::vector<Contact>& contacts, ByBody& resting,
                                         const std::vector<Contact>& at_rest) {
  const std::span<const Contact> here = moving.of(body, contacts);
  if (!rests_[body]) return here;
  const std::span<const Contact> there = resting.of(body, at_rest);
  if (here.empty()) return there;
  both_.assign(here.begin(), here.end());  // something driven, which both touch
  both_.insert(both_.end(), there.begin(), there.end());
  return both_;
}

void ContactBook::exchange(StateArchive& archive) {
  std::vector<Contact> resting = *resting_, near = *near_at_rest_;
  archive(step_s_, several_, contacts_, near_only_, resting, near);
  if (!archive.reads()) return;
  touching_.clear();
  near_.clear();
  resting_ = std::make_shared<std::vector<Contact>>(std::move(resting));
  near_at_rest_ = std::make_shared<std::vector<Contact>>(std::move(near));
  note_resting();
}

void ContactBook::add(const std::vector<btPersistentManifold*>& manifolds, bool last) {
  several_ |= !last;
  for (const btPersistentManifold* each : manifolds) {
    const btPersistentManifold& manifold = *each;
    const ObjectInfo& a = info_of(*manifold.getBody0());
    const ObjectInfo& b = info_of(*manifold.getBody1());
    for (int p = 0; p < manifold.getNumContacts(); ++p) {
      const btManifoldPoint& point = manifold.getContactPoint(p);
      Contact contact;
      contact.body_a = a.body;
      contact.body_b = b.body;
      const ObjectInfo::Shape &shape_a = shape_of(a, point.m_index0),
                              &shape_b = shape_of(b, point.m_index1);
      contact.link_a = shape_a.link;
      contact.link_b = shape_b.link;
      contact.shape_a = shape_a.collision;
      contact.shape_b = shape_b.collision;
      contact.position = from_bt(point.getPositionWorldOnB());
      contact.normal = from_bt(point.m_normalWorldOnB);
      contact.depth = -point.getDistance();
      const bool touches = point.getAppliedImpulse() > 0.0 || contact.depth >= 0.0;
      if (touches) {
        const double per_s = 1.0 / step_s_;
        contact.force = point.getAppliedImpulse() * per_s;
        contact.friction =
            per_s * from_bt(point.m_appliedImpulseLateral1 * point.m_lateralFrictionDir1 +
                            point.m_appliedImpulseLateral2 * point.m_lateralFrictionDir2);
      }
      // Static things come second; of two bodies the one with the lower number comes first.
      if (!contact.body_a.valid() || (contact.body_b.valid() && contact.body_b < contact.body_a))
        contact = swapped(contact);
      if (touches) {
        contacts_.push_back(contact);
      } else if (last) {
        near_only_.push_back(contact);
      }
    }
  }
}

// The same place in several substeps: their impulses are added.
void ContactBook::merge() {
  merged_.clear();
  size_t first = 0;  // of contacts between the same two links
  for (const Contact& contact : contacts_) {
    if (!merged_.empty() &&
        (merged_.back().link_a != contact.link_a || merged_.back().link_b != contact.link_b)) {
      first = merged_.size();
    }
    const auto same =
        std::find_if(merged_.begin() + static_cast<std::ptrdiff_t>(first), merged_.end(),
                     [&](const Contact& other) {
                       return (other.position - contact.position).norm() < kSamePlace_m;
                     });
    if (same == merged_.end()) {
      merged_.push_back(contact);
    } else {
      same->force += contact.force;
      same->friction += contact.friction;
      same->depth = std::max(same->depth, contact.depth);
    }
  }
  contacts_.swap(merged_);
}

void ContactBook::finish() {
  if (contacts_.empty() && near_only_.empty()) return;
  sort(contacts_);
  if (several_) merge();
  near_only_.insert(near_only_.end(), contacts_.begin(), contacts_.end());
}

}  // namespace ruedo::physics
