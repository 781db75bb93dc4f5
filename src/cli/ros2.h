// --ros2: a run as a ROS 2 node. Without Cyclone DDS in this build it says what is missing.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "ruedo/bus.h"

namespace ruedo::run {
class Server;
}

namespace ruedo::cli {

struct Ros2Arguments {
  bool on = false;
  std::string distro;        // "": $ROS_DISTRO, or jazzy
  double clock_hz = 100.0;
};

// The bus of a server that is a ROS 2 node. Made before the server; without --ros2 it is the bus itself.
class Ros2Bus {
 public:
  // Throws InputError, and EnvironmentError when this build has no Cyclone DDS.
  Ros2Bus(Bus& bus, const Ros2Arguments& arguments);
  ~Ros2Bus();

  Bus& bus();

  // Runs the node for as long as the returned object lives, which is before the server ends. topics: --remap of ROS names; channels: of
  // the bus's. Null without --ros2. Throws InputError and EnvironmentError.
  std::shared_ptr<void> open(run::Server& server, std::vector<std::pair<std::string, std::string>> topics,
                             std::vector<std::pair<std::string, std::string>> channels);

 private:
  struct Impl;
  Bus& inner_;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ruedo::cli
