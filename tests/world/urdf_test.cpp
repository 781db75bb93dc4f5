// Robot files as they are in the wild: URDF with a root link named world, values as attributes,
// packages found by their folders; arms without sensors; names with spaces; SDF with elements of
// its first versions.
#include <cstdlib>

#include <gtest/gtest.h>

#include "temporary_folder.h"
#include "world/load.h"
#include "world/load_model.h"
#include "world/model/body_layout.h"

namespace ruedo::world {
namespace {

std::vector<std::string> texts(const WorldModel& world) {
  std::vector<std::string> result;
  for (const Finding& each : world.findings) result.push_back(each.text);
  return result;
}

// An arm on a table of the world, 0.7 m up: its links are not loose, and do not lose a link to the
// world.
TEST(Urdf, ARootLinkNamedWorldFixesTheRobot) {
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

TEST(Urdf, ReportsMalformedOriginsAndKeepsTheRobot) {
  TemporaryFolder folder;
  const auto world = load_world(folder.write("bot.urdf", R"x(<robot name="bot">
  <link name="a"/><link name="b"/><link name="c"/>
  <joint name="one" type="fixed"><parent link="a"/><child link="b"/>
    <origin xyz="0.07, 0, -0.69" rpy="0 0 0"/></joint>
  <joint name="two" type="revolute"><parent link="b"/><child link="c"/>
    <origin xyz="$(optenv BOT_XYZ 1 2 3)"/><axis xyz="0 up 0"/>
    <limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>)x"));
  const Model& bot = *world->models.back().model;
  ASSERT_EQ(bot.joints.size(), 2u);
  EXPECT_EQ(bot.joints[0].X_MJ.translation, Vec3(0.07, 0, -0.69));
  EXPECT_EQ(bot.joints[1].X_MJ.translation, Vec3(0.07, 0, -0.69));
  EXPECT_EQ(bot.joints[1].axis.axis_in_J, Vec3::UnitX());
  std::vector<std::string> said;
  for (const Finding& each : world->findings)
    said.push_back(std::to_string(each.source.line) + " " + each.element + " " + each.text);
  EXPECT_EQ(said,
            (std::vector<std::string>{
                "4 joint one xyz=\"0.07, 0, -0.69\" of <origin> is not three numbers; its "
                "commas are taken for blanks",
                "6 joint two xyz=\"$(optenv BOT_XYZ 1 2 3)\" of <origin> is not three "
                "numbers; 0 0 0 is taken",
                "6 joint two xyz=\"0 up 0\" of <axis> is not three numbers; 1 0 0 is taken"}));
}

// One faulty link or joint does not cost the robot: it is repaired or left out, and reported.
TEST(Urdf, OneFaultyJointDoesNotCostTheRobot) {
  const std::string ends = "<parent link='base'/><child link='arm'/>", limit = "<limit lower='-1' ";
  struct Case {
    std::string inside;  // in line 2, after base, arm and a hand that is fixed to the arm
    std::string said;
    size_t links, joints;
  };
  const Case cases[] = {
      {"<joint name='j' type='revolute'>" + ends + "</joint>",
       "a revolute joint without <limit>; it has none", 3, 2},
      {"<joint name='j' type='prismatic'>" + ends + limit +
           "upper='x' effort='1' velocity='1'/></joint>",
       "<limit>: upper=\"x\" is not a number; it is left out", 3, 2},
      {"<joint name='j' type='hinge'>" + ends + "</joint>",
       "type 'hinge' is unknown; allowed are fixed, revolute, continuous, prismatic, planar and "
       "floating; it is taken as fixed",
       3, 2},
      {"<joint name='j'>" + ends + "</joint>",
       "type '' is unknown; allowed are fixed, revolute, continuous, prismatic, planar and "
       "floating; "
       "it is taken as fixed",
       3, 2},
      {"<joint name='j' type='continuous'>" + ends + "<mimic multiplier='2'/></joint>",
       "<mimic>: it names no joint; it is left out", 3, 2},
      {"<joint name='j' type='continuous'>" + ends + "<dynamics damping='some'/></joint>",
       "<dynamics>: damping=\"some\" is not a number; it is left out", 3, 2},
      {"<joint name='j' type='fixed'><child link='arm'/></joint>",
       "names no parent link; the joint is left out", 2, 1},
      {"<joint name='j' type='fixed'><parent link='nowhere'/><child link='arm'/></joint>",
       "its parent link 'nowhere' is not there; the joint is left out", 2, 1},
      {"<joint name='j' type='fixed'>" + ends +
           "</joint><joint name='k' type='fixed'><parent "
           "link='hand'/><child link='base'/></joint>",
       "'arm' would be its own ancestor; the joint is left out", 3, 2},
      {"<joint type='fixed'>" + ends + "</joint>",
       "a <joint> without a name; the joint is left out", 2, 1},
      {"<joint name='j' type='fixed'>" + ends + "</joint><link name='arm'/>",
       "a second <link> of the name 'arm'; the link is left out", 3, 2},
      {"<joint name='j' type='fixed'>" + ends + "</joint><link name='far'/>",
       "is not connected to 'base'; the link is left out", 3, 2},
  };
  for (const Case& each : cases) {
    TemporaryFolder folder;
    const auto world = load_world(folder.write(
        "bot.urdf",
        "<robot name='bot'><link name='base'/><link name='arm'/><link name='hand'/><joint name='h' "
        "type='continuous'><parent link='arm'/><child link='hand'/></joint>\n" +
            each.inside + "</robot>"));
    ASSERT_EQ(world->models.back().model->links.size(), each.links) << each.inside;
    EXPECT_EQ(world->models.back().model->joints.size(), each.joints) << each.inside;
    EXPECT_TRUE(std::any_of(world->findings.begin(), world->findings.end(), [&](const Finding& f) {
      return f.kind == Finding::Kind::error && f.source.line == 2 && f.text == each.said;
    })) << each.inside;
  }
}

// A joint without limits may turn and slide without bounds.
TEST(Urdf, AJointWithoutLimitsIsUnlimited) {
  TemporaryFolder folder;
  const auto world = load_world(folder.write(
      "bot.urdf",
      "<robot name='bot'><link name='a'/><link name='b'/><joint name='j' type='prismatic'><parent "
      "link='a'/><child link='b'/></joint></robot>"));
  const auto& axis = world->models.back().model->joints[ModelJointIndex(0)].axis;
  EXPECT_EQ(axis.lower, -std::numeric_limits<double>::infinity());
  EXPECT_EQ(axis.upper, std::numeric_limits<double>::infinity());
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
    EXPECT_EQ(std::string(error.what()),
              file +
                  ":2: <link>: 'world' is a reserved name; only the root of all links may have it, "
                  "which then is the world");
  }
}

TEST(Urdf, ReportsShapesOfTheWorldLink) {
  TemporaryFolder folder;
  const auto world = load_world(folder.write(
      "arm.urdf",
      R"(<robot name="arm"><link name="world"><visual><geometry><box size="1 1 1"/></geometry></visual></link>
<link name="base"/><joint name="j" type="fixed"><parent link="world"/><child link="base"/></joint></robot>)"));
  EXPECT_EQ(texts(*world),
            (std::vector<std::string>{
                "the link 'world' is the world itself; its shapes and sensors are left out"}));
}

TEST(Urdf, GravityIsTurnedOffByTextOrAttribute) {
  TemporaryFolder folder;
  const auto world = load_world(
      folder.write("bot.urdf", R"(<robot name="bot"><link name="a"/><link name="b"/><link name="c"/>
<joint name="ab" type="fixed"><parent link="a"/><child link="b"/></joint><joint name="bc" type="fixed"><parent link="b"/><child link="c"/></joint>
<gazebo reference="a"><turnGravityOff value="true"/></gazebo><gazebo reference="b"><turnGravityOff>true</turnGravityOff></gazebo>
<gazebo reference="c"><turnGravityOff value="false"/></gazebo></robot>)"));
  const Model& bot = *world->models.back().model;
  EXPECT_FALSE(bot.links.at(0).gravity);
  EXPECT_FALSE(bot.links.at(1).gravity);
  EXPECT_TRUE(bot.links.at(2).gravity);
}

constexpr const char* kHinged =
    "<link name='a'/><link name='b'/><joint name='j' "
    "type='revolute'><parent>a</parent><child>b</child><axis><xyz>0 0 1</xyz></axis></joint>";

std::shared_ptr<const WorldModel> world_with(const TemporaryFolder& folder,
                                             const std::string& models) {
  return load_world(
      folder.write("w.sdf", "<sdf version='1.9'><world name='w'>" + models + "</world></sdf>"));
}

// An arm without sensors is a robot: its joints take commands. A door is not, until the user says
// so.
TEST(Robots, AreModelsWhoseJointsTakeCommands) {
  TemporaryFolder folder;
  const std::string
      links = R"(<link name="a"/><link name="b"/><joint name="j" type=")",
      ends = R"("><parent link="a"/><child link="b"/><axis xyz="0 0 1"/></joint></robot>)";
  EXPECT_TRUE(
      load_world(folder.write("arm.urdf", "<robot name='arm'>" + links + "continuous" + ends))
          ->models.back()
          .is_robot());
  EXPECT_FALSE(load_world(folder.write("box.urdf", "<robot name='box'>" + links + "fixed" + ends))
                   ->models.back()
                   .is_robot());
  const auto is_robot = [&](const std::string& inside) {
    return world_with(folder, "<model name='m'>" + inside + "</model>")->models.at(0).is_robot();
  };
  const std::string hinged = kHinged;
  EXPECT_FALSE(is_robot(hinged));
  EXPECT_TRUE(is_robot(hinged + "<ruedo:joints/>"));
  EXPECT_FALSE(is_robot(hinged + "<ruedo:joints/><static>true</static>"));
  EXPECT_FALSE(is_robot("<link name='a'/><ruedo:joints/>"));
  EXPECT_TRUE(is_robot("<model name='arm'>" + hinged + "<ruedo:joints/></model>"));
  for (const char* plugin :
       {"gz-sim-joint-position-controller-system", "libignition-gazebo-joint-controller-system.so",
        "libgazebo_ros_control.so", "libgz_ros2_control-system.so",
        "gz-sim-joint-state-publisher-system", "libgazebo_ros_joint_pose_trajectory.so"}) {
    EXPECT_TRUE(is_robot(hinged + "<plugin name='p' filename='" + plugin + "'/>")) << plugin;
  }
  EXPECT_FALSE(is_robot(hinged + "<plugin name='p' filename='gz-sim-wind-effects-system'/>"));
}

// A file that runs elsewhere is not refused for names that no channel can have.
TEST(Robots, NamesAreMadeFitForChannels) {
  TemporaryFolder folder;
  const std::string eye = "<link name='l'><sensor name='front eye' type='imu'/></link>";
  const auto world =
      world_with(folder, "<model name='cart 1'>" + eye + "</model><model name='cart/1'>" + eye +
                             "</model><model name='a box'><link name='l'/></model>");
  ASSERT_EQ(world->models.size(), 3u);
  EXPECT_EQ(world->models[0].name, "cart_1");
  EXPECT_EQ(world->models[1].name, "cart_1_2");
  EXPECT_EQ(world->models[2].name, "a box");  // no robot: no channel
  EXPECT_EQ(world->models[0].model->sensors.at(0).name, "front_eye");
  EXPECT_EQ(texts(*world),
            (std::vector<std::string>{
                "the sensor name 'front eye' is not fit for a channel; it is called 'front_eye'",
                "the sensor name 'front eye' is not fit for a channel; it is called 'front_eye'",
                "the name is not fit for a channel; the robot is called 'cart_1'",
                "the name is not fit for a channel; the robot is called 'cart_1_2'"}));
  folder.write("cart.sdf", "<sdf version='1.9'><model name='cart 1'>" + eye + "</model></sdf>");
  LoadOptions options;
  options.spawns = {{folder / "cart.sdf", "", 3, 3, 0}};
  EXPECT_EQ(load_world(folder / "w.sdf", options)->models.back().name, "cart_1_3");
  EXPECT_EQ(load_world(folder / "cart.sdf")->models.back().name, "cart_1");
  EXPECT_EQ(load_model(folder / "cart.sdf", folder / "w.sdf").name, "cart_1");
}

// auto="true": a box of 0.2 x 0.4 x 0.6 m and 500 kg/m^3, 1 m up; two spheres on a line; a cylinder
// on its side.
TEST(AutoInertia, IsThatOfTheSolids) {
  TemporaryFolder folder;
  const auto world = [&](const std::string& inertial, const std::string& collisions) {
    return world_with(
        folder, "<model name='m'><link name='l'>" + inertial + collisions + "</link></model>");
  };
  const auto of = [&](const std::string& inertial, const std::string& collisions) {
    return world(inertial, collisions)->models.at(0).model->links[0].inertial;
  };
  const auto moments = [](const Inertial& i) { return Vec3(i.inertia.diagonal()); };
  const std::string sphere =
      "<geometry><sphere><radius>0.1</radius></sphere></geometry></collision>";
  const std::string box =
      "<collision name='a'><density>500</density><pose>0 0 1 0 0 0</pose><geometry><box><size>0.2 "
      "0.4 0.6</size></box></geometry></collision>";
  const Inertial one = of("<inertial auto='true'/>", box);
  EXPECT_NEAR(one.mass, 24, 1e-9);
  EXPECT_LT((one.X_LI.translation - Vec3(0, 0, 1)).norm(), 1e-12);
  EXPECT_LT((moments(one) - Vec3(1.04, 0.8, 0.4)).norm(), 1e-9);
  const Inertial told = of("<inertial auto='true'><mass>12</mass></inertial>", box);
  EXPECT_EQ(told.mass, 12);
  EXPECT_LT((moments(told) - Vec3(0.52, 0.4, 0.2)).norm(), 1e-9);

  const Inertial pair =
      of("<inertial auto='true'><density>3000</density></inertial>",
         "<collision name='a'><density>1000</density><pose>-0.5 0 0 0 0 0</pose>" + sphere +
             "<collision name='b'><pose>0.5 0 0 0 0 0</pose>" + sphere);
  const double light = 1000 * 4.0 / 3 * M_PI * 1e-3;
  EXPECT_NEAR(pair.mass, 4 * light, 1e-9);
  EXPECT_LT((pair.X_LI.translation - Vec3(0.25, 0, 0)).norm(), 1e-12);
  EXPECT_NEAR(pair.inertia(0, 0), 4 * light * 0.4 * 0.01, 1e-9);
  EXPECT_NEAR(pair.inertia(1, 1),
              4 * light * 0.4 * 0.01 + light * 0.75 * 0.75 + 3 * light * 0.25 * 0.25, 1e-9);

  const Inertial lying = of("<inertial auto='true'/>",
                            "<collision name='a'><pose>0 0 0 0 1.5707963267948966 "
                            "0</pose><geometry><cylinder><radius>0.1</radius><length>1</length></"
                            "cylinder></geometry></collision>");
  EXPECT_NEAR(lying.mass, 10 * M_PI, 1e-9);
  EXPECT_NEAR(lying.inertia(0, 0), 10 * M_PI * 0.005, 1e-9);
  EXPECT_NEAR(lying.inertia(2, 2), 10 * M_PI * (0.0025 + 1.0 / 12), 1e-9);
  EXPECT_EQ(texts(*world("<inertial auto='true'/>", box)), std::vector<std::string>{});
  EXPECT_EQ(texts(*world("<inertial auto='true'/>", "")).size(), 1u);  // nothing to compute it from
}

TEST(OldSdf, JointsNameLinksInAnElement) {
  TemporaryFolder folder;
  const auto world =
      world_with(folder,
                 "<model name='m'><link name='a'/><link name='b'><pose>0 0 2 0 0 0</pose></link>"
                 "<joint name='j' type='revolute'><pose>0 0 1 0 0 "
                 "0</pose><parent><link_name>world</link_name></parent><child><link_name>b</"
                 "link_name></child><axis><xyz>1 0 0</xyz></axis></joint></model>");
  EXPECT_EQ(texts(*world), std::vector<std::string>{});
  const Joint& joint = world->models.at(0).model->joints.at(0);
  EXPECT_EQ(joint.parent, -1);
  EXPECT_EQ(joint.child, 1);
  EXPECT_LT((joint.X_MJ.translation - Vec3(0, 0, 3)).norm(), 1e-12);  // in the child's frame
}

TEST(OldSdf, MaterialScriptsAreTexts) {
  TemporaryFolder folder;
  const auto colours = [&](const std::string& script) {
    return world_with(folder,
                      "<model name='m'><link name='l'><visual name='v'><geometry><box><size>1 1 "
                      "1</size></box></geometry><material>" +
                          script + "</material></visual></link></model>");
  };
  const auto red = colours("<script>Gazebo/Red</script>");
  EXPECT_EQ(texts(*red), std::vector<std::string>{});
  EXPECT_EQ(red->models.at(0).model->links[0].visuals[0].material->diffuse,
            colours("<script><name>Gazebo/Red</name></script>")
                ->models.at(0)
                .model->links[0]
                .visuals[0]
                .material->diffuse);
  EXPECT_EQ(texts(*colours("<script>Gazebo/Unheard</script>")),
            (std::vector<std::string>{
                "the material script 'Gazebo/Unheard' is not known; the colour is grey instead"}));
}

constexpr const char* kTetrahedron =
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

std::string robot_with_mesh(const std::string& uri) {
  return R"(<robot name="bot"><link name="a"><visual><geometry><mesh filename=")" + uri +
         R"("/></geometry></visual></link></robot>)";
}

// Without a manifest, and with one of another name: the folder that the robot's file is in has the
// package's name.
TEST(Urdf, PackagesGoByTheFolderThatTheFileIsIn) {
  TemporaryFolder folder;
  folder.write("bot_description/meshes/a.obj", kTetrahedron);
  const auto world =
      load_world(folder.write("bot_description/robots/eu/urdf/bot.urdf",
                              robot_with_mesh("package://bot_description/meshes/a.obj")));
  EXPECT_EQ(texts(*world), std::vector<std::string>{});
  folder.write("bot_description/package.xml", "<package><name>bot_descriptions</name></package>");
  EXPECT_EQ(texts(*load_world(folder / "bot_description/robots/eu/urdf/bot.urdf")),
            std::vector<std::string>{});
}

// Packages of a workspace lie beside each other, in folders of any name; a world's <include> finds
// robots there, and robots their meshes.
TEST(Urdf, FindsPackagesBesideEachOther) {
  TemporaryFolder folder;
  folder.write("src/one/package.xml", "<package><name>bot_gazebo</name></package>");
  folder.write("src/two/package.xml", "<package><name>bot_description</name></package>");
  folder.write("src/three/package.xml", "<package><name>bot_meshes</name></package>");
  folder.write("src/three/meshes/a.obj", kTetrahedron);
  folder.write("src/two/urdf/bot.urdf", robot_with_mesh("package://bot_meshes/meshes/a.obj"));
  const auto world = load_world(folder.write(
      "src/one/worlds/w.sdf",
      "<sdf version='1.9'><world name='w'><include><uri>package://bot_description/urdf/bot.urdf"
      "</uri></include></world></sdf>"));
  EXPECT_EQ(texts(*world), std::vector<std::string>{});
  ASSERT_EQ(world->models.size(), 1u);
  EXPECT_EQ(world->models[0].model->links.at(0).visuals.size(), 1u);
}

// urdfdom leaves out what comes after a fault in a link; here only the faulty part is.
TEST(Urdf, AFaultInALinkCostsThatPartAlone) {
  const std::string
      box = "<geometry><box size='1 1 1'/></geometry>",
      mass = "<mass value='2'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/>";
  const auto world = load_world_text(
      "<robot name='r'><link name='a'>\n<inertial>" + mass +
          "</inertial>\n<visual><origin xyz='0 0 0,5'/>" + box + "</visual>\n<visual>" + box +
          "</visual>\n<visual><geometry/></visual>\n<collision>" + box +
          "</collision>\n<collision><geometry><box size='1 1 "
          "${h}'/></geometry></collision></link></robot>",
      "/nowhere/r.urdf");
  const Link& link = world->models.back().model->links.at(0);
  EXPECT_EQ(link.visuals.size(), 1u);
  EXPECT_EQ(link.collisions.size(), 1u);
  EXPECT_EQ(link.inertial.mass, 2.0);
  std::vector<int> lines;
  for (const Finding& finding : world->findings) {
    EXPECT_EQ(finding.kind, Finding::Kind::error);
    lines.push_back(finding.source.line);
  }
  EXPECT_EQ(lines, (std::vector<int>{3, 5, 7}));
  const auto heavy = load_world_text(
      "<robot name='r'><link name='a'>\n<inertial><mass value='${m}'/></inertial>\n<collision>" +
          box + "</collision></link></robot>",
      "/nowhere/r.urdf");
  EXPECT_EQ(heavy->models.back().model->links.at(0).collisions.size(), 1u);
  ASSERT_FALSE(heavy->findings.empty());
  EXPECT_EQ(heavy->findings[0].source.line, 2);
}

TEST(Urdf, ReportsUnknownElementsOfGazeboBlocks) {
  const auto world = load_world_text(
      "<robot name='r'><link name='a'/><link name='b'/><joint name='j' type='continuous'><parent "
      "link='a'/><child link='b'/></joint>"
      "<gazebo reference='a'><mu1>0.5</mu1><kp>1e6</kp><colision/></gazebo>"
      "<gazebo "
      "reference='j'><springStiffness>5</springStiffness><provideFeedback>true</provideFeedback></"
      "gazebo></robot>",
      "/nowhere/r.urdf");
  EXPECT_EQ(texts(*world),
            (std::vector<std::string>{
                "<colision> in <gazebo reference=\"a\"> is not supported and left out"}));
  EXPECT_EQ(world->models.back().model->joints.at(0).axis.spring_stiffness, 5.0);
}

// As Gazebo takes them: springs of joints, colours, friction's direction, and elements of a link.
TEST(Urdf, GazeboBlocksAct) {
  const auto world = load_world_text(
      "<robot name='r'><link name='a'><visual><geometry><box size='1 1 1'/></geometry></visual>"
      "<collision><geometry><box size='1 1 1'/></geometry></collision></link><link name='b'/>"
      "<joint name='j' type='prismatic'><parent link='a'/><child link='b'/><limit lower='-1' "
      "upper='1' effort='1' velocity='1'/></joint><gazebo reference='a'><mu1>0.5</mu1><mu2>0.1"
      "</mu2><fdir1>0 1 0</fdir1><gravity>false</gravity><visual><material><diffuse>1 0 0 1"
      "</diffuse></material></visual></gazebo><gazebo reference='j'><springStiffness value='40'/>"
      "<springReference>-0.1</springReference></gazebo></robot>",
      "/nowhere/r.urdf");
  EXPECT_EQ(texts(*world), std::vector<std::string>{});
  const Model& model = *world->models.back().model;
  EXPECT_EQ(model.joints.at(0).axis.spring_stiffness, 40.0);
  EXPECT_EQ(model.joints[0].axis.spring_reference, -0.1);
  const Link& a = model.links.at(0);
  EXPECT_FALSE(a.gravity);
  EXPECT_EQ(a.collisions.at(0).surface.friction_direction, Vec3(0, 1, 0));
  EXPECT_EQ(a.collisions[0].surface.friction2, 0.1);
  EXPECT_EQ(a.visuals.at(0).material->diffuse, (Rgba{1, 0, 0, 1}));
}

// The user's own folder is not a package, whatever a file calls it.
TEST(Urdf, DoesNotSearchTheHomeFolderForPackages) {
  TemporaryFolder folder;
  folder.write("ann/pictures/a.obj", kTetrahedron);
  const std::string file =
      folder.write("ann/downloads/deep/bot.urdf", robot_with_mesh("package://ann/pictures/a.obj"));
  EXPECT_EQ(texts(*load_world(file)).size(), 0u);
  const char* home = std::getenv("HOME");
  const std::string before = home ? home : "";
  setenv("HOME", (folder / "ann").c_str(), 1);
  const auto told = texts(*load_world(file));
  setenv("HOME", before.c_str(), 1);
  EXPECT_EQ(told,
            (std::vector<std::string>{
                "the mesh 'package://ann/pictures/a.obj' is not found; the shape is left out"}));
}

}  // namespace
}  // namespace ruedo::world
