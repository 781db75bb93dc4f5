// The options and parts for serving a world, for the commands run and edit.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "cli/support/commands.h"
#include "cli/support/ros2.h"

namespace ruedo::cli {

struct RunArguments {
  WorldArguments world;
  uint64_t seed = 1;
  std::string rate, duration, lcm, record, control = "on", lease_policy = "pause";
  uint64_t record_limit = 0;
  int lockstep = 0;
  double lease = 10.0;
  std::string snapshots, restore;
  std::string save;  // the file that SAVE writes
  std::vector<std::string> remaps, wait_for;
  std::string view;
  bool viewed = false;
  std::vector<std::string> temporary;  // paths
  bool paused = false, quiet = false, strict = false, watch_stdin = false, follow_stdin = false,
       sandboxed = false;
  int threads = 0;
  Ros2Arguments ros2;
  bool foxglove = false;
  std::string foxglove_address;
};

// Serves it until the end; returns the exit code.
int run_world(const RunArguments& arguments);

}  // namespace ruedo::cli
