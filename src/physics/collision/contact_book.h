// The contacts of a step: read from Bullet's manifolds after each substep, put into a fixed order,
// and grouped by the bodies involved.
#pragma once

#include <span>
#include <vector>

#include "physics/base/bullet.h"
#include "ruedo/snapshot.h"
#include "ruedo/state_archive.h"

namespace ruedo::physics {

class ContactBook {
 public:
  explicit ContactBook(size_t bodies) : touching_(bodies), near_(bodies) { make_room(bodies); }

  void resize(size_t bodies) { touching_.resize(bodies), near_.resize(bodies), make_room(bodies); }
  // Capacity reserved in advance, so that new contacts do not allocate in the running loop. What is
  // not used costs address space only.
  size_t room() const { return contacts_.capacity(); }

  // Starts a step of that length (s).
  void clear(double step_s);
  // Adds the manifolds' contacts after a substep; the last substep defines what is near. If
  // everything sleeps, one call counts as `substeps`.
  void add(const std::vector<btPersistentManifold*>& manifolds, int substeps, bool last);
  // Ends the step.
  void finish();

  void exchange(StateArchive& archive) {
    touching_.clear();
    near_.clear();
    archive(step_s_, several_, contacts_, near_only_);
  }

  const std::vector<Contact>& all() const { return contacts_; }  // contacts with a force
  // Contacts are grouped by body only once somebody asks.
  std::span<const Contact> touching(BodyIndex body) { return touching_.of(body, contacts_); }
  std::span<const Contact> near(BodyIndex body) { return near_.of(body, near_only_); }

 private:
  // Contacts grouped by body, with that body as `a`.
  class ByBody {
   public:
    explicit ByBody(size_t bodies) : ranges_(bodies, {0, 0}) { bodies_.reserve(bodies); }
    void resize(size_t bodies) { ranges_.resize(bodies, {0, 0}), bodies_.reserve(bodies); }
    void reserve(size_t contacts) { entries_.reserve(contacts); }
    void clear();
    std::span<const Contact> of(BodyIndex body, const std::vector<Contact>& contacts) {
      if (bodies_.empty() && !contacts.empty()) group(contacts);
      const auto& range = ranges_[body];
      return {entries_.data() + range.first, range.second};
    }

   private:
    void group(const std::vector<Contact>& contacts);

    std::vector<BodyIndex> bodies_;  // with an entry
    std::vector<Contact> entries_;
    IndexedVector<BodyIndex, std::pair<size_t, size_t>> ranges_;  // first, count
  };

  void make_room(size_t bodies);
  void merge();

  double step_s_ = 0.0;
  bool several_ = false;  // several substeps share the manifolds
  std::vector<Contact> contacts_;
  std::vector<Contact> near_only_;  // of the last substep
  std::vector<Contact> merged_;     // scratch
  ByBody touching_, near_;
};

}  // namespace ruedo::physics
