// Small worlds that ask for much: what they cost in all is bounded.
#include <gtest/gtest.h>

#include "temporary_folder.h"
#include "world/load.h"
#include "world/read/triangle_count.h"

namespace ruedo::world {
namespace {

std::string world_around(const std::string& models) {
  return "<sdf version='1.9'><world name='w'>\n" + models + "</world></sdf>";
}

std::string error_of(const std::string& path) {
  try {
    load_world(path);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

// 8193 x 8193 heights, the most that a map has, count as 2.7 million triangles.
TEST(Costs, TrianglesOfAllMeshesAreBounded) {
  const TemporaryFolder folder;
  folder.write("hills.pgm", "P5 8193 8193 255\n" + std::string(8193 * 8193, '\x40'));
  std::string models;
  for (int i = 0; i < 4; ++i) {
    if (i == 3) {
      EXPECT_EQ(error_of(folder.write("three.sdf", world_around(models))), "");
    }
    models += "<model name='m" + std::to_string(i) +
              "'><static>true</static><link name='l'><collision name='c'><geometry><heightmap>"
              "<uri>hills.pgm</uri></heightmap></geometry></collision></link></model>\n";
  }
  EXPECT_EQ(error_of(folder.write("four.sdf", world_around(models))),
            (folder / "four.sdf") +
                ":5: <heightmap>: the meshes have more than 10000000 triangles in all with this "
                "one; each counts once for every scale");
}

Mesh with_triangles(size_t count) {
  Mesh mesh;
  mesh.triangles.resize(count);
  return mesh;
}

TEST(Costs, AMeshCountsOnceForEveryScale) {
  const auto mesh = std::make_shared<const Mesh>(with_triangles(4'000'000));
  const Element shape;
  TriangleCount count;
  for (int i = 0; i < 10; ++i) count.add(mesh, Vec3(1, 1, 1), shape);
  count.add(mesh, Vec3(1, 1, 2), shape);
  EXPECT_THROW(count.add(mesh, Vec3(1, 1, 3), shape), InputError);
}

TEST(Costs, TrianglesOfStaticModelsAreLimited) {
  Model wall;
  wall.is_static = true;
  wall.links.emplace_back();
  wall.links[0].collisions.emplace_back();
  wall.links[0].collisions[0].geometry.mesh =
      std::make_shared<const Mesh>(with_triangles(10'000'000));
  WorldModel world;
  const auto placed = std::make_shared<const Model>(wall);
  for (int i = 0; i < 4; ++i) world.models.push_back({"wall", {}, placed});
  EXPECT_EQ(placed_triangles_fault(world), "");
  EXPECT_EQ(placed_triangles_fault(world, &wall),
            "the collisions of what stands still have more than 40000000 triangles in all");
  world.models[0].removed = true;
  EXPECT_EQ(placed_triangles_fault(world, &wall), "");
  wall.is_static = false;
  world.models.push_back({"thing", {}, std::make_shared<const Model>(wall)});
  EXPECT_EQ(placed_triangles_fault(world, &wall), "") << "what moves shares its triangles";
}

// Only the head of a picture counts: 10 000 x 10 000 pixels.
std::string head_of_a_picture() { return "P5 10000 10000 255\n"; }

TEST(Costs, PixelsOfAllTexturesAreBounded) {
  const TemporaryFolder folder;
  std::string models;
  for (const char* name : {"a", "b", "c", "d", "e", "a", "f", "f"}) {
    const std::string file = std::string(name) + ".pgm";
    folder.write(file, head_of_a_picture());
    models += "<model name='m" + std::to_string(models.size()) +
              "'><static>true</static><link name='l'><visual name='v'><geometry><box/></geometry>"
              "<material><pbr><metal><albedo_map>" +
              file + "</albedo_map></metal></pbr></material></visual></link></model>\n";
  }
  const auto world = load_world(folder.write("world.sdf", world_around(models)));
  std::vector<std::string> left_out;
  for (const Finding& finding : world->findings) {
    if (finding.text.find("textures") != std::string::npos)
      left_out.push_back(finding.source.file + ": " + finding.text);
  }
  EXPECT_EQ(left_out,
            std::vector<std::string>{
                (folder / "f.pgm") +
                ": the textures have more than 500000000 pixels in all with this one; the plain "
                "colour is shown instead"});
  const auto texture_of = [&](size_t model) {
    return world->models[model].model->links[0].visuals[0].material->texture;
  };
  EXPECT_TRUE(texture_of(4));
  EXPECT_EQ(texture_of(0), texture_of(5));
  EXPECT_FALSE(world->models[6].model->links[0].visuals[0].material && texture_of(6));
}

}  // namespace
}  // namespace ruedo::world
