// What a firing of a sonar's transducer costs, by the rays of its cone: the P3-AT's front array, by
// the sensor's own code, in the office and in the arena that come with Ruedo.
//
//   bench_sonar [repeats]      one core; medians of the thread's own time; run it from anywhere
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <memory>
#include <string>
#include <vector>

#include "engine/fleet.h"
#include "ruedo/sensor.h"
#include "scene/rays/ray_scene.h"
#include "world/load.h"
#include "world/model/body_layout.h"

namespace {

using namespace ruedo;

double cpu_time_us() {
  timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e6 * static_cast<double>(now.tv_sec) + 1e-3 * static_cast<double>(now.tv_nsec);
}

// us a firing: the median of some runs of 400 samples, one transducer each.
double measure(const std::string& file, int rays, int repeats) {
  world::LoadOptions options;
  options.settings.push_back(
      {"p3at", "sonar_front", "ruedo:sonar.ruedo:rays", std::to_string(rays)});
  const auto world = world::load_world(file, options);
  const world::BodyLayout layout(*world);
  engine::Channels channels;
  Findings findings;
  engine::Fleet fleet = engine::make_fleet(*world, layout, {}, channels, findings);
  Sensor* sonar = nullptr;
  for (engine::ModuleSetup& module : fleet.modules) {
    if (module.name == "sonar") sonar = module.devices.at(0).sensor.get();
  }
  if (!sonar) return 0.0;
  Snapshot now;
  for (const auto& body : layout.bodies) now.bodies.push_back(body.X_WB);
  now.wheel_angles.resize(layout.wheels.size());
  const auto scene = scene::make_ray_scene(scene::make_static_ray_scene(*world, layout, false));
  scene->update(now);
  Outbox out;
  std::vector<double> times;
  int64_t sample = 0;
  for (int i = 0; i <= repeats; ++i) {
    constexpr int kSamples = 400;
    const double start = cpu_time_us();
    for (int k = 0; k < kSamples; ++k) {
      out.clear();
      sonar->sample({now, sample++, scene.get(), nullptr}, out);
    }
    if (i > 0)
      times.push_back((cpu_time_us() - start) / kSamples);  // the first run warms the caches
  }
  std::nth_element(times.begin(), times.begin() + repeats / 2, times.end());
  return times[static_cast<size_t>(repeats / 2)];
}

}  // namespace

int main(int argc, char** argv) {
  const int repeats = argc > 1 ? std::atoi(argv[1]) : 25;
  const std::string worlds = std::string(RUEDO_SOURCE_DIR) + "/worlds/";
  for (const char* world : {"arena.sdf", "office.sdf"}) {
    for (const int rays : {1, 9, 19, 37}) {
      std::printf("%-10s %3d rays a cone  %6.2f us a firing\n", world, rays,
                  measure(worlds + world, rays, repeats));
    }
  }
  return 0;
}
