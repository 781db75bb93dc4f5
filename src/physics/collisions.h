// Contacts that Bullet finds one at a time, or too late, found at once: of boxes and cylinders on
// planes, and of boxes with each other.
//
// Bullet gives a body on a plane one point a substep, and two boxes none before they overlap. What
// is put down would first tip over that one corner, or fall by a rounding error and be stopped: a
// stack rocked for a second.
#pragma once

#include "physics/bullet.h"

namespace ruedo::physics {

// For all worlds.
void register_collisions(btCollisionDispatcher& dispatcher);

}  // namespace ruedo::physics
