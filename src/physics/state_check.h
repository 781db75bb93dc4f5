// Detects a state with infinite or NaN values. Inputs are bounded (ruedo/quantity.h), and so are
// the speeds of bodies, so this should not happen; if it does, nothing of that state is published
// and the run ends.
#pragma once

#include <stdexcept>

#include "ruedo/snapshot.h"
#include "world/model/body_layout.h"

namespace ruedo::physics {

// Names the body or joint, the time, and likely causes.
class StateError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Throws StateError for the first value that is not finite.
void check_finite(const Snapshot& snapshot, const world::WorldModel& world,
                  const world::BodyLayout& layout);

}  // namespace ruedo::physics
