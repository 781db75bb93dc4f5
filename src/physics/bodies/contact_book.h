// The contacts of a step: read from Bullet's manifolds after each substep, put into a fixed order,
// and grouped by the bodies involved. Those between bodies at rest are kept from step to step.
#pragma once

#include <algorithm>
#include <iterator>
#include <memory>
#include <span>
#include <vector>

#include "physics/base/bullet.h"
#include "ruedo/snapshot.h"
#include "ruedo/state_archive.h"

namespace ruedo::physics {

class ContactBook {
 public:
  explicit ContactBook(size_t bodies) { resize(bodies); }

  void resize(size_t bodies);
  // Capacity reserved in advance, so that new contacts do not allocate in the running loop. Unused
  // capacity costs address space only.
  size_t room() const { return contacts_.capacity(); }

  // Whether the body has a contact at rest.
  bool rests(BodyIndex body) const { return rests_[body]; }
  // Starts a step of that length (s). rests(contact) returns whether the bodies of a contact rest
  // from now on, for the contacts of the last step; with `any_woke` also for resting contacts.
  template <class Rests>
  void begin(double step_s, bool any_woke, const Rests& rests);
  // Adds the manifolds' contacts after a substep; the last substep defines which bodies are near.
  void add(const std::vector<btPersistentManifold*>& manifolds, bool last);
  // Ends the step.
  void finish();

  void exchange(StateArchive& archive);

  // Those with a force.
  const std::vector<Contact>& all() const { return contacts_; }
  const std::shared_ptr<const std::vector<Contact>>& at_rest() const { return resting_; }
  // Contacts are grouped by body only once somebody asks.
  std::span<const Contact> touching(BodyIndex body) {
    return of(body, touching_, contacts_, resting_touching_, *resting_);
  }
  std::span<const Contact> near(BodyIndex body) {
    return of(body, near_, near_only_, resting_near_, *near_at_rest_);
  }

 private:
  // Contacts grouped by body, with that body as `a`.
  class ByBody {
   public:
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

  using List = std::shared_ptr<const std::vector<Contact>>;

  std::span<const Contact> of(BodyIndex body, ByBody& moving, const std::vector<Contact>& contacts,
                              ByBody& resting, const std::vector<Contact>& at_rest);
  void make_room(size_t bodies);
  void merge();
  template <class Rests>
  static void put_to_rest(const std::vector<Contact>& contacts, List& resting, bool any_woke,
                          const Rests& rests);
  static void sort(std::vector<Contact>& contacts);
  void note_resting();

  double step_s_ = 0.0;
  bool several_ = false;  // several substeps share the manifolds
  std::vector<Contact> contacts_;
  std::vector<Contact> near_only_;  // of the last substep
  std::vector<Contact> merged_;     // scratch
  ByBody touching_, near_;
  List resting_ = std::make_shared<std::vector<Contact>>(), near_at_rest_ = resting_;
  ByBody resting_touching_, resting_near_;
  IndexedVector<BodyIndex, char> rests_;
  std::vector<Contact> both_;  // scratch: a body's contacts of both kinds
};

template <class Rests>
void ContactBook::put_to_rest(const std::vector<Contact>& contacts, List& resting, bool any_woke,
                              const Rests& rests) {
  if (!any_woke && std::none_of(contacts.begin(), contacts.end(), rests)) return;
  auto list = std::make_shared<std::vector<Contact>>();
  for (const auto* from : {resting.get(), &contacts})
    std::copy_if(from->begin(), from->end(), std::back_inserter(*list), rests);
  sort(*list);
  resting = std::move(list);
}

template <class Rests>
void ContactBook::begin(double step_s, bool any_woke, const Rests& rests) {
  const List before = near_at_rest_;
  put_to_rest(contacts_, resting_, any_woke, rests);
  put_to_rest(near_only_, near_at_rest_, any_woke, rests);
  if (near_at_rest_ != before) note_resting();
  step_s_ = step_s;
  several_ = false;
  contacts_.clear();
  near_only_.clear();
  touching_.clear();
  near_.clear();
}

}  // namespace ruedo::physics
