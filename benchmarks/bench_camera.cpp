// Time of a camera picture: drawing, read-back, and what the camera does with it. CPU time is that
// of all threads, Mesa's included; frames per second follow from the wall time.
//
// Scenes: worlds/arena.sdf from the robot's camera, and a room with spheres of 20 000 and of 500
// 000 triangles.
#include <cmath>

#include <benchmark/benchmark.h>

#include "scene/pictures/render_scene.h"
#include "sensors/pixel_noise.h"
#include "world/load.h"
#include "world/mesh/codecs.h"

namespace {

using namespace ruedo;

// A sphere as a mesh file would have it, of 2 n^2 triangles.
std::shared_ptr<const world::Mesh> sphere(int n) {
  auto mesh = std::make_shared<world::Mesh>();
  for (int i = 0; i <= n; ++i) {
    for (int k = 0; k <= n; ++k) {
      const double polar = M_PI * i / n, around = 2.0 * M_PI * k / n;
      const Eigen::Vector3f p(static_cast<float>(std::sin(polar) * std::cos(around)),
                              static_cast<float>(std::sin(polar) * std::sin(around)),
                              static_cast<float>(std::cos(polar)));
      mesh->positions.push_back(p);
      mesh->normals.push_back(p);
    }
  }
  const auto at = [n](int i, int k) { return static_cast<uint32_t>(i * (n + 1) + k); };
  for (int i = 0; i < n; ++i) {
    for (int k = 0; k < n; ++k) {
      mesh->triangles.push_back({at(i, k), at(i + 1, k), at(i + 1, k + 1)});
      mesh->triangles.push_back({at(i, k), at(i + 1, k + 1), at(i, k + 1)});
    }
  }
  return mesh;
}

std::shared_ptr<const world::WorldModel> room(int triangles) {
  constexpr int kSpheres = 20;
  auto world = std::make_shared<world::WorldModel>();
  auto model = std::make_shared<world::Model>();
  model->is_static = true;
  world::Link& link = model->links.emplace_back();
  const auto add = [&](const Vec3& at, const world::Geometry& geometry, const world::Rgba& colour) {
    world::Visual& visual = link.visuals.emplace_back();
    visual.X_LV.translation = at;
    visual.geometry = geometry;
    visual.material = world::Material{};
    visual.material->diffuse = colour;
  };
  for (int i = 0; i < 6; ++i) {
    world::Geometry wall;
    wall.size = Vec3::Constant(10.0);
    wall.size[i / 2] = 0.2;
    add(Vec3(0, 0, 5) + (i % 2 == 0 ? 5.0 : -5.0) * Vec3::Unit(i / 2), wall,
        {0.7f, 0.65f, 0.6f, 1});
  }
  world::Geometry ball;
  ball.shape = world::Shape::mesh;
  ball.mesh = sphere(static_cast<int>(std::sqrt(triangles / (2.0 * kSpheres))));
  ball.scale = Vec3::Constant(0.4);
  for (int i = 0; i < kSpheres; ++i)
    add({(i % 5) - 1.0, (i / 5) * 1.5 - 2.2, 1.2 + 0.1 * i}, ball, {0.3f, 0.5f, 0.7f, 1});
  world->models.push_back({"room", {}, model});
  world::Light sun;
  sun.type = world::Light::Type::directional;
  sun.direction = Vec3(0.3, 0.2, -0.9).normalized();
  sun.diffuse = {0.8f, 0.8f, 0.8f, 1};
  sun.cast_shadows = true;
  world->lights.push_back(sun);
  return world;
}

void draw(benchmark::State& state, const world::WorldModel& world, const Pose& X_WCamera,
          bool depth, int samples) {
  const world::BodyLayout layout(world);
  const auto renderer = scene::make_renderer(world, layout);
  Snapshot snapshot;
  for (const world::BodyPlacement& body : layout.bodies) snapshot.bodies.push_back(body.X_WB);
  snapshot.wheel_angles.resize(layout.wheels.size());
  scene::View view = scene::View::pinhole(X_WCamera, 640, 480, 1.047);
  view.samples = samples;
  scene::Picture picture;
  picture.want_depth = depth;
  renderer->draw(snapshot, view, picture);  // compiles programs and decodes textures
  for (auto _ : state) renderer->draw(snapshot, view, picture);
  state.SetItemsProcessed(state.iterations());
  state.SetLabel(renderer->description());
}

void BM_Arena(benchmark::State& state) {
  static const auto world = world::load_world(RUEDO_SOURCE_DIR "/worlds/arena.sdf");
  draw(state, *world, Pose::from_xyz_rpy({0.2, 0, 0.4}, Vec3::Zero()), state.range(0) != 0,
       static_cast<int>(state.range(1)));
}
void BM_Room(benchmark::State& state) {
  auto world = std::make_shared<world::WorldModel>(*room(static_cast<int>(state.range(0))));
  world->sky.shadows = state.range(1) != 0;
  draw(state, *world, Pose::from_xyz_rpy({-4.5, 0, 2.5}, Vec3::Zero()), state.range(2) != 0, 1);
}
void BM_Noise(benchmark::State& state) {
  const PixelNoise noise(0.0, 0.02);
  std::vector<uint8_t> pixels(640 * 480 * 3, 128);
  uint64_t sample = 0;
  for (auto _ : state) noise.apply(RandomStream(1, sample++), pixels);
  benchmark::DoNotOptimize(pixels.data());
}
void BM_Jpeg(benchmark::State& state) {
  const auto world = room(20000);
  const world::BodyLayout layout(*world);
  scene::Picture picture;
  scene::make_renderer(*world, layout)
      ->draw(
          {},
          scene::View::pinhole(Pose::from_xyz_rpy({-4.5, 0, 2.5}, Vec3::Zero()), 640, 480, 1.047),
          picture);
  const cv::Mat pixels(480, 640, CV_8UC3, picture.rgb.data());
  std::vector<uint8_t> bytes;
  for (auto _ : state)
    ruedo::world::encode_picture(".jpg", pixels, bytes, {cv::IMWRITE_JPEG_QUALITY, 85});
  state.SetLabel(std::to_string(bytes.size()) + " bytes");
}

BENCHMARK(BM_Arena)
    ->ArgNames({"depth", "samples"})
    ->Args({0, 1})
    ->Args({1, 1})
    ->Args({0, 4})
    ->MeasureProcessCPUTime()
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK(BM_Room)
    ->ArgNames({"triangles", "shadows", "depth"})
    ->Args({20000, 0, 1})
    ->Args({20000, 1, 1})
    ->Args({500000, 0, 1})
    ->Args({500000, 1, 1})
    ->Args({20000, 0, 0})
    ->MeasureProcessCPUTime()
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK(BM_Noise)->Unit(benchmark::kMillisecond);
BENCHMARK(BM_Jpeg)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
