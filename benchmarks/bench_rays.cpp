// Rays a second of Ruedo's caster, of bare Embree (native triangles, single precision) and of
// Bullet's rayTest (double), in one program, scene and run: an office of boxes, and the same as
// triangle meshes.
//
//   bench_rays [repeats]      one core; medians; 181-ray scans of 180 degrees, 30 m
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <btBulletCollisionCommon.h>

#include "bench/bare_embree.h"
#include "ruedo/random.h"
#include "scene/rays/ray_scene.h"

namespace {

using namespace ruedo;

struct BoxAt {
  Vec3 center, half;
};

// Rooms of 5 x 5 m with doors in thin walls, and furniture; 40 x 30 m.
std::vector<BoxAt> office() {
  std::vector<BoxAt> boxes;
  const auto wall = [&](double x0, double y0, double x1, double y1) {
    boxes.push_back(
        {{(x0 + x1) / 2, (y0 + y1) / 2, 1.25}, {(x1 - x0) / 2 + 0.05, (y1 - y0) / 2 + 0.05, 1.25}});
  };
  for (int i = 0; i < 8; ++i)
    for (int j = 0; j <= 6; ++j) {
      const double x = 5.0 * i, y = 5.0 * j;
      if (j == 0 || j == 6) {
        wall(x, y, x + 5, y);
      } else {
        wall(x, y, x + 2, y);
        wall(x + 3, y, x + 5, y);
      }
    }
  for (int i = 0; i <= 8; ++i)
    for (int j = 0; j < 6; ++j) {
      const double x = 5.0 * i, y = 5.0 * j;
      if (i == 0 || i == 8) {
        wall(x, y, x, y + 5);
      } else {
        wall(x, y, x, y + 2);
        if (i != 4) wall(x, y + 3, x, y + 5);
      }
    }
  RandomStream random = RandomSource(1, "office", "furniture").stream(0);
  for (int i = 0; i < 90; ++i) {
    const Vec3 half(0.1 + 0.4 * random.uniform(), 0.1 + 0.4 * random.uniform(),
                    0.2 + 0.6 * random.uniform());
    boxes.push_back({{1 + 38 * random.uniform(), 1 + 28 * random.uniform(), half.z()}, half});
  }
  boxes.push_back({{20, 15, -0.05}, {30, 30, 0.05}});
  return boxes;
}

// All boxes as one mesh, every face cut into cells x cells squares.
std::shared_ptr<world::Mesh> as_mesh(const std::vector<BoxAt>& boxes, int cells) {
  auto mesh = std::make_shared<world::Mesh>();
  mesh->name = "office";
  for (const BoxAt& box : boxes)
    for (int axis = 0; axis < 3; ++axis)
      for (int side = -1; side <= 1; side += 2) {
        const auto first = static_cast<uint32_t>(mesh->positions.size());
        for (int i = 0; i <= cells; ++i)
          for (int j = 0; j <= cells; ++j) {
            Vec3 p;
            p[axis] = side;
            p[(axis + 1) % 3] = side * (2.0 * i / cells - 1.0);
            p[(axis + 2) % 3] = 2.0 * j / cells - 1.0;
            mesh->positions.push_back((box.center + p.cwiseProduct(box.half)).cast<float>());
          }
        for (int i = 0; i < cells; ++i)
          for (int j = 0; j < cells; ++j) {
            const uint32_t a = first + static_cast<uint32_t>(i * (cells + 1) + j),
                           b = a + static_cast<uint32_t>(cells) + 1;
            mesh->triangles.push_back({a, b, b + 1});
            mesh->triangles.push_back({a, b + 1, a + 1});
          }
      }
  return mesh;
}

world::WorldModel world_of(const std::vector<BoxAt>& boxes,
                           const std::shared_ptr<world::Mesh>& mesh) {
  auto model = std::make_shared<world::Model>();
  model->name = "office";
  model->is_static = true;
  model->links.resize(1);
  const auto add = [&](const Vec3& at, world::Geometry geometry) {
    world::Collision collision;
    collision.X_LC.translation = at;
    collision.geometry = std::move(geometry);
    model->links[0].collisions.push_back(collision);
  };
  if (mesh) {
    world::Geometry geometry;
    geometry.shape = world::Shape::mesh;
    geometry.mesh = mesh;
    add(Vec3::Zero(), geometry);
  } else {
    for (const BoxAt& box : boxes) {
      world::Geometry geometry;
      geometry.size = 2.0 * box.half;
      add(box.center, geometry);
    }
  }
  world::WorldModel world;
  world.models.push_back({"office", {}, model});
  return world;
}

// Scans from places that are not inside a box.
std::vector<scene::Ray> scans(const std::vector<BoxAt>& boxes, int count) {
  std::vector<scene::Ray> rays;
  RandomStream random = RandomSource(1, "office", "scans").stream(0);
  while (static_cast<int>(rays.size()) < count * 181) {
    const Vec3 at(0.2 + 39.6 * random.uniform(), 0.2 + 29.6 * random.uniform(), 0.3);
    const double heading = 2.0 * M_PI * random.uniform();
    bool free = true;
    for (const BoxAt& box : boxes)
      free = free && ((at - box.center).cwiseAbs() - box.half).maxCoeff() > 0.0;
    if (!free) continue;
    for (int i = 0; i < 181; ++i) {
      const double angle = heading + (i - 90) * M_PI / 180.0;
      rays.push_back({at, Vec3(std::cos(angle), std::sin(angle), 0.0), 30.0});
    }
  }
  return rays;
}

// The CPU time of this thread alone, so that other programs disturb less.
double cpu_time_us() {
  timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e6 * static_cast<double>(now.tv_sec) + 1e-3 * static_cast<double>(now.tv_nsec);
}

// Million rays a second: the median of some runs.
double measure(size_t rays, int repeats, const std::function<void()>& run) {
  std::vector<double> rates;
  for (int i = 0; i < repeats; ++i) {
    const double start = cpu_time_us();
    run();
    rates.push_back(static_cast<double>(rays) / (cpu_time_us() - start));
  }
  std::nth_element(rates.begin(), rates.begin() + repeats / 2, rates.end());
  return rates[static_cast<size_t>(repeats / 2)];
}

// Bullet's world of the same boxes or triangles.
struct BulletOffice {
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btCollisionWorld world{&dispatcher, &broadphase, &configuration};
  std::vector<std::unique_ptr<btCollisionShape>> shapes;
  std::vector<std::unique_ptr<btCollisionObject>> objects;
  btTriangleMesh triangles;

  BulletOffice(const std::vector<BoxAt>& boxes, const world::Mesh* mesh) {
    const auto add = [&](std::unique_ptr<btCollisionShape> shape, const btVector3& at) {
      auto object = std::make_unique<btCollisionObject>();
      object->setCollisionShape(shape.get());
      object->getWorldTransform().setIdentity();
      object->getWorldTransform().setOrigin(at);
      world.addCollisionObject(object.get());
      shapes.push_back(std::move(shape));
      objects.push_back(std::move(object));
    };
    const auto vector = [](const auto& v) { return btVector3(v.x(), v.y(), v.z()); };
    if (mesh) {
      for (const auto& t : mesh->triangles)
        triangles.addTriangle(vector(mesh->positions[t[0]]), vector(mesh->positions[t[1]]),
                              vector(mesh->positions[t[2]]));
      add(std::make_unique<btBvhTriangleMeshShape>(&triangles, false), btVector3(0, 0, 0));
    } else {
      for (const BoxAt& box : boxes)
        add(std::make_unique<btBoxShape>(vector(box.half)), vector(box.center));
    }
    world.updateAabbs();
  }
  ~BulletOffice() {
    for (auto& object : objects) world.removeCollisionObject(object.get());
  }
  double cast(const scene::Ray& ray) const {
    const Vec3 end = ray.origin + ray.max_range * ray.direction;
    const btVector3 from(ray.origin.x(), ray.origin.y(), ray.origin.z()),
        to(end.x(), end.y(), end.z());
    btCollisionWorld::ClosestRayResultCallback result(from, to);
    world.rayTest(from, to, result);
    return result.m_closestHitFraction * ray.max_range;
  }
};

void compare(const std::string& name, const std::vector<BoxAt>& boxes,
             const std::shared_ptr<world::Mesh>& mesh, int repeats) {
  const std::vector<scene::Ray> rays = scans(boxes, 200);
  const world::WorldModel world = world_of(boxes, mesh);
  const world::BodyLayout layout(world);
  const auto ours = scene::make_ray_scene(scene::make_static_ray_scene(world, layout));
  const BulletOffice bullet(boxes, mesh.get());
  const bench::BareEmbree bare(mesh ? *mesh : *as_mesh(boxes, 1));
  std::vector<scene::Hit> hits(rays.size());
  std::vector<double> ranges(rays.size());

  const double scan = measure(rays.size(), repeats, [&] {
    for (size_t i = 0; i < rays.size(); i += 181)
      ours->cast(std::span(&rays[i], 181), std::span(&hits[i], 181));
  });
  const double single = measure(rays.size(), repeats, [&] {
    for (size_t i = 0; i < rays.size(); ++i)
      ours->cast(std::span(&rays[i], 1), std::span(&hits[i], 1));
  });
  const double bare_packets = measure(rays.size(), repeats, [&] { bare.cast(rays, ranges, true); });
  const double bare_single = measure(rays.size(), repeats, [&] { bare.cast(rays, ranges, false); });
  double embree_error = 0.0, bullet_error = 0.0;
  for (size_t i = 0; i < rays.size(); ++i)
    embree_error = std::max(embree_error, std::abs(ranges[i] - std::min(hits[i].range, 30.0)));
  const double theirs = measure(rays.size(), std::min(repeats, 3), [&] {
    for (size_t i = 0; i < rays.size(); ++i) ranges[i] = bullet.cast(rays[i]);
  });
  for (size_t i = 0; i < rays.size(); ++i)
    bullet_error = std::max(bullet_error, std::abs(ranges[i] - std::min(hits[i].range, 30.0)));
  std::printf("%-24s %8.2f %8.2f %8.2f %8.2f %8.2f %9.1f %9.2f   %.1e %.1e\n", name.c_str(), scan,
              single, bare_packets, bare_single, theirs, scan / theirs, bare_packets / scan,
              embree_error, bullet_error);
}

// Robots of seven shapes among the walls: the cost of updating them, and scans from the first 100
// of them.
void fleet(int robots, const std::vector<BoxAt>& boxes, int repeats) {
  world::WorldModel world = world_of(boxes, nullptr);
  auto robot = std::make_shared<world::Model>();
  robot->links.resize(1);
  const auto add = [&](const Vec3& at, const Vec3& rpy, world::Shape shape, const Vec3& size) {
    world::Collision collision;
    collision.X_LC = Pose::from_xyz_rpy(at, rpy);
    collision.geometry.shape = shape;
    collision.geometry.size = size;
    robot->links[0].collisions.push_back(collision);
  };
  add({0, 0, 0.18}, Vec3::Zero(), world::Shape::box, {0.5, 0.28, 0.19});
  add({0, 0, 0.275}, Vec3::Zero(), world::Shape::box, {0.5, 0.38, 0.01});
  add({0.16, 0, 0.36}, Vec3::Zero(), world::Shape::box, {0.15, 0.15, 0.18});
  for (const double x : {0.135, -0.134})
    for (const double y : {0.197, -0.197})
      add({x, y, 0.111}, {M_PI / 2, 0, 0}, world::Shape::cylinder, {0.111, 0.075, 0});
  RandomStream random = RandomSource(1, "office", "fleet").stream(0);
  const double size = 2.0 * std::sqrt(static_cast<double>(robots));
  for (int i = 0; i < robots; ++i) {
    const Vec3 at(size * random.uniform(), size * random.uniform(), 0);
    world.models.push_back({"robot" + std::to_string(i),
                            Pose::from_xyz_rpy(at, {0, 0, 6.28 * random.uniform()}), robot});
  }
  const world::BodyLayout layout(world);
  const auto scene = scene::make_ray_scene(scene::make_static_ray_scene(world, layout));
  Snapshot snapshot;
  for (const auto& body : layout.bodies) snapshot.bodies.push_back(body.X_WB);
  snapshot.wheel_angles.resize(layout.wheels.size());
  const double updates = 1.0 / measure(1, 20 * repeats + 1, [&] {
                           for (Pose& pose : snapshot.bodies) pose.translation.x() += 1e-3;
                           scene->update(snapshot);
                         });
  std::vector<scene::Ray> rays;
  const int scanners = std::min(robots, 100);
  for (int r = 0; r < scanners; ++r)
    for (int i = 0; i < 181; ++i) {
      const double angle = (i - 90) * M_PI / 180.0;
      const Pose& X_WB = snapshot.bodies[static_cast<size_t>(r)];
      rays.push_back({X_WB * Vec3(0.16, 0, 0.5),
                      X_WB.rotation * Vec3(std::cos(angle), std::sin(angle), 0.0), 8.0});
    }
  std::vector<scene::Hit> hits(rays.size());
  const double scans = measure(rays.size(), repeats, [&] {
    for (size_t i = 0; i < rays.size(); i += 181)
      scene->cast(std::span(&rays[i], 181), std::span(&hits[i], 181));
  });
  std::printf("%6d robots: update %8.1f us, scans %6.2f million rays a second\n", robots, updates,
              scans);
}

}  // namespace

int main(int argc, char** argv) {
  const int repeats = argc > 1 ? std::max(1, std::atoi(argv[1])) : 7;
  std::printf(
      "Million rays a second, one core                                              ratio to       "
      "  largest difference\n");
  std::printf("%-24s %8s %8s %8s %8s %8s %9s %9s   %s\n", "office", "scans", "single", "Embree 8",
              "Embree 1", "Bullet", "Bullet", "Embree 8", "Embree  Bullet");
  const std::vector<BoxAt> boxes = office();
  const auto mesh = as_mesh(boxes, 2), fine = as_mesh(boxes, 12);
  compare(std::to_string(boxes.size()) + " boxes", boxes, nullptr, repeats);
  compare("mesh, " + std::to_string(mesh->triangles.size()), boxes, mesh, repeats);
  compare("mesh, " + std::to_string(fine->triangles.size()), boxes, fine, repeats);
  for (const int robots : {1, 100, 1000, 10000}) fleet(robots, boxes, repeats);
}
