// The module "world": ruedo/world, the poses of all bodies that can move.
#pragma once

#include "engine/channels.h"
#include "engine/module.h"
#include "ruedo/snapshot.h"
#include "ruedo/world_state_t.hpp"
#include "world/model/body_layout.h"

namespace ruedo::engine {

inline constexpr size_t kMaxPartSize = 60'000;  // bytes of one part of a long message

// A module like any other, with one device: the simulation.
ModuleSetup world_state_module(const world::WorldModel& world, const world::BodyLayout& layout,
                               int epoch, Channels& channels);

// Its device, for bodies or an epoch that are others now. channel: as the module announced it.
std::unique_ptr<Sensor> world_state_sensor(const world::WorldModel& world,
                                           const world::BodyLayout& layout, int epoch,
                                           ChannelIndex channel);

// The same of one state.
std::vector<world_state_t> world_states(const world::WorldModel& world,
                                        const world::BodyLayout& layout, int epoch,
                                        const Snapshot& state);

// A hash of what a step's state is, for ruedo/tick: of every body's and robot's pose and motion,
// bit for bit.
int64_t state_hash(const Snapshot& snapshot);

}  // namespace ruedo::engine
