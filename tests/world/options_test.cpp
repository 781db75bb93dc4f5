// --spawn, --set, --disable, and robots without a world: URDF.
#include <cmath>

#include <gtest/gtest.h>

#include "ruedo/sensor.h"
#include "temporary_folder.h"
#include "world/drives/placement.h"
#include "world/load.h"
#include "world/model/convex.h"

namespace ruedo::world {
namespace {

const char* kRobot = R"(<sdf version='1.9'><model name='bot'>
<link name='base'><pose>0 0 0.3 0 0 0</pose><collision name='c'><geometry><box><size>0.4 0.4 0.2</size></box></geometry></collision>
<sensor name='LRF' type='lidar'><update_rate>10</update_rate><always_on>1</always_on><topic>t</topic><lidar><scan><horizontal><samples>181</samples></horizontal></scan>
<range><min>0.1</min><max>8</max></range></lidar></sensor></link>
<link name='l'><pose>0 0.25 0.1 0 0 0</pose><collision name='c'><geometry><sphere><radius>0.1</radius></sphere></geometry></collision></link>
<link name='r'><pose>0 -0.25 0.1 0 0 0</pose><collision name='c'><geometry><sphere><radius>0.1</radius></sphere></geometry></collision></link>
<joint name='jl' type='revolute'><parent>base</parent><child>l</child><axis><xyz>0 1 0</xyz></axis></joint>
<joint name='jr' type='revolute'><parent>base</parent><child>r</child><axis><xyz>0 1 0</xyz></axis></joint>
<ruedo:drive><ruedo:left_joint>jl</ruedo:left_joint><ruedo:right_joint>jr</ruedo:right_joint></ruedo:drive>
</model></sdf>)";

// The elements that the lidar's kind allows a file to leave out.
const RegisterSensor kLidar{{.module = "lidar",
                             .order = 0,
                             .types = {"lidar"},
                             .attach_to = "",
                             .device_name = "",
                             .default_rate = {10, 1},
                             .make = {},
                             .settings = [](const std::string&) {
                               return std::vector<std::string>{
                                   "lidar.scan.vertical.samples", "ruedo:sweep_time",
                                   "lidar.noise.type", "lidar.noise.stddev"};
                             }}};

// Ground at 0; a static ramp of 0.2 m at x 5 (a box), a wall of 2 m at x 10, a roof over all, a
// light box at y 5.
const char* kWorld = R"(<sdf version='1.9'><world name='w'>
<model name='ground'><static>true</static><link name='l'><collision name='c'><geometry><plane/></geometry></collision></link></model>
<model name='stage'><static>true</static><pose>5 0 0.1 0 0 0</pose><link name='l'><collision name='c'><geometry><box><size>2 2 0.2</size></box></geometry></collision></link></model>
<model name='wall'><static>true</static><pose>10 0 1 0 0 0</pose><link name='l'><collision name='c'><geometry><box><size>0.2 4 2</size></box></geometry></collision></link></model>
<model name='roof'><static>true</static><pose>0 0 3 0 0 0</pose><link name='l'><collision name='c'><geometry><box><size>40 40 0.2</size></box></geometry></collision></link></model>
<model name='crate'><pose>0 5 0.25 0 0 0</pose><link name='l'><collision name='c'><geometry><box><size>0.5 0.5 0.5</size></box></geometry></collision></link></model>
</world></sdf>)";

class Options : public testing::Test {
 protected:
  void SetUp() override {
    world = folder.write("world.sdf", kWorld);
    folder.write("bot.sdf", kRobot);
  }
  std::shared_ptr<const WorldModel> spawned(double x, double y, double yaw = 0,
                                            const std::string& name = "") const {
    LoadOptions options;
    options.spawns.push_back({"bot.sdf", name, x, y, yaw});
    return load_world(world, options);
  }
  std::string error_of(const LoadOptions& options) const {
    try {
      load_world(world, options);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
  LoadOptions with_bot() const {
    LoadOptions options;
    options.spawns.push_back({"bot.sdf", "", 0, 0, 0});
    return options;
  }
  TemporaryFolder folder;
  std::string world;
};

// The error without the free place that it suggests.
std::string without_place(const std::string& error) {
  return error.substr(0, error.find("; the nearest"));
}

TEST_F(Options, SpawnStandsOnTheGround) {
  const auto plain = spawned(1, 2, 0.5);
  EXPECT_EQ(plain->models.back().name, "bot");
  EXPECT_NEAR(plain->models.back().X_WM.translation.z(), 0,
              1e-7);  // its wheels reach down to its own 0
  EXPECT_NEAR(heading(plain->models.back().X_WM.rotation), 0.5, 1e-12);
  EXPECT_NEAR(spawned(5, 0)->models.back().X_WM.translation.z(), 0.2,
              1e-7);  // on the stage, under the roof
}

// A ramp that rises by 0.3 rad along x, its top at 0.25 m over (20, 0); and with a wall of 1 m on
// it.
TEST_F(Options, SpawnIsTiltedAsTheGround) {
  const std::string ramp =
      "<model name='ramp'><static>true</static><pose>20.029552 0 0.154466 0 -0.3 0</pose><link "
      "name='l'><collision name='c'><geometry>"
      "<box><size>1.6 4 0.2</size></box></geometry></collision>WALL</link></model></world>";
  const auto in_world = [&](const std::string& wall) {
    std::string text = kWorld, model = ramp;
    model.replace(model.find("WALL"), 4, wall);
    world = folder.write("world.sdf", text.replace(text.find("</world>"), 8, model));
  };
  in_world("");
  const Pose X_WM = spawned(20, 0, 0.5)->models.back().X_WM;
  EXPECT_LT((X_WM.translation - Vec3(20, 0, 0.25)).norm(), 1e-6);
  EXPECT_LT((X_WM.rotation * Vec3::UnitZ() - Vec3(-std::sin(0.3), 0, std::cos(0.3))).norm(), 1e-6);
  EXPECT_NEAR(heading(X_WM.rotation), 0.5, 1e-9);
  in_world(
      "<collision name='s'><pose>0.3 0 0.6 0 0 0</pose><geometry><box><size>0.4 4 "
      "1</size></box></geometry></collision>");
  LoadOptions options;
  options.spawns.push_back({"bot.sdf", "", 20, 0, 0});
  EXPECT_EQ(without_place(error_of(options)),
            "--spawn bot.sdf@20,0: there is no room, it would stand in 'ramp'");
}

TEST_F(Options, SpawnRefusesToStandInSomething) {
  LoadOptions options;
  options.spawns.push_back({"bot.sdf", "", 9.9, 0, 0});
  EXPECT_EQ(without_place(error_of(options)),
            "--spawn bot.sdf@9.9,0: there is no room, it would stand in 'wall'");
  options.spawns[0] = {"bot.sdf", "", 0.3, 5.3, 0};
  EXPECT_EQ(without_place(error_of(options)),
            "--spawn bot.sdf@0.3,5.3: there is no room, it would stand in 'crate'");
  options.spawns[0] = {"bot.sdf", "", 0.56, 5.56,
                       0};  // past the corner: their boxes are apart by a little
  EXPECT_EQ(error_of(options), "");
  options.spawns = {{"bot.sdf", "", 0, 0, 0}, {"bot.sdf", "", 0.3, 0, 0}};
  EXPECT_EQ(without_place(error_of(options)),
            "--spawn bot.sdf@0.3,0: there is no room, it would stand in 'bot'");
  const std::string error = error_of(options), named = "; the nearest free place is ";
  const size_t at = error.find(named);
  ASSERT_NE(at, std::string::npos);
  const std::string place = error.substr(at + named.size());
  options.spawns[1].x = std::stod(place);
  options.spawns[1].y = std::stod(place.substr(place.find(',') + 1));
  EXPECT_EQ(error_of(options), "");  // there it has room
  options.spawns = {{"nobot", "", 0, 0, 0}};
  EXPECT_EQ(error_of(options),
            "--spawn nobot: there is no such file, and no model of that name in the search path");
  options.spawns = {{"bot.sdf", "wall", 0, 0, 0}};
  EXPECT_EQ(error_of(options),
            "--spawn bot.sdf: the name 'wall' is taken by another model of the world");
}

TEST_F(Options, SpawnedNamesCountUp) {
  LoadOptions options;
  for (int i = 0; i < 3; ++i) options.spawns.push_back({"bot.sdf", "", i * 1.0, 0, 0});
  const auto loaded = load_world(world, options);
  EXPECT_EQ(loaded->models[5].name, "bot");
  EXPECT_EQ(loaded->models[6].name, "bot_2");
  EXPECT_EQ(loaded->models[7].name, "bot_3");
  EXPECT_EQ(loaded->models[7].model, loaded->models[5].model);
}

TEST_F(Options, SetChangesOneRobotOnly) {
  LoadOptions options = with_bot();
  options.spawns.push_back({"bot.sdf", "other", 2, 0, 0});
  options.settings = {{"bot", "LRF", "update_rate", "25"},
                      {"bot", "LRF", "range.max", "4"},
                      {"bot", "LRF", "sweep_time", "0.01"},
                      {"bot", "velocity", "max_speed", "0.5"},
                      {"bot", "odometry", "ticks_per_turn", "1000"}};
  const auto loaded = load_world(world, options);
  const Model& bot = *loaded->models[5].model;
  const Model& other = *loaded->models[6].model;
  EXPECT_EQ(bot.sensors[0].element->number("update_rate", 0, Allowed::any(quantity::kRange)), 25);
  EXPECT_EQ(bot.sensors[0].element->number("lidar/range/max", 0, Allowed::any(quantity::kRange)),
            4);
  EXPECT_EQ(bot.sensors[0].element->number("ruedo:sweep_time", 0, Allowed::any(quantity::kRange)),
            0.01);
  EXPECT_EQ(bot.drive->max_speed, 0.5);
  EXPECT_EQ(bot.drive->odometry->integer("ruedo:ticks_per_turn", 0, Allowed::any(quantity::kRange)),
            1000);
  EXPECT_EQ(other.sensors[0].element->number("update_rate", 0, Allowed::any(quantity::kRange)), 10);
  EXPECT_EQ(other.drive->max_speed, std::numeric_limits<double>::infinity());
}

TEST_F(Options, SetErrorsListTheCandidates) {
  const auto error = [&](const Setting& setting) {
    LoadOptions options = with_bot();
    options.settings = {setting};
    return error_of(options);
  };
  EXPECT_EQ(
      error({"bott", "LRF", "update_rate", "1"}),
      "--set bott/LRF.update_rate: there is no robot 'bott'; did you mean 'bot'?; there are bot");
  EXPECT_EQ(error({"bot", "LRFF", "update_rate", "1"}),
            "--set bot/LRFF.update_rate: the robot has no device 'LRFF'; did you mean 'LRF'?; "
            "there are velocity, wheels, odometry, pose, motion, move, LRF");
  EXPECT_NE(
      error({"bot", "LRF", "update_rat", "1"})
          .find(
              "did you mean 'update_rate'?; there are update_rate, lidar.scan.horizontal.samples"),
      std::string::npos);
  EXPECT_NE(error({"bot", "velocity", "wheelbase", "maybe"}).find("there is no 'wheelbase'"),
            std::string::npos);
  for (const char* key : {"always_on", "visualize", "topic"})
    EXPECT_NE(error({"bot", "LRF", key, "maybe"}).find("there is no '" + std::string(key) + "'"),
              std::string::npos);
  EXPECT_EQ(error({"bot", "LRF", "samples", "1"}),
            "--set bot/LRF.samples: 'samples' could be lidar.scan.horizontal.samples, "
            "lidar.scan.vertical.samples");
  EXPECT_EQ(error({"bot", "velocity", "max_speed", "fast"}),
            "--set bot/velocity.max_speed: <ruedo:drive/ruedo:max_speed>: 'fast' is not a number; "
            "allowed is a number above 0, or inf");
}

TEST_F(Options, SetCannotChangeNoiseOfTypeNone) {
  const Setting deviation{"bot", "LRF", "noise.stddev", "0.01"};
  LoadOptions options = with_bot();
  options.settings = {deviation};
  EXPECT_EQ(error_of(options),
            "--set bot/LRF.noise.stddev: has no effect, since the noise is of type none; set "
            "lidar.noise.type=gaussian, too");
  for (const char* first : {"none", "gaussian"}) {
    options.settings = {{"bot", "LRF", "noise.type", first},
                        deviation,
                        {"bot", "LRF", "lidar.noise.type", "gaussian"}};
    EXPECT_EQ(error_of(options), "");
  }
  options.settings = {{"bot", "LRF", "noise.type", "none"}};
  EXPECT_EQ(error_of(options), "");
}

TEST_F(Options, Disable) {
  LoadOptions options = with_bot();
  options.disabled = {"bot/LRF", "bot/odometry"};
  const auto loaded = load_world(world, options);
  EXPECT_TRUE(loaded->models.back().model->sensors.empty());
  EXPECT_EQ(loaded->disabled, (std::vector<std::string>{"bot/odometry"}));
  options.disabled = {"bot/SONAR"};
  EXPECT_NE(error_of(options).find("--disable bot/SONAR: the robot has no device 'SONAR'"),
            std::string::npos);
}

TEST_F(Options, UnchangedRobotsShareTheirModel) {
  LoadOptions options;
  for (const char* name : {"a", "b", "c"}) options.spawns.push_back({"bot.sdf", name, 0, 0, 0});
  for (size_t i = 0; i < 3; ++i) options.spawns[i].y = -2.0 * static_cast<double>(i);
  options.disabled = {"a/LRF", "c/LRF"};
  const auto models = load_world(world, options)->models;
  const size_t first = models.size() - 3;
  EXPECT_EQ(models[first].model, models[first + 2].model);
  EXPECT_TRUE(models[first].model->sensors.empty());
  EXPECT_EQ(models[first + 1].model->sensors.size(), 1u);
}

TEST(Convex, OverlapByHand) {
  const auto shape = [](Shape kind, const Vec3& size) {
    Geometry g;
    g.shape = kind;
    g.size = size;
    return g;
  };
  const Geometry box = shape(Shape::box, {2, 2, 2}), sphere = shape(Shape::sphere, {1, 1, 1}),
                 cylinder = shape(Shape::cylinder, {1, 2, 0}), cone = shape(Shape::cone, {1, 2, 0}),
                 capsule = shape(Shape::capsule, {1, 2, 0}),
                 ellipsoid = shape(Shape::ellipsoid, {1, 2, 3});
  const auto at = [](double x, double y, double z) { return Pose{Quat::Identity(), {x, y, z}}; };
  const auto hit = [&](const Geometry& a, const Geometry& b, const Pose& X) {
    return overlap({&a, {}, {}}, {&b, X, {}});
  };
  struct Case {
    const Geometry& a;
    const Geometry& b;
    Vec3 direction;
    double touching;  // distance of the centres at which they touch
  };
  const double d = 1 / std::sqrt(2.0);
  const Case cases[] = {
      {box, box, {1, 0, 0}, 2},
      {box, sphere, {0, 1, 0}, 2},
      {box, sphere, {d, d, 0}, std::sqrt(2.0) + 1},
      {cylinder, cylinder, {d, d, 0}, 2},
      {cylinder, sphere, {0, 0, 1}, 2},
      {cylinder, box, {d, d, 0}, std::sqrt(2.0) + 1},
      {capsule, sphere, {0, 0, 1}, 3},
      {ellipsoid, sphere, {0, 0, 1}, 4},
      {ellipsoid, sphere, {0, 1, 0}, 3},
      {cone, sphere, {0, 0, 1}, 2},
      {cone, box, {0, 0, -1}, 2},
  };
  for (const Case& each : cases) {
    const Vec3 in = each.direction * (each.touching - 1e-4),
               out = each.direction * (each.touching + 1e-4);
    EXPECT_TRUE(hit(each.a, each.b, at(in.x(), in.y(), in.z())))
        << each.direction.transpose() << " " << each.touching;
    EXPECT_FALSE(hit(each.a, each.b, at(out.x(), out.y(), out.z())))
        << each.direction.transpose() << " " << each.touching;
  }
}

const char* kUrdf = R"(<robot name="bot">
  <material name="red"><color rgba="1 0 0 1"/></material>
  <link name="base_footprint"/>
  <link name="base_link"><inertial><origin xyz="0.1 0 0"/><mass value="5"/><inertia ixx="0.1" iyy="0.2" izz="0.25" ixy="0" ixz="0" iyz="0"/></inertial>
    <visual><geometry><box size="0.4 0.3 0.1"/></geometry><material name="red"/></visual>
    <collision><origin xyz="0 0 0.05"/><geometry><box size="0.4 0.3 0.1"/></geometry></collision></link>
  <link name="left"><collision><origin rpy="1.5707963 0 0"/><geometry><cylinder radius="0.1" length="0.04"/></geometry></collision></link>
  <link name="right"><collision><origin rpy="1.5707963 0 0"/><geometry><cylinder radius="0.1" length="0.04"/></geometry></collision></link>
  <joint name="foot" type="fixed"><parent link="base_footprint"/><child link="base_link"/><origin xyz="0 0 0.1"/></joint>
  <joint name="jl" type="continuous"><parent link="base_link"/><child link="left"/><origin xyz="0 0.2 0" rpy="0 0 0.5"/><axis xyz="0 1 0"/></joint>
  <joint name="jr" type="continuous"><parent link="base_link"/><child link="right"/><origin xyz="0 -0.2 0"/><axis xyz="0 1 0"/></joint>
  <gazebo reference="base_link"><sensor name="LRF" type="ray"><pose>0 0 0.2 0 0 0</pose></sensor><mu1>0.3</mu1></gazebo>
  <gazebo><plugin filename="libgazebo_ros_diff_drive.so" name="d"><left_joint>jl</left_joint><right_joint>jr</right_joint></plugin></gazebo>
</robot>)";

TEST(Urdf, RobotInAnEmptyWorld) {
  TemporaryFolder folder;
  const auto world = load_world(folder.write("bot.urdf", kUrdf));
  EXPECT_TRUE(world->findings.empty()) << world->findings[0].text;
  ASSERT_EQ(world->models.size(), 2u);
  EXPECT_EQ(world->models[0].name, "ground_plane");
  const Model& bot = *world->models[1].model;
  ASSERT_EQ(bot.links.size(), 4u);  // none lost, in the file's order
  EXPECT_EQ(bot.links[0].name, "base_footprint");
  EXPECT_LT(bot.links[0].inertial.mass, 0.01);
  EXPECT_EQ(bot.links[1].inertial.mass, 5);
  EXPECT_EQ(bot.links[1].inertial.X_LI.translation, Vec3(0.1, 0, 0));
  EXPECT_EQ(bot.links[1].source.line, 4);
  EXPECT_LT((bot.links[2].X_ML.translation - Vec3(0, 0.2, 0.1)).norm(), 1e-12);
  EXPECT_NEAR(heading(bot.links[2].X_ML.rotation), 0.5, 1e-12);
  EXPECT_EQ(bot.links[1].visuals.at(0).material->diffuse, (Rgba{1, 0, 0, 1}));
  EXPECT_EQ(bot.links[1].collisions.at(0).surface.friction, 0.3);
  ASSERT_EQ(bot.sensors.size(), 1u);
  EXPECT_EQ(bot.sensors[0].link, 1);
  ASSERT_TRUE(bot.drive);
  EXPECT_DOUBLE_EQ(bot.drive->wheel_radius, 0.1);
  EXPECT_NEAR(world->models[1].X_WM.translation.z(), 0, 1e-6);
}

}  // namespace
}  // namespace ruedo::world
