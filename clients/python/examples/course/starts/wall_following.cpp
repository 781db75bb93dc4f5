// Evening 3 in C++: along the walls of room.sdf, on the right. Complete the controller.
#include <cmath>
#include <cstdio>

#include "ruedo/client.h"

namespace rc = ruedo::client;

constexpr double kApart = 0.8;  // m

int main(int argc, char** argv) {
  rc::LaunchOptions options;
  options.lockstep = 1;
  options.disable = {"p3at/camera"};
  const rc::Simulation sim = rc::launch(argc > 1 ? argv[1] : "room.sdf", options);
  const rc::Robot robot = sim.robot("p3at");
  const auto lrf = robot.lrf();

  rc::Observations seen = sim.step(20);
  double apart = 0.0;  // m
  while (seen.time() < 40.0) {
    const rc::Scan scan = *seen.latest(lrf);
    apart = scan.nearest(-1.6, -0.8);  // Yours: a line through these hits has an angle, too
    double speed = 0.3, turn = 0.0;    // Yours: of kApart, apart and the angle
    if (scan.nearest(-0.4, 0.4) < kApart + 0.6) {  // a corner
      speed = 0.1;
      turn = 0.8;
    }
    seen = sim.step(20, {robot.velocity_command(speed, turn)});
  }
  std::printf("%.2f m from the wall, and %.1f are asked for\n", apart, kApart);
}
