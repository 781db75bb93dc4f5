// The benchmark's world: square rooms in a grid, one P3-AT circling in each of the first N.
#pragma once

#include <string>

namespace ruedo::bench {

inline constexpr double kRoomSize_m = 6.0;

// Rooms on a side of the square for that many robots: 4 up to 16 robots, then just enough.
int rooms_on_a_side(int robots);

// The world as SDF text. Walls are 0.2 m thick and 1 m high, each inner one with a door of 1.2 m in
// its middle; robot rI starts 1 m right of its room's centre, heading along +y, so that 0.4 m/s and
// 0.4 rad/s circle the centre.
std::string bench_world(int robots);

}  // namespace ruedo::bench
