// Height maps: rays hit what they hit of the same triangles as a mesh, to the last bit.
#include <gtest/gtest.h>

#include "ray_worlds.h"
#include "world/read/height_maps.h"

namespace ruedo::scene {
namespace {

std::shared_ptr<const world::HeightGrid> hills(size_t columns, size_t rows, RandomStream& random) {
  std::vector<float> x, y, z;
  for (size_t i = 0; i < columns; ++i) x.push_back(0.25f * static_cast<float>(i) - 3.0f);
  for (size_t i = 0; i < rows; ++i) y.push_back(5.0f - 0.25f * static_cast<float>(i));
  for (size_t i = 0; i < columns * rows; ++i)  // steps, so that heights are equal here and there
    z.push_back(0.125f * std::floor(static_cast<float>(8 * random.uniform())));
  return std::make_shared<const world::HeightGrid>(x, y, z);
}

// One place as a height map, and as a mesh.
struct Both {
  World map, mesh;
  std::unique_ptr<world::BodyLayout> layout_of_map, layout_of_mesh;
  std::unique_ptr<RayScene> of_map, of_mesh;

  Both(const std::shared_ptr<const world::HeightGrid>& grid, const Pose& pose, bool is_static) {
    auto heights = std::make_shared<world::HeightMap>();
    heights->parts.push_back(
        {world::kHeightMapPart, 0, static_cast<uint32_t>(grid->triangle_count()), {}});
    heights->grid = grid;
    map.add(pose, mesh_geometry(heights), is_static);
    mesh.add(pose, mesh_geometry(std::make_shared<world::Mesh>(world::triangles_of(*grid))),
             is_static);
    layout_of_map = std::make_unique<world::BodyLayout>(map.model);
    layout_of_mesh = std::make_unique<world::BodyLayout>(mesh.model);
    of_map =
        make_ray_scene(make_static_ray_scene(map.model, *layout_of_map, false, Backend::embree));
    of_mesh = make_ray_scene(
        make_static_ray_scene(mesh.model, *layout_of_mesh, false, Backend::reference));
  }
  void compare(const Ray& ray) const {
    const Hit a = of_map->cast(ray), b = of_mesh->cast(ray);
    EXPECT_EQ(a.range, b.range);
    EXPECT_EQ(a.normal, b.normal);
  }
};

TEST(RayGrid, HitsLikeItsTriangles) {
  RandomStream random = RandomSource(5, "rays", "grid").stream(0);
  const std::pair<size_t, size_t> sizes[] = {{2, 2}, {2, 9}, {6, 5}, {17, 33}, {70, 13}};
  for (const auto& [columns, rows] : sizes) {
    const auto grid = hills(columns, rows, random);
    const Pose poses[] = {Pose(), at({0.1, -0.3, 2.0}), random_pose(random, 3.0)};
    for (const Pose& pose : poses) {
      for (const bool is_static : {true, false}) {
        const Both both(grid, pose, is_static);
        const double width = grid->x(columns - 1) - grid->x(0),
                     depth = grid->y(0) - grid->y(rows - 1);
        const auto above = [&](double height) {
          return pose * Vec3(grid->x(0) + width * (1.2 * random.uniform() - 0.1),
                             grid->y(0) - depth * (1.2 * random.uniform() - 0.1), height);
        };
        for (int i = 0; i < 300; ++i) {
          const Vec3 from = above(3 * random.uniform() - 1), to = above(random.uniform());
          both.compare({from, random_direction(random)});
          both.compare({from, (to - from).normalized()});
          both.compare({from, (to - from).normalized(), 0.5});
          both.compare({pose * Vec3(1e4 * random_direction(random)), random_direction(random)});
        }
      }
    }
  }
}

// Along rows, columns and diagonals, through edges and corners, straight down and level.
TEST(RayGrid, HitsItsEdgesAndCorners) {
  RandomStream random = RandomSource(5, "rays", "grid").stream(1);
  const auto grid = hills(19, 22, random);
  const Both both(grid, Pose(), true);
  for (size_t row = 0; row < grid->rows(); ++row) {
    for (size_t column = 0; column < grid->columns(); ++column) {
      const Vec3 corner = grid->vertex(row, column).cast<double>();
      const Ray down{corner + Vec3(0, 0, 3), Vec3(0, 0, -1)};
      EXPECT_EQ(both.of_map->cast(down).range, 3.0);
      both.compare(down);
      both.compare({corner - Vec3(0, 0, 3), Vec3(0, 0, 1)});
      for (const Vec3& d : {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(-1, 0, 0), Vec3(1, 1, 0),
                            Vec3(-1, -1, 0), Vec3(1, -1, -0.5), Vec3(0, 1, -0.5)})
        both.compare({corner - 2.0 * d.normalized(), d.normalized()});
    }
  }
}

}  // namespace
}  // namespace ruedo::scene
