// Worlds made by hand for the ray tests: one shape a model, static or moving.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "ruedo/random.h"
#include "scene/rays/ray_scene.h"
#include "world/model/body_layout.h"

namespace ruedo::scene {

inline world::Geometry geometry(world::Shape shape, const Vec3& size) {
  world::Geometry g;
  g.shape = shape;
  g.size = size;
  return g;
}

inline world::Geometry plane(const Vec3& normal) {
  world::Geometry g;
  g.shape = world::Shape::plane;
  g.normal = normal;
  return g;
}

inline world::Geometry mesh_geometry(std::shared_ptr<const world::Mesh> mesh,
                                     const Vec3& scale = Vec3::Ones()) {
  world::Geometry g;
  g.shape = world::Shape::mesh;
  g.mesh = std::move(mesh);
  g.scale = scale;
  return g;
}

inline Pose at(const Vec3& position) { return {Quat::Identity(), position}; }

struct World {
  world::WorldModel model;

  // A model of one link with these collisions, each at its pose in the link. Returns the link's
  // index.
  int add(const Pose& X_WM, std::vector<std::pair<Pose, world::Geometry>> shapes,
          bool is_static = true) {
    auto m = std::make_shared<world::Model>();
    m->name = "m" + std::to_string(model.models.size());
    m->is_static = is_static;
    m->links.resize(1);
    m->links[0].name = "link";
    for (auto& [pose, g] : shapes) {
      world::Collision collision;
      collision.X_LC = pose;
      collision.geometry = std::move(g);
      m->links[0].collisions.push_back(std::move(collision));
    }
    model.models.push_back({m->name, X_WM, m});
    return static_cast<int>(model.models.size()) - 1;
  }
  int add(const Pose& X_WM, world::Geometry g, bool is_static = true) {
    return add(X_WM, {{Pose(), std::move(g)}}, is_static);
  }
};

inline Vec3 random_vector(RandomStream& random, double size) {
  return {size * (2 * random.uniform() - 1), size * (2 * random.uniform() - 1),
          size * (2 * random.uniform() - 1)};
}

inline Vec3 random_direction(RandomStream& random) {
  return Vec3(random.gaussian(), random.gaussian(), random.gaussian()).normalized();
}

inline Pose random_pose(RandomStream& random, double size) {
  const Quat q(random.gaussian(), random.gaussian(), random.gaussian(), random.gaussian());
  return {q.normalized(), random_vector(random, size)};
}

// A closed ball of triangles: rings of `n` around z, wound counter-clockwise seen from outside.
inline std::shared_ptr<world::Mesh> ball_mesh(int n, float radius) {
  auto mesh = std::make_shared<world::Mesh>();
  mesh->closed = true;
  const int rings = n / 2;
  mesh->positions.push_back({0, 0, radius});
  for (int i = 1; i < rings; ++i)
    for (int j = 0; j < n; ++j) {
      const double polar = M_PI * i / rings, around = 2 * M_PI * j / n;
      mesh->positions.push_back((radius * Vec3(std::sin(polar) * std::cos(around),
                                               std::sin(polar) * std::sin(around), std::cos(polar)))
                                    .cast<float>());
    }
  mesh->positions.push_back({0, 0, -radius});
  const auto at = [&](int i, int j) {
    return static_cast<uint32_t>(i == 0       ? 0
                                 : i == rings ? 1 + (rings - 1) * n
                                              : 1 + (i - 1) * n + j % n);
  };
  for (int i = 0; i < rings; ++i)
    for (int j = 0; j < n; ++j) {
      if (i > 0) mesh->triangles.push_back({at(i, j), at(i + 1, j), at(i, j + 1)});
      if (i + 1 < rings) mesh->triangles.push_back({at(i, j + 1), at(i + 1, j), at(i + 1, j + 1)});
    }
  return mesh;
}

// The closed cube [-1, 1]^3 of twelve triangles.
inline std::shared_ptr<world::Mesh> cube_mesh() {
  auto mesh = std::make_shared<world::Mesh>();
  mesh->closed = true;
  for (int i = 0; i < 8; ++i)
    mesh->positions.push_back({i & 1 ? 1.f : -1.f, i & 2 ? 1.f : -1.f, i & 4 ? 1.f : -1.f});
  const uint32_t faces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  for (const auto& f : faces) {
    mesh->triangles.push_back({f[0], f[1], f[2]});
    mesh->triangles.push_back({f[0], f[2], f[3]});
  }
  return mesh;
}

inline std::shared_ptr<world::Mesh> opened(const world::Mesh& mesh) {
  auto open = std::make_shared<world::Mesh>(mesh);
  open->closed = false;
  return open;
}

}  // namespace ruedo::scene
