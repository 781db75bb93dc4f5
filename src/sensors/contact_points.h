// Contacts as in messages: from the side of the sensor.
#pragma once

#include "ruedo/contact_point_t.hpp"
#include "ruedo/snapshot.h"
#include "world/model/body_layout.h"

namespace ruedo {

// as_a: the sensor is on link_a.
inline void put(const Contact& contact, bool as_a, const world::WorldModel& world,
                const world::BodyLayout& layout, contact_point_t& point) {
  point.body = world::body_name(world, layout, as_a ? contact.link_b : contact.link_a);
  for (int i = 0; i < 3; ++i) {
    point.position[i] = contact.position[i];
    point.normal[i] = as_a ? contact.normal[i] : -contact.normal[i];
  }
  point.force = contact.force;
  point.depth = contact.depth;
}

}  // namespace ruedo
