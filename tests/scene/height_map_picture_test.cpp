// The drawn part of a height map: all of a small one, an even part of a large one.
#include <gtest/gtest.h>

#include "scene/pictures/render_mesh.h"
#include "world/model/height_grid.h"

namespace ruedo::scene {
namespace {

// z = x / 4 - y / 2 over columns x rows with steps of 0.5 m.
world::HeightMap incline(size_t columns, size_t rows) {
  std::vector<float> x, y, z;
  for (size_t i = 0; i < columns; ++i) x.push_back(0.5f * static_cast<float>(i));
  for (size_t i = 0; i < rows; ++i) y.push_back(-0.5f * static_cast<float>(i));
  for (const float at_y : y)
    for (const float at_x : x) z.push_back(0.25f * at_x - 0.5f * at_y);
  world::HeightMap map;
  map.grid = std::make_shared<const world::HeightGrid>(x, y, z);
  map.parts.push_back(
      {world::kHeightMapPart, 0, static_cast<uint32_t>(map.grid->triangle_count()), {}});
  map.tiles = {3, 5};
  return map;
}

TEST(HeightMapPictures, AreBoundedAndCoverTheMap) {
  const std::tuple<size_t, size_t, size_t> sizes[] = {{2, 2, 1},      {1025, 3, 1}, {1026, 3, 2},
                                                      {2049, 100, 2}, {3001, 4, 3}, {2, 4097, 4}};
  for (const auto& [columns, rows, step] : sizes) {
    const world::HeightMap map = incline(columns, rows);
    const RenderMesh mesh = file_mesh(map);
    const auto drawn = [&](size_t heights) { return (heights - 2) / step + 2; };
    EXPECT_EQ(mesh.vertices.size(), drawn(columns) * drawn(rows)) << columns;
    const Eigen::Vector3f up = Eigen::Vector3f(-0.25f, 0.5f, 1).normalized();
    for (const RenderVertex& v : mesh.vertices) {
      EXPECT_NEAR(v.position.z(), 0.25f * v.position.x() - 0.5f * v.position.y(), 1e-3);
      EXPECT_LT((v.normal - up).norm(), 1e-3f);
    }
    EXPECT_EQ(mesh.vertices.front().uv, Eigen::Vector2f(0, 5));
    EXPECT_EQ(mesh.vertices.back().uv, Eigen::Vector2f(3, 0));
    double area = 0;  // seen from above
    size_t indices = 0;
    for (const RenderMesh::Piece& piece : mesh.pieces) {
      EXPECT_EQ(piece.first_index, indices);
      EXPECT_LE(piece.index_count, 3u * 4000u);
      indices += piece.index_count;
    }
    EXPECT_EQ(indices, mesh.indices.size());
    for (size_t i = 0; i < mesh.indices.size(); i += 3) {
      const auto at = [&](size_t k) -> Vec3 {
        return mesh.vertices[mesh.indices[i + k]].position.cast<double>();
      };
      const double twice = (at(1) - at(0)).cross(at(2) - at(0)).z();
      EXPECT_GT(twice, 0.0);
      area += twice / 2;
    }
    EXPECT_NEAR(area, 0.25 * static_cast<double>((columns - 1) * (rows - 1)), 1e-6 * area);
  }
}

}  // namespace
}  // namespace ruedo::scene
