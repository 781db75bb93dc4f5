// Finds contacts at once that Bullet finds one at a time or too late: of boxes and cylinders on
// planes, and between boxes.
//
// Bullet gives a body on a plane one point per substep, and two boxes none before they overlap. A
// body that is put down would first tip over that corner, or fall by a rounding error and be
// stopped: a stack would rock for a second.
#pragma once

#include "physics/base/bullet.h"

namespace ruedo::physics {

// Farther apart than this nothing of two sides is a contact.
inline constexpr btScalar kReach_m = 0.02;

// Registers them for all worlds.
void register_collisions(btCollisionDispatcher& dispatcher);

}  // namespace ruedo::physics
