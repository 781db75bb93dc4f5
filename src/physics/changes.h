// Which bodies changed in which of the last states: a snapshot that holds an earlier state is
// brought up to date without reading again what rests.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "ruedo/snapshot.h"

namespace ruedo::physics {

class Changes {
 public:
  // No earlier state of these bodies can be brought up to date: it was another world's, or they
  // were replaced.
  void forget(size_t bodies);
  // A new state, in which these bodies may differ from the last one; some may be there twice.
  void add_state(const std::vector<BodyIndex>& changed);
  Snapshot::Source source() const { return source_; }
  // Calls act(body) once for each body that changed after a state. Returns false, without calling
  // it, if that is not known, or if most bodies changed.
  template <class Act>
  bool for_each_since(const Snapshot::Source& before, Act&& act) const;

 private:
  static constexpr uint64_t kStates = 256;  // more than a run has in flight
  Snapshot::Source source_;
  std::vector<BodyIndex> ring_;                // changes of all states, in order
  uint64_t changes_ = 0;                       // how many there were
  std::array<uint64_t, kStates> end_{};        // by a state's number: how many there were then
  IndexedVector<BodyIndex, uint64_t> latest_;  // a body's last change, as its number
};

template <class Act>
bool Changes::for_each_since(const Snapshot::Source& before, Act&& act) const {
  if (before.world != source_.world || source_.state - before.state >= kStates) return false;
  const uint64_t first = end_[before.state % kStates];
  if (changes_ - first > latest_.size()) return false;
  for (uint64_t i = first; i < changes_; ++i) {
    const BodyIndex body = ring_[i % ring_.size()];
    if (latest_[body] == i) act(body);
  }
  return true;
}

}  // namespace ruedo::physics
