// The run at each time of a log: its world, as requests changed it, and the ruedo/info that a log
// lacks.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "log/index.h"
#include "world/model/world_model.h"

namespace ruedo::run {

// The run of a log as its header has it.
struct LoggedRun {
  std::shared_ptr<const world::WorldModel> world;
  std::vector<std::string> disabled;  // devices
  std::vector<std::pair<std::string, std::string>> remaps;
  std::string warning;  // "" or in what it may not be that run's world
};
// Throws InputError when the world cannot be read, or EnvironmentError.
using LoadRun = std::function<LoggedRun(const log_header_t&)>;

class LogWorlds {
 public:
  struct Scene {
    SimTime from_us = 0;
    std::shared_ptr<const world::WorldModel> world;  // null: none is known
    std::vector<std::vector<uint8_t>> info;          // encoded world_info_t, in parts
  };

  LogWorlds(const log::Index& index, const LoadRun& load);

  const Scene& at(SimTime time_us) const { return scenes_[number(time_us)]; }
  size_t number(SimTime time_us) const;  // of the scene, from 0
  const std::vector<Scene>& scenes() const { return scenes_; }
  // "" or what cannot be shown, and why.
  const std::string& fault() const { return fault_; }

 private:
  std::vector<Scene> scenes_;  // never empty
  std::string fault_;
};

}  // namespace ruedo::run
