// Creates the devices of a world: one sensor object for each, sorted into modules.
//
// Independent of the kinds of sensors: these come from sensor_kinds().
#pragma once

#include <string>
#include <vector>

#include "engine/channels.h"
#include "engine/command_inbox.h"
#include "engine/module.h"
#include "ruedo/device_info_t.hpp"
#include "ruedo/sensor.h"

namespace ruedo::engine {

struct FleetOptions {
  uint64_t seed = 1;
  bool noise = true;
  std::vector<std::string> disabled;  // "ROBOT/DEVICE"
  int epoch = 0;
  bool keep_going = false;     // instead of throwing, report an error and leave out the device
  RobotIndex only_robot = {};  // a robot that joins a running world
  int64_t first_step = 0;      // samples count from its time
};

struct Fleet {
  std::vector<ModuleSetup> modules;    // in schedule order
  std::vector<device_info_t> devices;  // robots in world order, their devices in module order
  std::vector<Input> inputs;
  bool refused = false;  // with keep_going: otherwise an exception would have been thrown
};

// Creates all devices and announces all channels. world and layout must outlive the fleet.
// Unsupported parts and faulty <sensor>s, which are left out, go to `findings`; a faulty element of
// Ruedo's own throws InputError.
Fleet make_fleet(const world::WorldModel& world, const world::BodyLayout& layout,
                 const FleetOptions& options, Channels& channels, Findings& findings);

// The start pose of a link's frame L in the world.
Pose initial_pose(const world::BodyLayout& layout, LinkIndex link);

}  // namespace ruedo::engine
