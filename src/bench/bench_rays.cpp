// Rays alone: scans in the benchmark's rooms by Ruedo's caster and by bare Embree, in turn, on one
// core.
#include <algorithm>
#include <cmath>
#include <ctime>
#include <functional>

#include <fmt/format.h>

#include "bench/bare_embree.h"
#include "bench/bench_rows.h"
#include "bench/bench_world.h"
#include "ruedo/math.h"
#include "ruedo/random.h"
#include "world/load.h"

namespace ruedo::bench {
namespace {

constexpr int kRays = 181, kMiddleRay = 90;  // of a scan of 180 degrees
constexpr double kMaxRange_m = 8.0, kHeight_m = 0.3;
constexpr int kFewestScans = 200, kRounds = 15;

// The walls as triangles: every box of the world's collisions.
world::Mesh triangles_of(const world::WorldModel& world, const world::BodyLayout& layout) {
  world::Mesh mesh;
  for (const world::LinkPlacement& placement : layout.links) {
    const world::ModelInstance& instance = world.models[placement.instance];
    for (const world::Collision& collision : instance.model->links[placement.link].collisions) {
      if (collision.geometry.shape != world::Shape::box) continue;
      const auto first = static_cast<uint32_t>(mesh.positions.size());
      for (int corner = 0; corner < 8; ++corner) {
        const Vec3 sign((corner & 1) != 0 ? 0.5 : -0.5, (corner & 2) != 0 ? 0.5 : -0.5,
                        (corner & 4) != 0 ? 0.5 : -0.5);
        mesh.positions.push_back(
            (placement.X_BL * (collision.X_LC * collision.geometry.size.cwiseProduct(sign)))
                .cast<float>());
      }
      for (const uint32_t bit :
           {1U, 2U, 4U}) {  // the axis of a pair of faces; the other two span them
        const uint32_t u = bit == 1U ? 2U : 1U, v = 7U - bit - u;
        for (const uint32_t side : {0U, bit}) {
          const uint32_t a = first + side;
          mesh.triangles.push_back({a, a + u, a + u + v});
          mesh.triangles.push_back({a, a + u + v, a + v});
        }
      }
    }
  }
  return mesh;
}

// Scans from where robots circle, in every room in turn.
std::vector<scene::Ray> scans(int robots) {
  const int side = rooms_on_a_side(robots), rooms = std::max(1, robots);
  RandomStream random = RandomSource(1, "bench", "rays").stream(0);
  std::vector<scene::Ray> rays;
  for (int scan = 0; scan < std::max(kFewestScans, robots); ++scan) {
    const int room = scan % rooms;
    const double place = 2.0 * M_PI * random.uniform(), heading = 2.0 * M_PI * random.uniform();
    const int column = room % side, row = room / side;
    const Vec3 at((column + 0.5) * kRoomSize_m + math::cos(place),
                  (row + 0.5) * kRoomSize_m + math::sin(place), kHeight_m);
    for (int i = 0; i < kRays; ++i) {
      const double angle = heading + (i - kMiddleRay) * M_PI / 180.0;
      rays.push_back({at, Vec3(math::cos(angle), math::sin(angle), 0.0), kMaxRange_m});
    }
  }
  return rays;
}

// Of this thread alone, so that other programs disturb less.
double cpu_time_s() {
  timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2),
                   values.end());
  return values[values.size() / 2];
}

}  // namespace

std::vector<std::string> measure_rays(const BenchTask& task) {
  world::WorldModel rooms = *world::load_world_text(bench_world(task.robots), "rooms.sdf", {});
  std::erase_if(rooms.models,
                [](const world::ModelInstance& instance) { return !instance.model->is_static; });
  const world::BodyLayout layout(rooms);
  const auto ours = scene::make_ray_scene(scene::make_static_ray_scene(rooms, layout));
  const BareEmbree bare(triangles_of(rooms, layout));
  const std::vector<scene::Ray> rays = scans(task.robots);
  std::vector<scene::Hit> hits(rays.size());
  std::vector<double> ranges(rays.size()), our_s, bare_s;
  for (int round = 0; round < kRounds; ++round) {
    const double begin = cpu_time_s();
    for (size_t i = 0; i < rays.size(); i += kRays)
      ours->cast(std::span(&rays[i], kRays), std::span(&hits[i], kRays));
    const double middle = cpu_time_s();
    bare.cast(rays, ranges, true);
    our_s.push_back(middle - begin);
    bare_s.push_back(cpu_time_s() - middle);
  }
  double largest = 0.0;
  for (size_t i = 0; i < rays.size(); ++i)
    largest = std::max(largest, std::abs(ranges[i] - std::min(hits[i].range, kMaxRange_m)));
  const auto count = static_cast<double>(rays.size());
  return {
      fmt::format("{{\"table\": \"rays\", \"robots\": {}, \"rays\": {}, \"rays_per_s\": {:.6g}, "
                  "\"embree_rays_per_s\": {:.6g}, "
                  "\"ratio_to_embree\": {:.4g}, \"largest_difference_m\": {:.3g}}}",
                  task.robots, rays.size(), count / median(our_s), count / median(bare_s),
                  median(our_s) / median(bare_s), largest)};
}

}  // namespace ruedo::bench
