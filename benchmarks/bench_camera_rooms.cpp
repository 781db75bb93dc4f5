// Pictures of the benchmark's walls, 640 x 480, from the first robot's start, 10 degrees further
// each: the same scene and size as benchmarks/peers/*_camera.py draw. With several threads each has
// a renderer of its own. Prints JSON rows.
//
//   bench_camera_rooms WORLD [frames] [threads]        WORLD as ruedo bench --write-world writes it
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <thread>
#include <vector>

#include "scene/pictures/render_scene.h"
#include "world/load.h"

namespace {

using namespace ruedo;

// The walls alone: the peers draw no robots.
world::WorldModel walls_of(const world::WorldModel& all) {
  world::WorldModel world = all;
  std::erase_if(world.models, [](const world::ModelInstance& instance) {
    return instance.model->drive.has_value();
  });
  world::Light sun;
  sun.type = world::Light::Type::directional;
  sun.direction = Vec3(0.3, 0.2, -0.9).normalized();
  world.lights = {sun};
  world.sky.shadows = false;
  return world;
}

void draw(scene::Renderer& renderer, const Snapshot& snapshot, const Vec3& eye, int frame,
          scene::Picture& picture) {
  const Pose at = Pose::from_xyz_rpy(eye, {0.0, 0.0, frame * M_PI / 18.0});
  renderer.draw(snapshot, scene::View::pinhole(at, 640, 480, 1.047), picture);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: %s WORLD [frames] [threads]\n", argv[0]);
    return 2;
  }
  const int frames = argc > 2 ? std::atoi(argv[2]) : 100;
  const int threads = argc > 3 ? std::atoi(argv[3]) : 1;
  const auto all = world::load_world(argv[1]);
  const world::WorldModel world = walls_of(*all);
  const world::BodyLayout layout(world);
  Vec3 eye(0.0, 0.0, 0.4);
  for (const world::ModelInstance& instance : all->models) {
    if (!instance.model->drive) continue;
    eye.head<2>() = instance.X_WM.translation.head<2>();
    break;
  }
  Snapshot snapshot;
  std::vector<std::unique_ptr<scene::Renderer>> renderers;
  std::vector<scene::Picture> pictures(static_cast<size_t>(threads));
  for (int i = 0; i < threads; ++i) {
    renderers.push_back(scene::make_renderer(world, layout));
    draw(*renderers.back(), snapshot, eye, 0,
         pictures[static_cast<size_t>(i)]);  // compiles programs
  }
  const auto began = std::chrono::steady_clock::now();
  const std::clock_t cpu_began = std::clock();  // of all threads
  std::vector<std::thread> pool;
  for (int i = 0; i < threads; ++i)
    pool.emplace_back([&, i] {
      for (int frame = i; frame < frames; frame += threads)
        draw(*renderers[static_cast<size_t>(i)], snapshot, eye, frame,
             pictures[static_cast<size_t>(i)]);
    });
  for (std::thread& thread : pool) thread.join();
  const double wall_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  const double cpu_s = static_cast<double>(std::clock() - cpu_began) / CLOCKS_PER_SEC;
  std::printf(
      "{\"simulator\": \"Ruedo\", \"renderers\": %d, \"frames_per_s\": %.4g, \"frames_per_cpu_s\": "
      "%.4g}\n",
      threads, frames / wall_s, frames / cpu_s);
}
