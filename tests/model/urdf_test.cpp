// URDF as robots of all kinds write it: roots named world, values as attributes, packages found by the folder they are in.
#include <cstdlib>

#include <gtest/gtest.h>

#include "model/body_layout.h"
#include "model/load.h"
#include "temporary_folder.h"

namespace ruedo::model {
namespace {

std::vector<std::string> texts(const WorldModel& world) {
  std::vector<std::string> result;
  for (const Finding& each : world.findings) result.push_back(each.text);
  return result;
}

// An arm on a table of the world, 0.7 m up: its links are not loose, and do not lose a link to the world.
TEST(Urdf, ARootNamedWorldIsTheWorld) {
  TemporaryFolder folder;
  const auto world = load_world(folder.write("arm.urdf", R"(<robot name="arm"><link name="world"/>
<link name="base"><inertial><mass value="4"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="upper"/>
<joint name="table" type="fixed"><parent link="world"/><child link="base"/><origin xyz="0.5 0 0.7"/></joint>
<joint name="shoulder" type="continuous"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.2"/><axis xyz="0 1 0"/></joint></robot>)"));
  EXPECT_EQ(texts(*world), std::vector<std::string>{});
  const Model& arm = *world->models.back().model;
  ASSERT_EQ(arm.links.size(), 2u);
  EXPECT_LT((arm.links[0].X_ML.translation - Vec3(0.5, 0, 0.7)).norm(), 1e-12);
  EXPECT_LT((arm.links[1].X_ML.translation - Vec3(0.5, 0, 0.9)).norm(), 1e-12);
  ASSERT_EQ(arm.joints.size(), 2u);
  EXPECT_EQ(arm.joints[0].parent, -1);
  EXPECT_EQ(arm.joints[0].child, 0);
}

TEST(Urdf, OnlyTheRootMayBeTheWorld) {
  TemporaryFolder folder;
  const std::string file = folder.write("arm.urdf", R"(<robot name="arm"><link name="base"/>
<link name="world"/>
<joint name="j" type="fixed"><parent link="base"/><child link="world"/></joint></robot>)");
  try {
    load_world(file);
    FAIL() << "it loads";
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what()), file + ":2: <link>: 'world' is a reserved name; only the root of all links may have it, which then is the world");
  }
}

TEST(Urdf, WhatTheWorldLinkShowsIsNamed) {
  TemporaryFolder folder;
  const auto world = load_world(folder.write("arm.urdf", R"(<robot name="arm"><link name="world"><visual><geometry><box size="1 1 1"/></geometry></visual></link>
<link name="base"/><joint name="j" type="fixed"><parent link="world"/><child link="base"/></joint></robot>)"));
  EXPECT_EQ(texts(*world), (std::vector<std::string>{"the link 'world' is the world itself; its shapes and sensors are left out"}));
}

TEST(Urdf, GravityIsTurnedOffByTextOrAttribute) {
  TemporaryFolder folder;
  const auto world = load_world(folder.write("bot.urdf", R"(<robot name="bot"><link name="a"/><link name="b"/><link name="c"/>
<joint name="ab" type="fixed"><parent link="a"/><child link="b"/></joint><joint name="bc" type="fixed"><parent link="b"/><child link="c"/></joint>
<gazebo reference="a"><turnGravityOff value="true"/></gazebo><gazebo reference="b"><turnGravityOff>true</turnGravityOff></gazebo>
<gazebo reference="c"><turnGravityOff value="false"/></gazebo></robot>)"));
  const Model& bot = *world->models.back().model;
  EXPECT_FALSE(bot.links.at(0).gravity);
  EXPECT_FALSE(bot.links.at(1).gravity);
  EXPECT_TRUE(bot.links.at(2).gravity);
}

constexpr const char* kTetrahedron =
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

std::string robot_with_mesh(const std::string& uri) {
  return R"(<robot name="bot"><link name="a"><visual><geometry><mesh filename=")" + uri + R"("/></geometry></visual></link></robot>)";
}

// Without a manifest, and with one of another name: the folder that the robot's file is in has the package's name.
TEST(Urdf, PackagesGoByTheFolderThatTheFileIsIn) {
  TemporaryFolder folder;
  folder.write("bot_description/meshes/a.obj", kTetrahedron);
  const auto world = load_world(folder.write("bot_description/robots/eu/urdf/bot.urdf", robot_with_mesh("package://bot_description/meshes/a.obj")));
  EXPECT_EQ(texts(*world), std::vector<std::string>{});
  folder.write("bot_description/package.xml", "<package><name>bot_descriptions</name></package>");
  EXPECT_EQ(texts(*load_world(folder / "bot_description/robots/eu/urdf/bot.urdf")), std::vector<std::string>{});
}

// The user's own folder is no package, whatever a file calls it.
TEST(Urdf, TheHomeFolderIsNoPackage) {
  TemporaryFolder folder;
  folder.write("ann/pictures/a.obj", kTetrahedron);
  const std::string file = folder.write("ann/downloads/deep/bot.urdf", robot_with_mesh("package://ann/pictures/a.obj"));
  EXPECT_EQ(texts(*load_world(file)).size(), 0u);
  const char* home = std::getenv("HOME");
  const std::string before = home ? home : "";
  setenv("HOME", (folder / "ann").c_str(), 1);
  const auto told = texts(*load_world(file));
  setenv("HOME", before.c_str(), 1);
  EXPECT_EQ(told, (std::vector<std::string>{"the mesh 'package://ann/pictures/a.obj' is not found; the shape is left out"}));
}

}  // namespace
}  // namespace ruedo::model
