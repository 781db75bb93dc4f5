// The devices of a world: one sensor object for each, made by its kind, and sorted into modules.
//
// Nothing here knows any kind of sensor; what there is comes from sensor_kinds().
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
  bool keep_going = false;     // what would throw is an error finding, and the device left out
  RobotIndex only_robot = {};  // one that joins a world that runs
  int64_t first_step = 0;      // samples count from its time
};

struct Fleet {
  std::vector<ModuleSetup> modules;  // in the order of the schedule
  std::vector<device_info_t>
      devices;  // robots in world order, their devices in the order of the modules
  std::vector<Input> inputs;
  bool refused = false;  // with keep_going: without it, making them would have thrown
};

// Makes all devices and announces all channels. world and layout must outlive the fleet. What is
// not supported goes to `findings`, and so does a <sensor> that is written wrongly, which is left
// out; a wrong element of Ruedo's own throws InputError.
Fleet make_fleet(const model::WorldModel& world, const model::BodyLayout& layout,
                 const FleetOptions& options, Channels& channels, Findings& findings);

// The pose of a link's frame L at the start, in the world.
Pose initial_pose(const model::BodyLayout& layout, LinkIndex link);

}  // namespace ruedo::engine
