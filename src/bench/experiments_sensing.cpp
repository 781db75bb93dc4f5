// E3, the laser range finder among obstacles, and E5, noise on and off: against distances computed
// here, from the obstacles' outlines and not from the scene that the rays see.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>

#include <fmt/format.h>

#include "bench/experiments.h"
#include "engine/fleet.h"
#include "report/svg_plot.h"
#include "robot/robots.h"
#include "ruedo/math.h"
#include "ruedo/planar_lidar_t.hpp"
#include "scene/pictures/render_scene.h"
#include "scene/rays/ray_scene.h"
#include "world/load.h"
#include "world/mesh/codecs.h"

namespace ruedo::bench {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kHeight = 0.8;  // m, of all obstacles; the LRF sits lower
constexpr double kRobotX = 0.3, kRobotY = -0.2, kRobotYaw = 0.4;
constexpr double kLaserAhead = 0.16;  // m, of base_link
constexpr double kNoise_m = 0.01;     // E5's sigma

// Standing upright: a box of two lengths, or a cylinder of radius a.
struct Obstacle {
  bool round;
  double x, y, yaw, a, b;
};

const Obstacle kObstacles[] = {
    {false, 0, 4.1, 0, 8.4, 0.2},      {false, 0, -4.1, 0, 8.4, 0.2},
    {false, 4.1, 0, 0, 0.2, 8},        {false, -4.1, 0, 0, 0.2, 8},
    {false, 2.2, 1.5, 0.5, 0.6, 0.6},  {false, -1.2, 2.2, -0.35, 1.0, 0.5},
    {false, 2.4, -1.8, 0.3, 0.8, 0.8}, {true, 3.2, 0.3, 0, 0.25, 0},
    {true, 0.9, 2.6, 0, 0.3, 0},       {true, 1.2, -2.9, 0, 0.35, 0},
    {true, 1.9, 0.1, 0, 0.08, 0},
};

// Distance from (x, y) along (cos, sin) of `angle` to an obstacle's outline, +inf when it is
// missed.
double distance_to(const Obstacle& o, double x, double y, double angle) {
  const double c = math::cos(o.yaw), s = math::sin(o.yaw);
  const double px = c * (x - o.x) + s * (y - o.y),
               py = -s * (x - o.x) + c * (y - o.y);  // in its own axes
  const double dx = math::cos(angle - o.yaw), dy = math::sin(angle - o.yaw);
  if (o.round) {
    const double along = -(px * dx + py * dy), off2 = px * px + py * py - along * along;
    if (off2 > o.a * o.a) return kInfinity;
    const double t = along - std::sqrt(o.a * o.a - off2);
    return t >= 0 ? t : kInfinity;
  }
  double enter = -kInfinity, leave = kInfinity;
  for (const auto& [p, d, half] : {std::tuple{px, dx, 0.5 * o.a}, std::tuple{py, dy, 0.5 * o.b}}) {
    if (d == 0) {
      if (std::abs(p) > half) return kInfinity;
      continue;
    }
    const double t1 = (-half - p) / d, t2 = (half - p) / d;
    enter = std::max(enter, std::min(t1, t2));
    leave = std::min(leave, std::max(t1, t2));
  }
  return enter <= leave && enter >= 0 ? enter : kInfinity;
}

std::string world_text() {
  std::string text = fmt::format(
      "<sdf version='1.9'><world "
      "name='obstacles'><include><uri>model://sun</uri></include><include><uri>model://"
      "ground_plane</uri></include>"
      "<include><uri>model://p3at</uri><name>p3at</name><pose>{} {} 0 0 0 {}</pose></include>",
      kRobotX, kRobotY, kRobotYaw);
  int number = 0;
  for (const Obstacle& o : kObstacles) {
    const std::string shape =
        o.round ? fmt::format("<cylinder><radius>{}</radius><length>{}</length></cylinder>", o.a,
                              kHeight)
                : fmt::format("<box><size>{} {} {}</size></box>", o.a, o.b, kHeight);
    text += fmt::format(
        "<model name='obstacle_{}'><static>true</static><pose>{} {} {} 0 0 {}</pose><link "
        "name='link'>"
        "<collision name='c'><geometry>{}</geometry></collision><visual "
        "name='v'><geometry>{}</geometry>"
        "<material><diffuse>{}</diffuse></material></visual></link></model>",
        ++number, o.x, o.y, 0.5 * kHeight, o.yaw, shape, shape,
        o.round ? "0.85 0.55 0.2 1" : "0.25 0.4 0.65 1");
  }
  return text + "</world></sdf>";
}

void set(Element& element, std::string_view path, const std::string& text) {
  if (Element* child = element.child(path)) child->text = text;
}

// The world with the P3-AT's LRF as its only sensor, and the state at the start.
struct LaserBench {
  LaserBench() {
    auto changed =
        std::make_shared<world::WorldModel>(*world::load_world_text(world_text(), "experiments"));
    for (world::ModelInstance& instance : changed->models) {
      if (instance.name != "p3at") continue;
      auto robot = std::make_shared<world::Model>(*instance.model);
      std::erase_if(robot->sensors,
                    [](const world::SensorDescription& sensor) { return sensor.name != "lrf"; });
      for (world::SensorDescription& sensor : robot->sensors) {
        const std::shared_ptr<Element> element = sensor.element->clone();
        set(*element, "lidar/range/max", "32");
        set(*element, "lidar/range/resolution", "0");
        set(*element, "lidar/noise/stddev", fmt::format("{}", kNoise_m));
        set(*element, "ruedo:bearing_noise", "0");
        sensor.element = element;
      }
      instance.model = robot;
    }
    world = changed;
    layout.emplace(*world);
    physics::PhysicsWorld physics(*world, *layout);
    robot::Robots(*world, *layout, physics).read(start);
    rays = scene::make_ray_scene(scene::make_static_ray_scene(*world, *layout));
    rays->update(start);
  }

  planar_lidar_t scan(uint64_t seed, bool noise) {
    engine::Channels channels;
    Findings findings;
    engine::Fleet fleet = engine::make_fleet(
        *world, *layout, {.seed = seed, .noise = noise, .disabled = {}}, channels, findings);
    Outbox out;
    planar_lidar_t message;
    for (engine::ModuleSetup& module : fleet.modules) {
      if (module.name != "lrf") continue;
      Sensor& sensor = *module.devices.at(0).sensor;
      if (sensor.observes()) sensor.observe(start, out);
      sensor.sample({start, 0, rays.get(), nullptr}, out);
    }
    const Outbox::Entry& entry = out.entries().at(0);
    message.decode(out.data(entry), 0, static_cast<int>(entry.size));
    return message;
  }

  std::shared_ptr<const world::WorldModel> world;
  std::optional<world::BodyLayout> layout;
  Snapshot start;
  std::unique_ptr<scene::RayScene> rays;
};

// Where the LRF is and how far it should see, ray by ray.
struct Expected {
  double x = kRobotX + kLaserAhead * math::cos(kRobotYaw),
         y = kRobotY + kLaserAhead * math::sin(kRobotYaw);
  double range(double angle) const {
    double nearest = kInfinity;
    for (const Obstacle& o : kObstacles) nearest = std::min(nearest, distance_to(o, x, y, angle));
    return nearest;
  }
};

report::Points outline(const Obstacle& o) {
  report::Points points;
  const int corners = o.round ? 48 : 4;
  for (int i = 0; i < corners; ++i) {
    const double t = 2 * M_PI * (i + 0.5) / corners;
    const double lx = o.round ? o.a * math::cos(t) : std::copysign(0.5 * o.a, math::cos(t));
    const double ly = o.round ? o.a * math::sin(t) : std::copysign(0.5 * o.b, math::sin(t));
    points.push_back({o.x + lx * math::cos(o.yaw) - ly * math::sin(o.yaw),
                      o.y + lx * math::sin(o.yaw) + ly * math::cos(o.yaw)});
  }
  return points;
}

// The scene from behind the robot, with the rays drawn in, like the paper's Fig. 7.
void draw_picture(const Experiments& all, const LaserBench& bench,
                  const std::vector<scene::Line>& lines) {
  const std::unique_ptr<scene::Renderer> renderer =
      scene::make_renderer(*bench.world, *bench.layout);
  scene::View view;
  view.X_WCamera = Pose::from_xyz_rpy({-2.9, -2.6, 3.4}, {0, 0.68, 0.62});
  view.width = 960;
  view.height = 640;
  view.fx = view.fy = 760;
  view.cx = 480;
  view.cy = 320;
  scene::Picture picture;
  renderer->draw(bench.start, view, picture, {.lines = lines});
  for (size_t i = 0; i + 2 < picture.rgb.size(); i += 3)
    std::swap(picture.rgb[i], picture.rgb[i + 2]);  // OpenCV's order
  const cv::Mat image(view.height, view.width, CV_8UC3, picture.rgb.data());
  std::vector<uint8_t> png;
  world::encode_picture(".png", image, png);
  all.write("e3_picture.png", std::string(png.begin(), png.end()));
}

}  // namespace

void laser_experiment(Experiments& all) {
  all.progress("E3: laser range finder among obstacles");
  LaserBench bench;
  const planar_lidar_t scan = bench.scan(1, false);
  const Expected expected;
  report::SvgPlot plot("The LRF's 181 rays among obstacles", "x [m]", "y [m]", true);
  std::vector<scene::Line> lines;
  double worst = scan.nranges == 181 ? 0 : kInfinity;
  for (int i = 0; i < scan.nranges; ++i) {
    // The angle of ray i as the world file has it: the message's are floats.
    const double angle = kRobotYaw - M_PI / 2 + M_PI * i / 180.0;
    const double range = expected.range(angle), seen = scan.ranges[i];
    worst = std::max(worst, std::isinf(range) && std::isinf(seen) ? 0.0 : std::abs(range - seen));
    const double x = expected.x + seen * math::cos(angle), y = expected.y + seen * math::sin(angle);
    plot.line({{expected.x, expected.y}, {x, y}}, "#d62728", "", false, 0.7);
    lines.push_back({{expected.x, expected.y, 0.39}, {x, y, 0.39}, {1.0f, 0.1f, 0.1f, 0.35f}});
  }
  for (const Obstacle& o : kObstacles) plot.area(outline(o), "#4a6fa5");
  plot.area(outline({false, kRobotX, kRobotY, kRobotYaw, 0.5, 0.38}), "#333333");
  all.write("e3_rays.svg", plot.svg());
  draw_picture(all, bench, lines);
  all.report({"E3", "LRF among obstacles: worst error of 181 rays", "", worst, "m", "within 1e-6 m",
              worst < 1e-6});
}

void noise_experiment(Experiments& all) {
  constexpr int kSeeds = 1000;
  constexpr double k99 = 2.5758;  // two-sided
  LaserBench bench;
  const planar_lidar_t ideal = bench.scan(1, false);
  double differs = 0, sum = 0, squares = 0, count = 0, one_ray = 0;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    if (seed % 100 == 0)
      all.progress(fmt::format("E5: noise on and off, seed {} of {}", seed, kSeeds));
    if (seed <= 20) {
      const planar_lidar_t off = bench.scan(static_cast<uint64_t>(seed), false);
      differs += std::memcmp(off.ranges.data(), ideal.ranges.data(),
                             ideal.ranges.size() * sizeof(float)) != 0;
    }
    const planar_lidar_t noisy = bench.scan(static_cast<uint64_t>(seed), true);
    for (size_t i = 0; i < ideal.ranges.size(); ++i) {
      if (!std::isfinite(ideal.ranges[i]) || !std::isfinite(noisy.ranges[i])) continue;
      const double error =
          static_cast<double>(noisy.ranges[i]) - static_cast<double>(ideal.ranges[i]);
      sum += error;
      squares += error * error;
      ++count;
      if (i == 90) one_ray += error * error;
    }
  }
  const double sigma = std::sqrt(squares / count), sigma_one = std::sqrt(one_ray / kSeeds);
  // The interval of a sigma from n values: +- k sigma / sqrt(2 n).
  const auto interval = [](double n) { return k99 * kNoise_m / std::sqrt(2 * n); };
  const auto inside = [](double value, double half) { return std::abs(value - kNoise_m) < half; };
  all.report({"E5", "noise off: scans of 20 seeds that differ from the ideal one in any bit", "off",
              differs, "", "none", differs == 0});
  all.report({"E5", "noise on: sigma of one ray, 1000 seeds (10 mm configured)", "on",
              1000 * sigma_one, "mm", fmt::format("99 %: 10 +- {:.2f} mm", 1000 * interval(kSeeds)),
              inside(sigma_one, interval(kSeeds))});
  all.report({"E5", "noise on: sigma of all rays, 1000 seeds", "on", 1000 * sigma, "mm",
              fmt::format("99 %: 10 +- {:.3f} mm", 1000 * interval(count)),
              inside(sigma, interval(count))});
  const double mean_bound = k99 * kNoise_m / std::sqrt(count);
  all.report({"E5", "noise on: mean of all rays, 1000 seeds", "on", 1000 * sum / count, "mm",
              fmt::format("99 %: 0 +- {:.3f} mm", 1000 * mean_bound),
              std::abs(sum / count) < mean_bound});
}

}  // namespace ruedo::bench
