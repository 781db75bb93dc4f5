// Evening 2 in C++: around the arena by sonars. It stops before what is ahead; turn away.
#include <algorithm>
#include <cstdio>

#include "ruedo/client.h"

namespace rc = ruedo::client;

int main() {
  rc::LaunchOptions options;
  options.lockstep = 1;
  options.disable = {"p3at/camera"};
  const rc::Simulation sim = rc::launch("arena", options);
  const rc::Robot robot = sim.robot("p3at");
  const auto sonar = robot.sonar();  // in front: to 90, 50, 30, 10, -10, -30, -50, -90 degrees
  const auto pose = robot.pose();

  rc::Observations seen = sim.step(80);
  double ahead = 5.0;  // m
  while (seen.time() < 40.0) {
    if (const auto reading = seen.latest(sonar))
      ahead = *std::min_element(reading->ranges.begin() + 2, reading->ranges.begin() + 6);
    const double speed = ahead > 0.9 ? 0.25 : 0.0, turn = 0.0;  // Yours
    seen = sim.step(20, {robot.velocity_command(speed, turn)});
  }
  const rc::Pose truth = *seen.latest(pose);
  std::printf("ends at %.2f %.2f, %.2f m before something\n", truth.x(), truth.y(), ahead);
}
