// The API for textbook programs, in C++; api.py and Api.java are its twins.
#include <ruedo/client.h>
#include <chrono>
#include <cmath>
#include <cstdio>

using namespace std::chrono_literals;
namespace rc = ruedo::client;

int main(int, char** argv) {
  rc::LaunchOptions options;
  options.rate = rc::kFast;
  options.noise = false;
  options.spawn = {"p3at@0,0", "carrier:arm@0,3"};
  options.disable = {"p3at/camera"};
  options.settings = {{"p3at/lrf.update_rate", 20}};
  options.timeout = 60s;
  const rc::Simulation sim = rc::launch("empty", options);
  const rc::Robot robot = sim.robot("p3at"), arm = sim.robot("arm");
  std::printf("rate %.0f\n", robot.lrf().info().rate);
  {
    const rc::Driving driving = robot.driving(0.3, 0.0);
    for (const auto& [scan, pose, odometry] :
         sim.synchronised(robot.lrf(), robot.pose(), robot.odometry())) {
      if (scan.utime != pose.utime || scan.utime != odometry.utime) return 1;
      if (pose.x() > 0.5) break;
    }
  }
  std::printf("drove %s\n", sim.body("p3at").pose().x() > 0.5 ? "True" : "False");
  arm.command_joints({{"forearm_joint", 0.4}});
  while (std::abs(arm.joint("forearm_joint").position() - 0.4) > 0.01) sim.sleep(100ms);
  std::printf("joint %s\n", rc::to_string(rc::JointMode::position));
  std::vector<int8_t> cells(10 * 20, 0);
  for (size_t row = 0; row < 10; ++row) cells[row * 20 + 15] = 100;
  const std::string file = std::string(argv[1]) + "/map.yaml";
  rc::Map(cells, 20, 0.1, {}).save(file);
  std::printf("ray %.2f\n", rc::load_map(file).ray(0.55, 0.5, 0.0));
}
