// The look of a world and the places of things in it: lights, materials, terrain, saved states,
// actors.
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "temporary_folder.h"
#include "text_world.h"
#include "world/model/height_grid.h"

namespace ruedo::world {
namespace {

TEST(Scene, LightsMaterialsAndSurfaces) {
  const auto world = world_of(
      "<gravity>0 0 -1.6</gravity><scene><ambient>0.1 0.2 0.3 "
      "1</ambient><shadows>false</shadows><sky/></scene>"
      "<light name='s' type='spot'><pose>0 0 4 0 0 0</pose><direction>0 0 "
      "-2</direction><spot><outer_angle>0.6</outer_angle></spot>"
      "<attenuation><range>7</range></attenuation></light>"
      "<model name='m'><link name='l'><collision "
      "name='c'><geometry><sphere><radius>1</radius></sphere></"
      "geometry><surface><friction><ode><mu>0.4</mu></ode></friction>"
      "<bounce><restitution_coefficient>0.3</restitution_coefficient></"
      "bounce><ruedo:laser_reflectance>0.5</ruedo:laser_reflectance></surface></collision>"
      "<visual "
      "name='v'><geometry><sphere><radius>1</radius></sphere></"
      "geometry><material><script><name>Gazebo/RedTransparent</name></script></material></visual>"
      "</link></model>");
  EXPECT_EQ(world->gravity, Vec3(0, 0, -1.6));
  EXPECT_FLOAT_EQ(world->sky.ambient[1], 0.2f);
  EXPECT_TRUE(world->sky.sky);
  EXPECT_FALSE(world->sky.shadows);
  EXPECT_EQ(world->lights.at(0).type, Light::Type::spot);
  EXPECT_EQ(world->lights[0].direction, Vec3(0, 0, -1));
  EXPECT_EQ(world->lights[0].range, 7);
  const Link& link = world->models.at(0).model->links[0];
  EXPECT_EQ(link.collisions.at(0).surface.friction, 0.4);
  EXPECT_EQ(link.collisions[0].surface.friction2, 0.4);
  EXPECT_EQ(link.collisions[0].surface.restitution, 0.3);
  EXPECT_EQ(link.collisions[0].surface.laser_reflectance, 0.5);
  EXPECT_EQ(link.visuals.at(0).material->diffuse, (Rgba{1, 0, 0, 0.5f}));
}

TEST(Scene, LightsOfLinksAreInTheirLinksFrames) {
  const auto world = world_of(
      "<model name='m'><pose>10 0 0 0 0 0</pose><link name='l'><pose>0 0 1 0 0 0</pose><light "
      "name='lamp' type='point'><pose>0.5 0 0.25 0 0 0</pose>"
      "<diffuse>1 0.5 0 "
      "1</diffuse><attenuation><range>3</range></attenuation></light></link></model>");
  EXPECT_TRUE(world->lights.empty());
  const Link& link = link_of(*world->models.at(0).model, "l");
  ASSERT_EQ(link.lights.size(), 1u);
  EXPECT_EQ(link.lights[0].name, "lamp");
  EXPECT_EQ(link.lights[0].type, Light::Type::point);
  EXPECT_EQ(link.lights[0].pose.translation, Vec3(0.5, 0, 0.25));
  EXPECT_EQ(link.lights[0].diffuse, (Rgba{1, 0.5f, 0, 1}));
  EXPECT_EQ(link.lights[0].range, 3);
  EXPECT_TRUE(texts(*world).empty());
}

TEST(Scene, OgreScriptsGiveColourAndTexture) {
  TemporaryFolder folder;
  folder.write("models/crate/materials/scripts/crate.material",
               "// two materials, one a prefix of the other\nmaterial Crate/Side2\n{\n technique\n "
               "{\n  pass\n  {\n   diffuse 1 0 0\n  }\n }\n}\n"
               "material Crate/Side\n{\n technique\n {\n  pass\n  {\n   ambient 0.1 0.2 0.3\n   "
               "diffuse 0.25 0.5 0.75 1.0\n"
               "   specular 0.5 0.5 0.5 1.0 12\n   texture_unit\n   {\n    texture planks.png\n   "
               "}\n  }\n }\n}\n");
  folder.write("models/crate/materials/textures/planks.png", "not decoded here");
  folder.write("models/crate/model.sdf",
               "<sdf version='1.6'><model name='crate'><link name='l'><visual "
               "name='v'><geometry><box><size>1 1 1</size></box></geometry><material><script>"
               "<uri>model://crate/materials/scripts</uri><uri>model://crate/materials/textures</"
               "uri><name>Crate/Side</name></script></material></visual></link></model></sdf>");
  const auto world = load_world(
      folder.write("w.sdf",
                   "<sdf version='1.6'><world "
                   "name='w'><include><uri>model://crate</uri></include></world></sdf>"));
  const Visual& visual = world->models.at(0).model->links[0].visuals.at(0);
  ASSERT_TRUE(visual.material);
  EXPECT_EQ(visual.material->diffuse, (Rgba{0.25f, 0.5f, 0.75f, 1}));
  EXPECT_EQ(visual.material->ambient, (Rgba{0.1f, 0.2f, 0.3f, 1}));
  EXPECT_FLOAT_EQ(visual.material->shininess, 12);
  ASSERT_TRUE(visual.material->texture);
  EXPECT_EQ(visual.material->texture->path, folder / "models/crate/materials/textures/planks.png");
  EXPECT_TRUE(texts(*world).empty());
}

// As Gazebo Classic saves a world whose models were moved. Names that the world does not have, and
// values that are not numbers, change nothing.
TEST(Scene, ASavedStateMovesItsModels) {
  const std::string model = "<link name='l'/></model>";
  const auto world =
      world_of("<model name='moved'><pose>1 2 3 0 0 0</pose>" + model +
               "<model name='same'><pose>4 5 6 0 0 0</pose>" + model +
               "<state world_name='default'><sim_time>116 345000000</sim_time><model "
               "name='moved'><pose frame=''>7 8 9 0 0 1</pose><scale>1 1 1</scale>"
               "<link name='l'><pose>7 8 9 0 0 1</pose></link></model><model name='gone'><pose>0 0 "
               "0 0 0 0</pose></model>"
               "<model name='same'><pose>nan 0 0 0 0 0</pose></model></state>");
  ASSERT_EQ(world->models.size(), 2u);
  EXPECT_EQ(world->models[0].X_WM.translation, Vec3(7, 8, 9));
  EXPECT_NEAR(heading(world->models[0].X_WM.rotation), 1.0, 1e-12);
  EXPECT_EQ(world->models[1].X_WM.translation, Vec3(4, 5, 6));
  EXPECT_THAT(texts(*world),
              testing::ElementsAre(testing::HasSubstr("'nan' is not finite"),
                                   "the world has no model 'gone'; its state is left out"));
  const auto door = world_of(
      "<model name='door'><link name='frame'/><link name='leaf'><pose>1 0 0 0 0 "
      "0</pose></link></model><state><model name='door'>"
      "<pose>2 0 0 0 0 0</pose><link name='frame'><pose>2 0 0 0 0 0</pose></link><link "
      "name='leaf'><pose>2 1 0 0 0 1.57</pose></link></model></state>");
  EXPECT_EQ(texts(*door),
            std::vector<std::string>{
                "its link 'leaf' was elsewhere than any position of its joints puts it; it stands "
                "where the model has it"});
}

// Three by three heights with a peak in the middle: a pyramid of 2 m on a square of 4 m.
TEST(Scene, HeightmapsStandAtTheirPlaces) {
  TemporaryFolder folder;
  folder.write("hill.pgm", std::string("P5\n3 3\n255\n") + std::string("\0\0\0\0\xff\0\0\0\0", 9));
  const auto world = load_world(
      folder.write("w.sdf",
                   "<sdf version='1.9'><world name='w'><model name='m'><static>true</static><link "
                   "name='l'><collision name='c'><geometry><heightmap><uri>hill.pgm</uri>"
                   "<size>4 4 2</size><pos>1 0 "
                   "0</pos></heightmap></geometry></collision></link></model></world></sdf>"));
  const Link& link = world->models.at(0).model->links[0];
  ASSERT_EQ(link.collisions.size(), 1u);
  const Geometry& hill = link.collisions[0].geometry;
  ASSERT_TRUE(hill.mesh);
  Eigen::AlignedBox3d box;
  Vec3 top = Vec3::Zero();
  for_each_vertex(*hill.mesh, [&](const Eigen::Vector3f& p) {
    const Vec3 p_L = link.collisions[0].X_LC * Vec3(p.cast<double>().cwiseProduct(hill.scale));
    box.extend(p_L);
    if (p_L.z() > top.z()) top = p_L;
  });
  EXPECT_LT((box.min() - Vec3(-1, -2, 0)).norm(), 1e-6);
  EXPECT_LT((box.max() - Vec3(3, 2, 2)).norm(), 1e-6);
  EXPECT_LT((top - Vec3(1, 0, 2)).norm(), 1e-6);
}

// A picture of 2 m by 2 m over 4 m: two tiles each way. Gazebo's own media path names a file that
// the model has itself.
TEST(Scene, HeightmapsAreCoveredByTheirFirstTexture) {
  TemporaryFolder folder;
  folder.write("hill.pgm", std::string("P5\n2 2\n255\n") + std::string(4, '\0'));
  const std::string grass =
      folder.write("materials/textures/grass.ppm", std::string("P6\n1 1\n255\n") + "\1\2\3");
  const auto heightmap = [&](const std::string& textures) {
    return load_world(folder.write(
        "w.sdf",
        "<sdf version='1.9'><world name='w'><model name='m'><static>true</static><link "
        "name='l'><visual name='v'>"
        "<geometry><heightmap><uri>hill.pgm</uri><size>4 4 2</size>" +
            textures + "</heightmap></geometry></visual></link></model></world></sdf>"));
  };
  const std::string texture =
      "<texture><size>2</size><diffuse>file://media/materials/textures/grass.ppm</diffuse></"
      "texture>";
  const auto world = heightmap(texture);
  EXPECT_TRUE(world->findings.empty());
  const Mesh& mesh = *world->models.at(0).model->links[0].visuals.at(0).geometry.mesh;
  ASSERT_EQ(mesh.materials.size(), 1u);
  EXPECT_EQ(mesh.materials[0].texture->path, grass);
  EXPECT_EQ(mesh.parts.at(0).material, 0);
  EXPECT_EQ(height_map(mesh)->tiles, Eigen::Vector2f(2, 2));
  EXPECT_THAT(texts(*heightmap(texture + texture)),
              testing::ElementsAre(testing::HasSubstr("not blended in")));
  EXPECT_THAT(texts(*heightmap("<texture><diffuse>none.ppm</diffuse></texture>")),
              testing::ElementsAre(testing::HasSubstr("'none.ppm' is not found")));
  EXPECT_THAT(texts(*heightmap("<texture><size>0</size><diffuse>grass.ppm</diffuse></texture>")),
              testing::ElementsAre(testing::HasSubstr("the shape is left out")));
}

TEST(Scene, ActorsWalkAsCylinders) {
  const auto world = world_of(
      "<actor "
      "name='p'><skin><filename>walk.dae</filename></skin><script><loop>false</"
      "loop><delay_start>1</delay_start><trajectory id='0' type='walk'>"
      "<waypoint><time>0</time><pose>1 2 1.1 1.57 0 "
      "0</pose></waypoint><waypoint><time>4</time><pose>5 2 1.1 1.57 0 0.5</pose></waypoint>"
      "</trajectory></script></actor>");
  const ModelInstance& p = world->models.at(0);
  ASSERT_TRUE(p.model->path);
  const auto waypoints = p.model->path->all("ruedo:waypoint");
  ASSERT_EQ(waypoints.size(), 2u);
  EXPECT_EQ(waypoints[1]->text, "5 5 2 0 0 0 0.5");
  EXPECT_FALSE(p.model->path->boolean("ruedo:loop", true));
  EXPECT_EQ(p.X_WM.translation, Vec3(1, 2, 0));
  EXPECT_FALSE(p.model->is_static);
  const auto odd = world_of(
      "<actor name='p'><script><trajectory id='0'><waypoint><time>1</time><pose>1 2 1 0 0 "
      "0</pose></waypoint><waypoint><time>1</time><pose>0 0 1 0 0 0</pose>"
      "</waypoint><waypoint><time>2</time><pose>3 2 4 0 0 "
      "0</pose></waypoint></trajectory><trajectory id='1'/></script></actor>");
  EXPECT_EQ(odd->models.at(0).model->path->all("ruedo:waypoint").size(), 3u);
  EXPECT_THAT(texts(*odd), testing::Contains(testing::HasSubstr("this one is left out")));
  EXPECT_THAT(texts(*world_of("<actor name='a'/><actor name='b'/><actor name='c'/>")),
              testing::ElementsAre(testing::HasSubstr("a cylinder of 1.7 m (and 2 more do)")));
}

// One trajectory after another, each with a clock of its own; feet on the floor of each storey, and
// without a floor at the file's height.
TEST(Scene, ActorsWalkAllTheirTrajectoriesOnAnyFloor) {
  const auto waypoint = [](const std::string& time, const std::string& at) {
    return "<waypoint><time>" + time + "</time><pose>" + at + "</pose></waypoint>";
  };
  const auto world = world_of(
      "<model name='upstairs'><static>true</static><link name='l'><collision name='c'><pose>10 0 "
      "2.9 0 0 0</pose><geometry><box><size>4 4 0.2</size></box></geometry></collision></link>"
      "</model><actor name='p'><script><delay_start>1</delay_start><trajectory id='0'>" +
      waypoint("2", "0 0 1 0 0 0") + waypoint("4", "2 0 1 0 0 0") +
      "</trajectory><trajectory id='1'>" + waypoint("0", "2 0 1 0 0 0") +
      waypoint("5", "10 0 4 0 0 1") + waypoint("6", "20 0 4 0 0 1") +
      "</trajectory></script></actor>");
  const std::vector<double> expected[] = {{1, 0, 0, 0, 0, 0, 0},   {3, 0, 0, 0, 0, 0, 0},
                                          {5, 2, 0, 0, 0, 0, 0},   {5.000001, 2, 0, 0, 0, 0, 0},
                                          {10, 10, 0, 3, 0, 0, 1}, {11, 20, 0, 4, 0, 0, 1}};
  const auto walked = world->models.at(1).model->path->all("ruedo:waypoint");
  ASSERT_EQ(walked.size(), std::size(expected));
  for (size_t i = 0; i < walked.size(); ++i) {
    EXPECT_THAT(walked[i]->as_numbers(Allowed::any(quantity::kTime)),
                testing::Pointwise(testing::DoubleNear(1e-8), expected[i]));
  }
  EXPECT_THAT(texts(*world_of("<actor name='p'><plugin name='x' filename='libActorPlugin.so'/>"
                              "</actor>")),
              testing::Contains(testing::HasSubstr("the plugin ActorPlugin does nothing here")));
}

TEST(Scene, ACrowdStandsWhereThereIsRoom) {
  const auto crowd = [](const std::string& more, const std::string& walls = "") {
    return world_of(walls + "<ruedo:crowd name='people'><ruedo:area>-3 -3 3 3</ruedo:area>" + more +
                    "</ruedo:crowd>");
  };
  const std::string wall =
      "<model name='wall'><static>true</static><link name='l'><collision name='c'><pose>0 0 1 0 0 "
      "0</pose><geometry><box><size>2 6 2</size></box></geometry></collision></link></model>";
  const auto world = crowd("<ruedo:count>20</ruedo:count><ruedo:goal>2 0</ruedo:goal>", wall);
  ASSERT_EQ(world->models.size(), 21u);
  EXPECT_EQ(world->models[20].name, "people_20");
  EXPECT_FALSE(world->models[1].is_robot());
  for (size_t i = 1; i < 21; ++i) {
    const Vec3& at = world->models[i].X_WM.translation;
    EXPECT_GE(std::abs(at.x()), 1.25);
    for (size_t k = 1; k < i; ++k) EXPECT_GE((at - world->models[k].X_WM.translation).norm(), 0.5);
  }
  const auto fault = [&](const std::string& more) {
    try {
      crowd(more);
    } catch (const InputError& error) {
      return error.message();
    }
    return std::string("nothing");
  };
  EXPECT_THAT(fault("<ruedo:count>500</ruedo:count>"), testing::HasSubstr("there is room for"));
  EXPECT_THAT(
      fault("<ruedo:goal>1 2 3</ruedo:goal>"),
      testing::HasSubstr("<ruedo:goal>: '1 2 3' is not allowed; allowed are x y of a place"));
  EXPECT_THAT(fault("<ruedo:speed>0</ruedo:speed>"), testing::HasSubstr("a mean above 0"));
  EXPECT_THAT(fault("<ruedo:at_end>rest</ruedo:at_end>"), testing::HasSubstr("again"));
  EXPECT_THAT(fault("<ruedo:gaol>1 2</ruedo:gaol>"), testing::HasSubstr("<ruedo:goal>"));
}

}  // namespace
}  // namespace ruedo::world
