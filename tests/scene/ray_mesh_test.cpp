// Triangle meshes: no leaks at edges and corners, the right inside, and the same as the exact
// shape.
#include <gtest/gtest.h>

#include "ray_worlds.h"

namespace ruedo::scene {
namespace {

// The mesh alone, static (one flat tree) or moving (a tree of its own).
struct Alone {
  World world;
  std::unique_ptr<world::BodyLayout> layout;
  std::unique_ptr<RayScene> scene;

  Alone(std::shared_ptr<const world::Mesh> mesh, const Pose& pose, bool is_static,
        Backend backend = Backend::embree) {
    world.add(pose, mesh_geometry(std::move(mesh)), is_static);
    layout = std::make_unique<world::BodyLayout>(world.model);
    scene = make_ray_scene(make_static_ray_scene(world.model, *layout, false, backend));
  }
};

// From outside through every corner, edge and face of a closed mesh, aimed as exactly as doubles
// allow; the ray must hit the near surface and not the far one.
TEST(RayMesh, ClosedMeshNeverLeaks) {
  const auto mesh = ball_mesh(24, 1.0f);
  const Pose pose = Pose::from_xyz_rpy({0.3, -0.2, 0.1}, {0.1, 0.2, 0.3});
  RandomStream random = RandomSource(5, "rays", "leaks").stream(0);
  for (const bool is_static : {true, false}) {
    const Alone alone(mesh, pose, is_static);
    for (const auto& triangle : mesh->triangles) {
      const Vec3 a = mesh->positions[triangle[0]].cast<double>(),
                 b = mesh->positions[triangle[1]].cast<double>(),
                 c = mesh->positions[triangle[2]].cast<double>();
      for (const Vec3& target :
           {a, Vec3(0.5 * (a + b)), Vec3(0.25 * b + 0.75 * c), Vec3((a + b + c) / 3)}) {
        const Vec3 on_surface = pose * target;
        const Vec3 origin = pose * Vec3(target * 3.0 + 0.5 * random_vector(random, 1.0));
        const Hit hit = alone.scene->cast({origin, (on_surface - origin).normalized()});
        ASSERT_NEAR(hit.range, (on_surface - origin).norm(), 1e-9);
        ASSERT_TRUE(hit.hit());
      }
    }
  }
}

TEST(RayMesh, AxisAlignedRaysThroughAxisAlignedEdges) {
  const Alone alone(cube_mesh(), {}, true);
  for (int axis = 0; axis < 3; ++axis)
    for (const double u : {-1.0, -0.5, 0.0, 0.5, 1.0})
      for (const double v :
           {-1.0, -0.5, 0.0, 0.5, 1.0}) {  // u = v and u = -v: the diagonals of the faces
        Vec3 origin = Vec3::Zero(), direction = Vec3::Zero();
        origin[axis] = -4.0;
        origin[(axis + 1) % 3] = u;
        origin[(axis + 2) % 3] = v;
        direction[axis] = 1.0;
        EXPECT_EQ(alone.scene->cast({origin, direction}).range, 3.0)
            << axis << " " << u << " " << v;
      }
}

// Where closed meshes overlap each counts once, and a point in a hole is not inside.
TEST(RayMesh, InsideByWinding) {
  auto two = cube_mesh();  // [-1, 1]^3 and the same moved by 1 along x: they overlap in [0, 1]
  const auto cube = cube_mesh();
  for (const auto& p : cube->positions) two->positions.push_back(p + Eigen::Vector3f(1, 0, 0));
  for (const auto& t : cube->triangles) two->triangles.push_back({t[0] + 8, t[1] + 8, t[2] + 8});
  auto hollow = cube_mesh();  // [-1, 1]^3 without [-0.5, 0.5]^3
  for (const auto& p : cube->positions) hollow->positions.push_back(0.5f * p);
  for (const auto& t : cube->triangles) hollow->triangles.push_back({t[0] + 8, t[2] + 8, t[1] + 8});
  for (const bool is_static : {true, false})
    for (const Backend backend : {Backend::embree, Backend::reference}) {
      const Alone alone(two, {}, is_static, backend);
      const auto range = [&](double x) {
        return alone.scene->cast({{x, 0.1, 0.2}, {1, 0, 0}}).range;
      };
      EXPECT_EQ(range(-2.0), 1.0);
      for (const double x : {-0.5, 0.0, 0.5, 1.0, 1.5}) EXPECT_EQ(range(x), 0.0) << x;
      EXPECT_EQ(range(2.5), std::numeric_limits<double>::infinity());

      const Alone shell(hollow, {}, is_static, backend);
      const auto in_shell = [&](double x) {
        return shell.scene->cast({{x, 0.1, 0.2}, {1, 0, 0}}).range;
      };
      EXPECT_EQ(in_shell(-2.0), 1.0);
      EXPECT_EQ(in_shell(-0.75), 0.0);
      EXPECT_EQ(in_shell(0.0), 0.5);
      EXPECT_EQ(in_shell(0.75), 0.0);
    }
}

// The middle of a symmetric mesh: the way out passes near corners and edges; the count must hold
// for every place.
TEST(RayMesh, InsideEverywhere) {
  const auto mesh = ball_mesh(16, 1.0f);
  RandomStream random = RandomSource(5, "rays", "inside").stream(0);
  for (const bool is_static : {true, false}) {
    const Alone alone(mesh, {}, is_static);
    for (int i = 0; i < 500; ++i) {
      const Vec3 p = i == 0 ? Vec3::Zero() : Vec3(random_direction(random) * (i % 2 ? 0.9 : 1.1));
      EXPECT_EQ(alone.scene->cast({p, random_direction(random)}).range == 0.0, p.norm() < 1.0)
          << p.transpose();
    }
  }
}

TEST(RayMesh, BoxOfTrianglesIsABox) {
  RandomStream random = RandomSource(5, "rays", "box").stream(0);
  const Pose pose = random_pose(random, 2.0);
  World boxes;
  boxes.add(pose, geometry(world::Shape::box, {2, 2, 2}));
  const world::BodyLayout layout(boxes.model);
  const auto exact = make_ray_scene(make_static_ray_scene(boxes.model, layout));
  for (const bool is_static : {true, false}) {
    const Alone alone(cube_mesh(), pose, is_static);
    for (int i = 0; i < 2000; ++i) {
      const Vec3 origin = random_vector(random, 30.0);
      const Ray ray{origin, (pose * random_vector(random, 1.3) - origin).normalized()};
      const Hit a = exact->cast(ray), b = alone.scene->cast(ray);
      ASSERT_EQ(a.hit(), b.hit()) << i;
      if (!a.hit()) continue;
      ASSERT_NEAR(
          a.range, b.range,
          1e-12 * std::max(1.0, a.range) / std::max(1e-3, std::abs(a.normal.dot(ray.direction))))
          << i;
      if (a.range > 0.0) {
        ASSERT_NEAR((a.normal - b.normal).norm(), 0.0, 1e-9);
      }
    }
  }
}

TEST(RayMesh, IgnoresDegenerateTriangles) {
  auto mesh = opened(*cube_mesh());
  mesh->positions.push_back({3, 0, 0});
  mesh->triangles.push_back({8, 8, 8});
  mesh->triangles.push_back({0, 1, 1});
  const Alone alone(mesh, {}, true);
  EXPECT_EQ(alone.scene->cast({{-4, 0, 0}, {1, 0, 0}}).range, 3.0);
  EXPECT_FALSE(alone.scene->cast({{3, 0, -4}, {0, 0, 1}}).hit());
  EXPECT_EQ(alone.scene->cast({{-4, -1, -1}, {1, 0, 0}}).range,
            3.0);  // along the triangle that is a line
}

TEST(RayMesh, AnEmptyMeshIsNeverHit) {
  const Alone alone(std::make_shared<world::Mesh>(), {}, true);
  EXPECT_FALSE(alone.scene->cast({{-4, 0, 0}, {1, 0, 0}}).hit());
}

}  // namespace
}  // namespace ruedo::scene
