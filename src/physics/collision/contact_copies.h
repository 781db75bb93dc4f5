// Recreates Bullet's record of a pair's contacts between substeps, in another copy of the world.
#pragma once

#include "physics/base/bullet.h"
#include "ruedo/state_archive.h"

namespace ruedo::physics {

// `to` is the same pair in the other copy; it is new, its objects are awake and at the poses of
// those of `from`. Throws std::logic_error if Bullet's state cannot be copied.
void copy_contacts(const btBroadphasePair& from, btBroadphasePair& to, btDispatcher& dispatcher,
                   const btDispatcherInfo& info);

// Writes that of a pair, or reads it into one that is new, as above. Throws ArchiveError likewise.
void exchange_contacts(StateArchive& archive, btBroadphasePair& pair, btDispatcher& dispatcher,
                       const btDispatcherInfo& info);

}  // namespace ruedo::physics
