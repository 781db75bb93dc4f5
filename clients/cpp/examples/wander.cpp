// Wanders without bumping into things, by laser range finder and sonar; saves a camera picture and
// compares odometry with the true pose at the end.
#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <limits>
#include <map>
#include <set>
#include <string>

#include "ruedo/client.h"

namespace rc = ruedo::client;

namespace {

volatile std::sig_atomic_t interrupted = 0;

constexpr double kClearance = 0.7;  // m, from here on it turns away
constexpr double kSpeed = 0.35;     // m/s
constexpr double kTurnRate = 0.6;   // rad/s

constexpr const char* kUsage =
    "ruedo-wander-cpp [OPTION VALUE]...\n"
    "  --robot NAME        default: the first\n"
    "  --duration SECONDS  of sim time; default: until Ctrl-C\n"
    "  --url URL           of the server; default: LCM_DEFAULT_URL\n"
    "  --launch WORLD      start a private server with this world\n"
    "  --picture FILE      default: wander.jpg\n";
const std::set<std::string> kOptions = {"--robot", "--duration", "--url", "--launch", "--picture"};

// The nearest echo (m) of the transducers that look ahead, on the left (positive heading) or the
// right.
double nearest_echo(const rc::SonarReading& reading, const rc::DeviceInfo& sonar, bool left) {
  double nearest = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < reading.ranges.size() && i < sonar.elements.size(); ++i) {
    const double heading = sonar.elements[i][5];
    const bool ahead = std::abs(heading) < 1.0 && (heading >= 0.0) == left;
    if (ahead && reading.fired_utime[i] >= 0)
      nearest = std::min(nearest, static_cast<double>(reading.ranges[i]));
  }
  return nearest;
}

void wander(const rc::Robot& robot, double duration) {
  const auto lrf = robot.lrf();
  const auto devices = robot.devices();
  const bool has_sonar = std::any_of(devices.begin(), devices.end(),
                                     [](const auto& d) { return d.type == "sonar_t"; });
  const double start = lrf.latest().time();
  double turning =
      0.0;  // rad/s while it turns away; it keeps to one side, or it would get stuck in corners
  double now = start;
  while (!interrupted && now - start < duration) {
    const rc::Scan scan = lrf.next();
    now = scan.time();
    double left = scan.nearest(0.0, 1.2), right = scan.nearest(-1.2, 0.0);
    if (has_sonar) {
      const auto sonar = robot.sonar();
      const auto reading = sonar.latest();
      left = std::min(left, nearest_echo(reading, sonar.info(), true));
      right = std::min(right, nearest_echo(reading, sonar.info(), false));
    }
    if (std::min(left, right) > kClearance) {
      turning = 0.0;
      robot.set_velocity(kSpeed, 0.0);
    } else {
      if (turning == 0.0) turning = left > right ? kTurnRate : -kTurnRate;
      robot.set_velocity(0.0, turning);
    }
  }
}

struct Place {
  double x, y, heading;  // m, rad
};

// From one place to another, seen from the first.
Place moved(const Place& start, const Place& end) {
  const double x = end.x - start.x, y = end.y - start.y, c = std::cos(start.heading),
               s = std::sin(start.heading);
  return {c * x + s * y, c * y - s * x, std::remainder(end.heading - start.heading, 2.0 * M_PI)};
}

Place place(const rc::Pose& pose) { return {pose.x(), pose.y(), pose.heading()}; }
Place place(const rc::Odometry& odometry) { return {odometry.x, odometry.y, odometry.theta}; }

int run(std::map<std::string, std::string>& options) {
  rc::Simulation sim =
      options.count("--launch") ? rc::launch(options["--launch"]) : rc::connect(options["--url"]);
  const rc::Robot robot =
      options.count("--robot") ? sim.robot(options["--robot"]) : sim.robots().at(0);
  const double duration =
      options.count("--duration") ? std::stod(options["--duration"]) : rc::kForever;
  const Place pose_start = place(robot.pose().latest()),
              odometry_start = place(robot.odometry().latest());
  std::printf("%s wanders in %s%s\n", robot.name().c_str(), sim.world().c_str(),
              duration < rc::kForever ? "" : "; Ctrl-C ends it");
  std::fflush(stdout);

  wander(robot, duration);
  robot.stop().wait(10.0);

  for (const auto& device : robot.devices()) {
    if (device.type != "image_t") continue;
    const std::string file = options.count("--picture") ? options["--picture"] : "wander.jpg";
    robot.camera().latest().save(file);
    std::printf("camera    %s\n", file.c_str());
    break;
  }
  const Place truth = moved(pose_start, place(robot.pose().next()));
  const Place belief = moved(odometry_start, place(robot.odometry().next()));
  std::printf("true pose x %.3f m, y %.3f m, heading %.3f rad from where it began\n", truth.x,
              truth.y, truth.heading);
  std::printf("odometry  x %.3f m, y %.3f m, heading %.3f rad, which is %.3f m off\n", belief.x,
              belief.y, belief.heading, std::hypot(truth.x - belief.x, truth.y - belief.y));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  std::signal(SIGINT, [](int) { interrupted = 1; });
  std::map<std::string, std::string> options;
  for (int i = 1; i < argc; i += 2) {
    if (!kOptions.contains(argv[i]) || i + 1 == argc) {
      std::fputs(kUsage, stderr);
      return std::string(argv[i]) == "--help" ? 0 : 2;
    }
    options[argv[i]] = argv[i + 1];
  }
  try {
    return run(options);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "wander: %s\n", error.what());
    return 1;
  }
}
