// One odd element does not refuse a world: it is left out or repaired, and named; the rest stands.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "temporary_folder.h"
#include "text_world.h"

namespace ruedo::world {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const char* const kBox =
    "<model name='box'><link name='l'><collision name='c'><geometry><box><size>1 1 "
    "1</size></box></geometry></collision></link></model>";

std::string with_shape(const std::string& shape) {
  return "<model name='m'><link name='l'><collision name='c'><geometry>" + shape +
         "</geometry></collision></link></model>";
}

TEST(OddElements, AWorldMayBeNamedWorld) {
  const auto world = load_world_text(
      "<sdf version='1.6'><world name='world'>" + std::string(kBox) + "</world></sdf>",
      "/nowhere/w.sdf");
  EXPECT_EQ(world->name, "world");
  EXPECT_THAT(texts(*world), IsEmpty());
  EXPECT_EQ(load_world_text("<sdf version='1.6'><world/></sdf>", "/nowhere/w.sdf")->name, "world");
}

// As in Gazebo Classic. For everything else, "world" is the world.
TEST(OddElements, RenamesAModelNamedWorld) {
  std::string model = kBox;
  model.replace(model.find("'box'"), 5, "'world'");
  const auto world = world_of(model +
                              "<model name='m'><pose relative_to='world'>1 0 0 0 0 0</pose>"
                              "<link name='l'/></model>");
  ASSERT_EQ(world->models.size(), 2u);
  EXPECT_EQ(world->models[0].name, "world_model");
  EXPECT_EQ(world->models[1].X_WM.translation.x(), 1.0);
  EXPECT_THAT(texts(*world),
              ElementsAre("'world' is a reserved name; the model is called 'world_model'"));
}

TEST(OddElements, APoseOfFiveNumbersHasNoYaw) {
  const auto world = world_of("<model name='m'><pose>1 2 3 0 0.5</pose><link name='l'/></model>");
  ASSERT_EQ(world->models.size(), 1u);
  EXPECT_EQ(world->models[0].X_WM.translation, Vec3(1, 2, 3));
  EXPECT_NEAR(world->models[0].X_WM.rotation.y(), std::sin(0.25), 1e-12);
  EXPECT_THAT(texts(*world), ElementsAre(HasSubstr("has 5 numbers")));
}

TEST(OddElements, APlacementFrameMayBeTheModelItself) {
  TemporaryFolder folder;
  folder.write("part.sdf",
               "<sdf version='1.9'><model name='part'><link name='l'><pose>1 0 0 0 0 0</pose>"
               "</link></model></sdf>");
  for (const std::string& own : {std::string("part"), std::string("other")}) {
    const auto world = load_world(folder.write(
        "w.sdf", "<sdf version='1.9'><world name='w'><include><uri>part.sdf</uri>" +
                     (own == "other" ? "<name>other</name>" : std::string()) + "<placement_frame>" +
                     own + "</placement_frame><pose>5 5 1 0 0 0</pose></include></world></sdf>"));
    ASSERT_EQ(world->models.size(), 1u) << own;
    EXPECT_EQ(world->models[0].X_WM.translation, Vec3(5, 5, 1)) << own;
    EXPECT_THAT(texts(*world), IsEmpty()) << own;
  }
}

// Beside a model at the root of a file there is only the world.
TEST(OddElements, AModelAtTheRootIsRelativeToNothing) {
  for (const char* frame : {"world", "nowhere"}) {
    const auto world = load_world_text("<sdf version='1.9'><model name='m'><pose relative_to='" +
                                           std::string(frame) +
                                           "'>1 0 0 0 0 0</pose><link name='l'/></model></sdf>",
                                       "/nowhere/m.sdf");
    EXPECT_EQ(world->models.back().X_WM.translation.x(), 1.0);
    if (frame == std::string("world"))
      EXPECT_THAT(texts(*world), IsEmpty());
    else
      EXPECT_THAT(texts(*world), ElementsAre(HasSubstr("is relative to 'nowhere'")));
  }
}

TEST(OddElements, AnActorsOwnShapesMove) {
  const auto world = world_of(
      "<actor name='cart'><link name='body'><pose>0 0 0.5 0 0 0</pose><collision name='c'><pose>1 "
      "0 "
      "0 0 0 0</pose><geometry><box><size>2 1 1</size></box></geometry></collision></link><script>"
      "<trajectory id='0'><waypoint><time>0</time><pose>0 0 0.2 0 0 0</pose></waypoint><waypoint>"
      "<time>4</time><pose>4 0 0.2 0 0 0</pose></waypoint></trajectory></script></actor>");
  ASSERT_EQ(world->models.size(), 1u);
  const Link& link = world->models[0].model->links[0];
  ASSERT_EQ(link.collisions.size(), 1u);
  EXPECT_EQ(link.collisions[0].geometry.shape, Shape::box);
  EXPECT_EQ(link.collisions[0].X_LC.translation, Vec3(1, 0, 0.5));
  EXPECT_EQ(world->models[0].X_WM.translation.z(), 0.2);
  EXPECT_THAT(texts(*world), IsEmpty());
}

TEST(OddElements, AFaultyModelLeavesTheRestOfTheWorld) {
  const auto world =
      world_of(with_shape("<mesh><uri>x.dae</uri><scale>1 0 0</scale></mesh>") +
               "<model name='odd'><pose>one two</pose><link name='l'/></model>" + kBox);
  ASSERT_EQ(world->models.size(), 2u);
  EXPECT_THAT(
      texts(*world),
      ElementsAre("<scale>: '1 0 0' has a zero; a mesh cannot be flat; the shape is left out",
                  HasSubstr("; the model is left out")));
  EXPECT_EQ(world->models[1].name, "box");
}

TEST(OddElements, ASphereWithoutARadiusHasTheFormatsOwn) {
  const auto world = world_of(with_shape("<sphere/>"));
  EXPECT_EQ(world->models[0].model->links[0].collisions.at(0).geometry.size.x(), 1.0);
  EXPECT_THAT(texts(*world),
              ElementsAre("a <sphere> without <radius>; it is 1 as in SDF's description"));
}

TEST(OddElements, APlaneOfThreeNumbers) {
  const auto world = world_of(with_shape("<plane><size>4 5 1</size></plane>"));
  EXPECT_EQ(world->models[0].model->links[0].collisions.at(0).geometry.extent,
            Eigen::Vector2d(4, 5));
  EXPECT_THAT(texts(*world),
              ElementsAre("<size> of a plane has two numbers; the third is left out"));
}

// A frame is dropped for another thing of the same name, wherever that is.
TEST(OddElements, AFrameNamedLikeSomethingElse) {
  const auto world = world_of("<frame name='box'/>" + std::string(kBox));
  ASSERT_EQ(world->models.size(), 1u);
  EXPECT_EQ(world->models[0].name, "box");
  EXPECT_THAT(texts(*world),
              ElementsAre("<frame>: the name 'box' is taken in the world; the frame is left out"));
  const auto inner = world_of(
      "<model name='m'><frame name='l'><pose>0 0 5 0 0 0</pose></frame><link name='l'><pose>0 0 1 "
      "0 0 0</pose></link><link name='k'><pose relative_to='l'>0 0 1 0 0 0</pose></link></model>");
  EXPECT_EQ(link_of(*inner->models.at(0).model, "k").X_ML.translation.z(), 2.0);
}

TEST(OddElements, OfAnotherKindOfSensor) {
  const auto sensor = [](const std::string& type, const std::string& inside) {
    return texts(*world_of("<model name='m'><link name='l'><sensor name='s' type='" + type + "'>" +
                           inside + "</sensor></link></model>"));
  };
  const std::string camera = "<camera><horizontal_fov>1</horizontal_fov></camera>", ray = "<ray/>";
  EXPECT_THAT(sensor("gpu_lidar", ray + camera),
              ElementsAre("<camera> in a <sensor> of type 'gpu_lidar' is left out: it describes "
                          "other sensors"));
  EXPECT_THAT(sensor("camera", camera + "<imu/>"),
              ElementsAre("<imu> in a <sensor> of type 'camera' is left out: it describes other "
                          "sensors"));
  EXPECT_THAT(sensor("depth_camera", camera), IsEmpty());
  EXPECT_THAT(sensor("gps", "<navsat/>"), IsEmpty());
  EXPECT_THAT(sensor("makers_own", ray + camera), IsEmpty());
}

// URDF lets a joint have the name of a link; both stay.
TEST(OddElements, AJointMayHaveTheNameOfALink) {
  const auto world = world_of(
      "<model name='m'><joint name='a' type='revolute'><pose>0 0 1 0 0 0</pose><parent>base"
      "</parent><child>a</child><axis><xyz>0 1 0</xyz></axis></joint><link name='base'/>"
      "<link name='a'><pose>0 0 2 0 0 0</pose></link></model>");
  EXPECT_THAT(texts(*world), ElementsAre("the joint 'a' has the name of a link; as a frame the "
                                         "name is the link's"));
  const Model& model = *world->models[0].model;
  ASSERT_EQ(model.joints.size(), 1u);
  EXPECT_EQ(model.joints[0].name, "a");
  EXPECT_EQ(model.joints[0].X_MJ.translation.z(), 3.0);  // its pose is in its child
  EXPECT_EQ(model.links[1].X_ML.translation.z(), 2.0);
  const auto twice = world_of(
      "<model name='m'><link name='a'/><link name='b'/><joint name='j' type='fixed'><parent>a"
      "</parent><child>b</child></joint><joint name='j' type='fixed'><parent>a</parent><child>b"
      "</child></joint></model>");
  EXPECT_EQ(twice->models[0].model->joints.size(), 1u);
  EXPECT_THAT(texts(*twice), ElementsAre(HasSubstr("the name 'j' is taken")));
}

TEST(OddElements, TwoRobotsOfOneName) {
  const std::string robot =
      "<model name='r'><link name='l'><sensor name='odometry' type='imu'/></link></model>";
  const auto world = world_of(robot + robot);
  ASSERT_EQ(world->models.size(), 2u);
  EXPECT_EQ(world->models[1].name, "r_2");
  EXPECT_EQ(world->models[0].model->sensors.at(0).name,
            "odometry_sensor");  // that name is the robot's own channel's
}

TEST(OddElements, AMissingPrefixIsGuessed) {
  EXPECT_THAT(texts(*world_of("<model name='m'><link name='l'/><drive/></model>")),
              ElementsAre("<drive> is not known and left out; did you mean <ruedo:drive>?"));
}

TEST(OddElements, ReportsElementsThatWereSilentlyIgnored) {
  const auto named = [](const std::string& inside) { return texts(*world_of(inside)); };
  EXPECT_THAT(
      named("<wind/><atmosphere type='adiabatic'/><magnetic_field>1e-5 0 0</magnetic_field>"),
      IsEmpty());  // written by Gazebo into every world
  EXPECT_THAT(named("<model name='m'><link name='l'><battery name='b'/></link></model>"),
              ElementsAre(HasSubstr("<battery> is not supported")));
  EXPECT_THAT(
      named("<model name='m'><link "
            "name='l'><inertial><mass>1</mass><fluid_added_mass/></inertial></link></model>"),
      ElementsAre(HasSubstr("<fluid_added_mass> is not supported")));
  const std::string links = "<link name='a'/><link name='b'/>";
  const auto joint = [&](const std::string& physics) {
    return "<model name='m'>" + links +
           "<joint name='j' type='fixed'><parent>a</parent><child>b</child>" + physics +
           "</joint></model>";
  };
  EXPECT_THAT(
      named(joint("<physics><ode><limit><cfm>0</cfm><erp>0.2</erp></limit></ode></physics>")),
      IsEmpty());
  EXPECT_THAT(named(joint("<physics><ode><limit><cfm>0.01</cfm></limit></ode></physics>")),
              ElementsAre(HasSubstr("<physics> of a joint is not supported")));
}

// Deep inside an element, too, and in attributes.
TEST(OddElements, ReportsElementsThatSdfLacks) {
  const auto named = [](const std::string& inside) { return texts(*world_of(inside)); };
  EXPECT_THAT(
      named("<model name='m'><link name='l'><collision name='c'><geometry><box><size>1 1 "
            "1</size></box></geometry><surface><friction><ode><mu3>1</mu3></ode></friction>"
            "<contact><ode><tension>1</tension></ode></contact></surface></collision></link>"
            "</model>"),
      ElementsAre("<mu3> in <ode> is not known and left out; did you mean <mu>?",
                  HasSubstr("<tension> in <ode> is not supported and left out")));
  EXPECT_THAT(named("<model name='m'><link name='l'><sensor name='s' type='imu'><imu><angular_"
                    "velocity><x><noise type='gaussian'><sigma>1</sigma></noise></x></angular_"
                    "velocity></imu></sensor></link></model>"),
              ElementsAre(HasSubstr("<sigma> in <noise> is not supported and left out")));
  EXPECT_THAT(named("<model name='m'><link name='l'><sensor name='s' type='thermometer'>"
                    "<thermometer><power>1</power></thermometer></sensor></link></model>"),
              IsEmpty());  // a plugin's own
  EXPECT_THAT(
      named("<model name='m' namespace='fleet'><link name='l'/></model>"),
      ElementsAre("namespace=\"fleet\" of <model> is not supported: channels begin with the "
                  "model's name"));
}

// Whatever a name holds: what follows a line end would look like another finding.
TEST(OddElements, AFindingIsOneLine) {
  const auto world = world_of("<model name='m&#10;error: no'><colision/><link name='l'/></model>");
  ASSERT_EQ(world->findings.size(), 1u);
  EXPECT_EQ(world->findings[0].element, "model m error: no");
}

// Readers take the first. In Ruedo's own elements, too.
TEST(OddElements, ReportsDuplicateElements) {
  const auto named = [](const std::string& inside) { return texts(*world_of(inside)); };
  const auto left_out = [](const std::string& what, const std::string& in) {
    return "a second <" + what + "> in <" + in + "> is left out; the first one counts";
  };
  EXPECT_THAT(named("<model name='m'><pose>1 0 0 0 0 0</pose><pose>2 0 0 0 0 0</pose>"
                    "<link name='l'><inertial><mass>1</mass><mass>2</mass></inertial></link>"
                    "</model>"),
              ElementsAre(left_out("pose", "model"), left_out("mass", "inertial")));
  EXPECT_THAT(named("<ruedo:crowd name='c'><ruedo:area>0 0 1 1</ruedo:area><ruedo:count>1"
                    "</ruedo:count><ruedo:goal>0 0</ruedo:goal><ruedo:goal>1 1</ruedo:goal>"
                    "<ruedo:count>2</ruedo:count></ruedo:crowd>"),
              ElementsAre(left_out("ruedo:count", "ruedo:crowd")));
  // Elements that may occur several times, and those of a plugin's sensor
  EXPECT_THAT(named("<model name='m'><link name='l'><sensor name='s' type='thermometer'><zone/>"
                    "<zone/></sensor></link><link name='k'/><frame name='f'/><frame name='g'/>"
                    "</model>"),
              IsEmpty());
  const auto robot = load_world_text(
      "<robot name='r'><link name='a'><visual><geometry><box size='1 1 1'/><sphere radius='1'/>"
      "</geometry></visual></link><link name='b'/><joint name='j' type='fixed'><parent "
      "link='a'/><child link='b'/><origin xyz='1 0 0'/><origin xyz='2 0 0'/></joint></robot>",
      "/nowhere/r.urdf");
  EXPECT_THAT(texts(*robot),
              ElementsAre(left_out("sphere", "geometry"), left_out("origin", "joint")));
}

TEST(OddElements, ReportsElementsThatUrdfLacks) {
  const auto world = load_world_text(
      "<robot name='r'><link name='a'><collisoin/><visual><geometry><box size='1 1 "
      "1'/></geometry></visual></link><link name='b'/>\n"
      "<joint name='j' type='revolute'><parent link='a'/><child link='b'/><limit efort='1' "
      "effort='1' velocity='1' lower='0' upper='1'/>"
      "<safety_controller k_velocity='1'/></joint></robot>",
      "/nowhere/r.urdf");
  EXPECT_THAT(texts(*world),
              ElementsAre("<collisoin> in <link> is not known and left out; did you mean "
                          "<collision>?",
                          "efort=\"1\" of <limit> is not supported and left out; did you mean "
                          "effort?"));
  EXPECT_EQ(world->findings[1].source.line, 2);
}

// One list of their addresses with the command that fetches them, instead of a text for each.
TEST(OddElements, ListsMissingModelsOfFuelOnce) {
  const auto world = world_of(
      "<include><uri>https://fuel.gazebosim.org/1.0/OpenRobotics/models/No Such "
      "One</uri></include><include><uri>https://fuel.gazebosim.org/1.0/OpenRobotics/models/Nor "
      "This</uri></include>");
  ASSERT_EQ(world->findings.size(), 2u);
  EXPECT_EQ(world->findings[0].text, world->findings[1].text);
  EXPECT_THAT(world->findings[1].element, HasSubstr("models/Nor This"));
}

// assimp takes a colour with a leading blank for no colour, and then rejects the whole mesh.
TEST(OddElements, ColladaWithABlankBeforeItsColours) {
  TemporaryFolder folder;
  folder.write(
      "models/bench/m.dae",
      R"(<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset><unit meter="1"/><up_axis>Z_UP</up_axis></asset>
<library_effects><effect id="e"><profile_COMMON><technique sid="c"><lambert><diffuse><color> 0.25 0.5 0.75 1</color></diffuse></lambert></technique></profile_COMMON></effect></library_effects>
<library_materials><material id="m"><instance_effect url="#e"/></material></library_materials>
<library_geometries><geometry id="g"><mesh><source id="p"><float_array id="a" count="12"> 0 0 0 1 0 0 0 1 0 0 0 1</float_array><technique_common><accessor source="#a" count="4" stride="3">
<param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source><vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles material="s" count="4"><input semantic="VERTEX" source="#v" offset="0"/><p> 0 2 1 0 1 3 0 3 2 1 2 3</p></triangles></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="vs"><node id="n"><instance_geometry url="#g"><bind_material><technique_common><instance_material symbol="s" target="#m"/></technique_common></bind_material></instance_geometry></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#vs"/></scene></COLLADA>)");
  // Also by an address that begins at the folder above the models.
  const auto world =
      load_world(folder.write("models/bench/model.sdf",
                              "<sdf version='1.6'><model name='bench'><link name='l'><visual "
                              "name='v'><geometry><mesh><uri>file://models/bench/m.dae</uri></"
                              "mesh></geometry></visual></link></model></sdf>"));
  EXPECT_THAT(texts(*world), IsEmpty());
  const auto& visuals = world->models.back().model->links[0].visuals;
  ASSERT_EQ(visuals.size(), 1u);
  EXPECT_EQ(visuals[0].geometry.mesh->triangles.size(), 4u);
  EXPECT_NEAR(visuals[0].geometry.mesh->materials.at(0).diffuse[1], 0.5, 1e-6);
}

// Of Gazebo Classic's window, and of the later Gazebo's; a faulty one costs nothing.
TEST(Viewpoint, IsThatOfTheFilesWindow) {
  const auto seen = [](const std::string& gui) {
    return world_of("<gui>" + gui + "</gui>")->viewpoint;
  };
  const auto classic = seen("<camera name='c'><pose>1 2 3 0 0.5 0.1</pose></camera>");
  ASSERT_TRUE(classic);
  EXPECT_EQ(classic->translation, Vec3(1, 2, 3));
  EXPECT_TRUE(
      seen("<plugin filename='MinimalScene' name='v'><camera_pose>-6 0 6 0 0.5 0"
           "</camera_pose></plugin>"));
  EXPECT_FALSE(seen("<camera name='c'/>"));
  const auto faulty = world_of("<gui><camera name='c'><pose>a b c 0 0 0</pose></camera></gui>");
  EXPECT_FALSE(faulty->viewpoint);
  ASSERT_EQ(faulty->findings.size(), 1u);
  EXPECT_EQ(faulty->findings[0].kind, Finding::Kind::unsupported);
}

}  // namespace
}  // namespace ruedo::world
