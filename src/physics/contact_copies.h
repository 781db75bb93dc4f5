// What Bullet keeps of the contacts of a pair of objects from substep to substep, made again in
// another copy of the world.
#pragma once

#include "physics/bullet.h"

namespace ruedo::physics {

// `to` is the same pair in the other copy; nothing was done with it yet, its objects are awake and
// where those of `from` are. Throws std::logic_error where Bullet keeps what cannot be copied.
void copy_contacts(const btBroadphasePair& from, btBroadphasePair& to, btDispatcher& dispatcher,
                   const btDispatcherInfo& info);

}  // namespace ruedo::physics
