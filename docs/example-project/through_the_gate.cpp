// Drives a P3-AT through a gate, towards the middle of what its laser range finder sees on both
// sides, and stops 4 m ahead. In lockstep: 20 steps of 5 ms, then the next command.
#include <ruedo/client.h>

#include <algorithm>
#include <iostream>

int main() {
  const auto sim = ruedo::client::connect("", {.name = "gate", .timeout = 30.0});
  const auto robot = sim.robot("p3at");
  double v = 0.0, omega = 0.0;
  while (true) {
    const auto seen = sim.step(20, {robot.velocity_command(v, omega)});
    const auto scan = seen.latest(robot.lrf());
    const auto odometry = seen.latest(robot.odometry());
    if (!scan || !odometry) continue;
    if (odometry->x > 4.0) break;
    const double left = std::min(scan->nearest(0.2, 1.5), 3.0),
                 right = std::min(scan->nearest(-1.5, -0.2), 3.0);
    v = 0.4;
    omega = std::clamp(0.5 * (left - right) - 0.8 * odometry->theta, -0.5, 0.5);
  }
  sim.step(100, {robot.velocity_command(0.0, 0.0)});
  std::cout << "through\n";
}
