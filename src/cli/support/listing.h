// How robots, devices and channels are printed, by run and info.
#pragma once

#include <cstdio>
#include <string>
#include <vector>

#include "ruedo/world_info_t.hpp"

namespace ruedo::cli {

// Channels by robot, with type, rate and direction. Robots that are alike are printed once.
void print_channels(FILE* out, const std::vector<world_info_t>& info);

// Robots with drives and limits, devices with their poses and ranges.
void print_devices(FILE* out, const std::vector<world_info_t>& info);

// "1 robot", "2 robots".
inline std::string counted(size_t n, const char* what) {
  return std::to_string(n) + " " + what + (n == 1 ? "" : "s");
}

}  // namespace ruedo::cli
