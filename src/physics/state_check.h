// A state that cannot be: a number in it is an infinity or none at all. What is read is bounded
// (ruedo/quantity.h), and so are the speeds of bodies, so this should not happen; where it does,
// nothing of that state is published and the run ends.
#pragma once

#include <stdexcept>

#include "model/body_layout.h"
#include "ruedo/snapshot.h"

namespace ruedo::physics {

// Says which body or joint, at which time, and what to look for.
class StateError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Throws StateError for the first number that is not finite.
void check_finite(const Snapshot& snapshot, const model::WorldModel& world,
                  const model::BodyLayout& layout);

}  // namespace ruedo::physics
