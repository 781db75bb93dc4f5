// ruedo/info: what runs here, in parts that fit a datagram.
#pragma once

#include <vector>

#include "engine/channels.h"
#include "ruedo/device_info_t.hpp"
#include "ruedo/world_info_t.hpp"
#include "world/model/body_layout.h"

namespace ruedo::engine {

// The head is copied into each part; the lists are cut where a part would exceed kMaxPartSize.
std::vector<world_info_t> make_world_info(const world_info_t& head, const world::WorldModel& world,
                                          const world::BodyLayout& layout,
                                          const std::vector<device_info_t>& devices,
                                          const Channels& channels);

}  // namespace ruedo::engine
