// Evening 1 in C++: a square by odometry. It drives the first side; turn, and repeat that.
#include <cmath>
#include <cstdio>

#include "ruedo/client.h"

namespace rc = ruedo::client;

constexpr double kSide = 2.0;  // m

int main() {
  rc::LaunchOptions options;
  options.lockstep = 1;
  options.spawn = {"p3at@0,0"};
  options.disable = {"p3at/camera"};
  options.settings = {{"p3at/odometry.track_error", 0.02}};
  const rc::Simulation sim = rc::launch("empty", options);
  const rc::Robot robot = sim.robot("p3at");
  const auto odometry = robot.odometry();
  const auto pose = robot.pose();

  rc::Observations seen = sim.step(20);  // of 5 ms
  const auto drive = [&](double speed, double turn) {
    seen = sim.step(20, {robot.velocity_command(speed, turn)});  // m/s, rad/s, for 0.1 s
    return *seen.latest(odometry);
  };
  rc::Odometry now = *seen.latest(odometry);
  const rc::Odometry begin = now;
  while (std::hypot(now.x - begin.x, now.y - begin.y) < kSide) now = drive(0.3, 0.0);
  // Yours: turn left until now.theta has grown by pi / 2, slower towards the end; four times.
  now = drive(0.0, 0.0);

  const rc::Pose truth = *seen.latest(pose);
  std::printf("odometry %.3f %.3f, truly at %.3f %.3f\n", now.x, now.y, truth.x(), truth.y());
}
