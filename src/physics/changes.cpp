#include "physics/changes.h"

#include <atomic>

namespace ruedo::physics {

void Changes::forget(size_t bodies) {
  static std::atomic<uint64_t> worlds{0};
  source_ = {++worlds, 0};
  changes_ = 0;
  end_[0] = 0;
  latest_.assign(bodies, 0);
  ring_.resize(3 * bodies);  // those of a state, and as many as are ever requested
}

void Changes::add_state(const std::vector<BodyIndex>& changed) {
  for (const BodyIndex body : changed) {
    latest_[body] = changes_;
    ring_[changes_++ % ring_.size()] = body;
  }
  ++source_.state;
  end_[source_.state % kStates] = changes_;
}

}  // namespace ruedo::physics
